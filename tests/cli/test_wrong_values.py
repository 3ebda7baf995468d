"""Numbers and paths on the command line that cannot be: exit code 2 and one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.cli.crash import attempt
from harness.cli.main import _called
from harness.report.document import Report

LONG, LONGER = "a" * 300, "a" * 5000
DIGITS = "9" * 400


@pytest.fixture
def crosscheck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run `crosscheck ARGS` in this process, and return the one line on stderr; the exit code must be 2."""
    monkeypatch.chdir(tmp_path)

    def call(*args: str) -> str:
        monkeypatch.setattr(sys, "argv", ["crosscheck", *args])
        code = attempt(_called)
        line = capsys.readouterr().err
        assert (code, line.count("\n")) == (2, 1), line
        return line

    return call


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e300", "0", "-1", DIGITS, "9" * 5000])
@pytest.mark.parametrize(
    ("args", "option"),
    [
        (("run", "sixr"), "--start-timeout"),
        (("run", "sixr"), "--block-timeout"),
        (("run", "sixr"), "--memory-limit"),
        (("diff", "sixr", "sixr"), "--tolerance"),
        (("worker-check", "x"), "--start-timeout"),
        (("worker-check", "x"), "--block-timeout"),
    ],
)
def test_quantities(crosscheck: Callable[..., str], args: tuple[str, ...], option: str, value: str) -> None:
    line = crosscheck(args[0], option, value, *args[1:])
    assert line.startswith(f"error: Invalid value for '{option}': expected ")
    assert len(line) < 200


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--samples", DIGITS, "expected samples <= 1000000000000, got an integer of about 401 digits"),
        ("--samples", f"-{DIGITS}", "expected samples >= 0, got an integer of about 401 digits"),
        ("--seed", DIGITS, "expected 0 <= seed < 2^64, got an integer of about 401 digits"),
        ("--jobs", DIGITS, "expected jobs >= 0 and <= 1024, got an integer of about 401 digits"),
        ("--jobs", "1025", "expected jobs >= 0 and <= 1024, got 1025"),
        ("--worker", "\udcff=x", "--worker: expected NAME=COMMAND"),
    ],
)
def test_counts(crosscheck: Callable[..., str], option: str, value: str, message: str) -> None:
    assert message in crosscheck("run", "sixr", option, value)


@pytest.mark.parametrize(
    "args",
    [
        ("run", LONG),
        ("run", LONGER),
        ("run", f"/{LONG}/"),
        ("run", "sixr", "--models", LONG),
        ("run", "sixr", "--out", LONG),
        ("frames", LONG),
        ("frames", f"{LONG}.urdf"),
        ("diff", LONG, "sixr"),
        ("diff", f"{LONG}.csv", "sixr"),
        ("diff", f"{LONG}:{LONG}", "sixr"),
        ("identify", LONGER),
        ("derive-dh", LONG),
        ("render", f"{LONG}.json"),
        ("accept", "sixr", "--accepted", LONG),
        ("export-urdf", "sixr", "--out", LONG),
        ("mutate", LONG),
        ("worker-check", "--robot", LONG, "x"),
    ],
    ids=" ".join,
)
def test_names_that_no_file_can_have(crosscheck: Callable[..., str], args: tuple[str, ...]) -> None:
    crosscheck(*args)


def test_a_urdf_that_no_file_can_be(crosscheck: Callable[..., str], copy_model: Callable[..., Path]) -> None:
    folder = copy_model("sixr", ("model.toml", 'file = "', f'file = "{LONG}'))
    assert "File name too long" in crosscheck("run", str(folder))


def test_a_package_without_a_name(crosscheck: Callable[..., str]) -> None:
    assert "expected PACKAGE:FILE.urdf, got ':x.urdf'" in crosscheck("diff", ":x.urdf", "sixr")


def test_a_path_that_is_no_text(
    copy_model: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy_model("sixr")
    odd = tmp_path / "models" / os.fsdecode(b"six\xff")
    folder.rename(odd)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        sys, "argv", ["crosscheck", "run", str(odd), "--source", "dh:pinocchio", "--samples", "1", "--in-process"]
    )
    assert attempt(_called) == 0, capsys.readouterr().err
    report = Report.model_validate_json((tmp_path / "reports" / "sixr.json").read_text())
    assert "six\\xff" in report.settings.command
