"""Ctrl-C, once and twice: exit code 130, and no process is left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import psutil
import pytest

from tests.cli.test_crash import BURST


def started(command: Sequence[str], folder: Path) -> subprocess.Popen[str]:
    """A process whose SIGINT is as a terminal gives it."""
    return subprocess.Popen(
        [sys.executable, *command], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(folder)},
    )  # fmt: skip


def descendants(process: subprocess.Popen[str], wanted: str) -> list[psutil.Process]:
    """All processes below it, once one of them runs `wanted`."""
    for _ in range(600):
        below = psutil.Process(process.pid).children(recursive=True)
        for child in below:
            try:
                if wanted in " ".join(child.cmdline()):
                    return below
            except psutil.Error:
                continue
        assert process.poll() is None, process.communicate()
        time.sleep(0.1)
    raise AssertionError(f"no {wanted} within a minute")


def interrupted(process: subprocess.Popen[str], times: int, pause: float) -> str:
    """Interrupt it so many times. Returns what it says on stderr."""
    try:
        for _ in range(times):
            process.send_signal(signal.SIGINT)
            time.sleep(pause)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert "Exception ignored" not in err
    return err


def test_the_second_one_ends_a_clean_up_that_takes_long(tmp_path: Path) -> None:
    process = started(["-c", BURST, "stubborn"], tmp_path)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    start = time.monotonic()
    interrupted(process, 2, 1.0)
    assert time.monotonic() - start < 30.0


RUN = ("run", "sixr", "--source", "urdf:pinocchio", "--samples", "100000000", "--no-certify")
MUTATE = ("mutate", "sixr", "--jobs", "2", "--quiet")


@pytest.mark.parametrize(("times", "pause"), [(1, 0.0), (2, 0.02), (3, 0.0)])
@pytest.mark.parametrize(("command", "wanted"), [(RUN, "worker.py"), (MUTATE, "spawn_main")], ids=["run", "mutate"])
def test_no_process_is_left(tmp_path: Path, command: Sequence[str], wanted: str, times: int, pause: float) -> None:
    process = started(["-m", "harness", *command], tmp_path)
    try:
        below = descendants(process, wanted)
        time.sleep(1.0)
        err = interrupted(process, times, pause)
    finally:
        process.kill()
    assert err.strip() in ("interrupted: reports written before are unchanged", "")
    assert times > 1 or err
    _, alive = psutil.wait_procs(below, timeout=10)
    assert [child for child in alive if child.is_running()] == []
