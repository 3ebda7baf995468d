"""The C++ controller against the in-house FK, over 10 000 random configurations. Run by `nox -s cpp`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

WORKER = os.environ["FK_WORKER"]


@pytest.mark.parametrize(
    ("robot", "options"),
    [
        ("ur5", ""),
        ("panda", "--convention modified"),
        ("stanford", "--base '0 0 0 -pi/2 0 0' --tool '0 0 0 0 0 -pi/2'"),
    ],
)
def test_it_agrees_to_rounding(robot: str, options: str, tmp_path: Path) -> None:
    command = f"{WORKER} {{model}}/dh.csv {options}"
    arguments = ["--source", "dh:pinocchio", "--worker", f"dh:cpp={command}", "--samples", "10000", "--out", str(tmp_path)]
    run = [sys.executable, "-m", "harness", "run", robot, *arguments, "--json"]
    result = subprocess.run(run, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    report = json.loads(result.stdout)
    (source,) = [s for s in report["sources"] if s["name"] == "dh:cpp"]
    assert source["verdict"] == "agrees"
    assert len(source["frames"]) == sum(1 for _ in report["frames"])
    worst = max(frame["position"]["max"] for frame in source["frames"])
    tested = source["tested"]
    print(f"{robot}: dh:cpp off by at most {worst:.1e} m; tested against dh.csv at {tested['configurations']} configurations")
    assert tested["problem"] == ""
    assert worst < 1e-14
