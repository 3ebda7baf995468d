"""Run by the Python that has the Robotics Toolbox: prints its DH tables as one line of JSON."""

from __future__ import annotations

import importlib
import json
import sys
from typing import Any


def tables() -> dict[str, Any]:
    """Every DHRobot that can be built without arguments and has numbers for its parameters, by class name."""
    rtb = importlib.import_module("roboticstoolbox")
    robots: dict[str, Any] = {}
    for name, model in vars(rtb.models.DH).items():
        if not (isinstance(model, type) and issubclass(model, rtb.DHRobot)):
            continue
        try:
            robot = model()
            rows = [
                {"a": float(k.a), "alpha": float(k.alpha), "d": float(k.d), "theta": float(k.theta), "slides": bool(k.sigma),
                 "offset": float(k.offset)}
                for k in robot.links
            ]  # fmt: skip
            data = {"rows": rows, "modified": bool(robot.mdh), "base": robot.base.A.tolist(), "tool": robot.tool.A.tolist()}
            json.dumps(data, allow_nan=False)
        except Exception as error:  # each model has a constructor of its own; one may want arguments, or be symbolic
            sys.stderr.write(f"{name} is no table of numbers: {type(error).__name__}: {error}\n")
        else:
            robots[name] = data
    return robots


if __name__ == "__main__":
    print(json.dumps(tables()))
