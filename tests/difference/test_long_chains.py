"""Chains of hundreds of joints: within memory and time, in a process of their own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

# The process measures itself: what the tests had in memory before does not count.
PROGRAM = """
import json, resource, sys, time
import numpy as np
from pathlib import Path
from harness.api import diff, identify

def urdf(joints, seed):
    rng = np.random.default_rng(seed)
    links = "".join(f"<link name='l{i}'/>" for i in range(joints + 1))
    for i in range(joints):
        xyz, rpy = (" ".join(f"{x:.3f}" for x in rng.uniform(-0.3, 0.3, 3)) for _ in range(2))
        links += (f"<joint name='j{i}' type='continuous'><parent link='l{i}'/><child link='l{i + 1}'/>"
                  f"<origin xyz='{xyz}' rpy='{rpy}'/><axis xyz='0 0 1'/></joint>")
    return f"<robot name='r'>{links}</robot>"

command, joints = sys.argv[1], int(sys.argv[2])
chains = [urdf(joints, seed) for seed in (0, 1)]
models = Path(sys.argv[3])
result = identify(chains[0], models=models) if command == "identify" else diff(*chains, models=models)
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
status = Path("/proc/self/status")  # there: since this program began; the other one remembers the process that started it
if status.exists():
    memory = int(next(line for line in status.read_text().splitlines() if line.startswith("VmHWM")).split()[1])
print(json.dumps({"text": str(result), "MiB": memory / 1024, "seconds": time.process_time()}))
"""


@pytest.mark.parametrize(("command", "joints"), [("identify", 900), ("diff", 300)])
def test_hundreds_of_joints_within_one_gibibyte(command: str, joints: int, tmp_path: Path) -> None:
    folder = tmp_path / "models" / "none"
    folder.mkdir(parents=True)
    (folder / "model.toml").touch()
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, command, str(joints), str(folder.parent)],
        capture_output=True,
        text=True,
        timeout=500,
        check=True,
    )
    measured = json.loads(done.stdout)
    assert measured["MiB"] < 512
    assert measured["seconds"] < 120
    if command == "identify":
        assert measured["text"].startswith("the mechanism (l0 to l900): 900 joints, RRR")
        assert "no known table has such joints" in measured["text"]
        assert len(measured["text"].splitlines()[0]) < 300
    else:
        assert "no cause is searched for in chains of more than 100 joints, these have 300" in measured["text"]
