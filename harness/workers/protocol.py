"""The worker protocol, version 1: what goes over the pipes (docs/worker-protocol.md). Shared by both ends.

Greeting (one line of JSON) -> answer (one line of JSON) -> blocks of little-endian float64: N, then q (N, n) to the worker;
N, seconds, then placements (N, F, 4, 4) from it. N = -1 and one line of JSON instead: this block failed. N = 0 to a worker
that offers it: another greeting follows.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.description.packaged import Packaged
from harness.description.urdf import UrdfText
from harness.engines.base import Description

PROTOCOL = "fk-crosscheck"
VERSION = 1
MAX_BLOCK = 4096  # configurations in one block, a limit of the protocol
FAILED = -1.0
FLOAT = np.dtype("<f8")
AGAIN = np.zeros(1, FLOAT).tobytes()


def greeting(description: Description, frames: tuple[str, ...]) -> bytes:
    """The first line to a worker.

    Args:
        description: the description it is to place.
        frames: names of the frames that are wanted.
    """
    return line({"protocol": PROTOCOL, "version": VERSION, "frames": list(frames), "description": encode(description)})


def line(message: dict[str, Any]) -> bytes:
    """One message as one line."""
    return json.dumps(message).encode() + b"\n"


def encode(description: Description) -> dict[str, Any]:
    """A description as JSON, see docs/worker-protocol.md. Floats survive unchanged."""
    if isinstance(description, DHTable):
        return {
            "kind": "dh",
            "convention": description.convention,
            "base": description.base.tolist(),
            "tool": description.tool.tolist(),
            "rows": [
                {"joint": r.name, "type": r.kind, "a": r.a, "alpha": r.alpha, "d": r.d, "theta": r.theta}
                for r in description.rows
            ],
        }
    if isinstance(description, Packaged):
        return {"kind": "packaged", "robot": description.robot, "joints": list(description.joints)}
    return {"kind": "urdf", "text": description.text, "tip": description.tip}


def decode(message: dict[str, Any]) -> Description:
    """The description of a greeting.

    Raises:
        KeyError: a part of it is missing.
        ValueError: this version does not know its kind.
    """
    kind = message["kind"]
    if kind == "dh":
        rows = tuple(
            DHRow(name=r["joint"], kind=r["type"], a=r["a"], alpha=r["alpha"], d=r["d"], theta=r["theta"])
            for r in message["rows"]
        )
        return DHTable(rows, message["convention"], np.array(message["base"]), np.array(message["tool"]))
    if kind == "packaged":
        return Packaged(message["robot"], tuple(message["joints"]))
    if kind == "urdf":
        return UrdfText(message["text"], tip=message["tip"])
    raise ValueError(f"expected a description of kind dh, urdf or packaged, got {kind!r}")
