"""`--probe-seed`: a number, or a fresh one that the report records and its command line repeats."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.report.json_file import read_report

Cli = Callable[..., "subprocess.CompletedProcess[str]"]
RUN = ("run", "sixr", "--source", "urdf:pinocchio", "--samples", "5", "--no-explain", "--in-process")


def test_a_fresh_seed_is_recorded(cli: Cli, tmp_path: Path) -> None:
    assert cli(*RUN, "--probe-seed", "fresh").returncode == 0
    settings = read_report(tmp_path / "reports" / "sixr.json").settings
    assert settings.probe_seed > 0
    assert f"--probe-seed {settings.probe_seed}" in settings.command
    assert settings.seed == 0


def test_a_seed_by_hand(cli: Cli, tmp_path: Path) -> None:
    assert cli(*RUN, "--probe-seed", "123").returncode == 0
    assert read_report(tmp_path / "reports" / "sixr.json").settings.command.endswith("--probe-seed 123 --no-explain")


@pytest.mark.parametrize("value", ["new", "1.5", "-1", "18446744073709551616"])
def test_no_seed(cli: Cli, value: str) -> None:
    done = cli(*RUN, "--probe-seed", value)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
