"""A sample of what `bench/kill_runs.py` does a hundred times: runs killed at random moments, and started again."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[2] / "bench" / "kill_runs.py"
LONGEST = 600  # seconds


def test_runs_that_are_killed_leave_all_old_or_all_new_reports(tmp_path: Path) -> None:
    command = [sys.executable, str(BENCH), "3", "--samples", "5000", "--seed", "2"]
    env = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": os.pathsep.join([str(BENCH.parents[1]), *sys.path])}
    process = subprocess.Popen(
        command, cwd=tmp_path, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    try:
        output, _ = process.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired:
        pytest.fail(f"not ended after {LONGEST} s")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # and what it has started
        process.wait()
    assert process.returncode == 0, output
    assert "3 runs over sixr, stanford, ur5 killed: none half done, all ended with the same numbers" in output
    assert sum(int(n) for n in re.findall(r"^ *(\d+) x ", output, re.MULTILINE)) == 3
    assert list(tmp_path.iterdir()) == []
