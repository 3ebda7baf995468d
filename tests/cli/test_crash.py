"""What nobody foresaw: exit code 70 and one line, never 1; the other robots are still checked."""

from __future__ import annotations

import errno
import os
import re
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from harness import api
from harness.cli import run as module
from harness.cli.crash import attempt
from harness.cli.run import run
from harness.errors import EngineUnavailable, InputError
from harness.rendering.files import write_report
from harness.report.document import Report

FAST = ("--source", "urdf:pinocchio", "--samples", "1", "--no-certify", "--no-explain", "--in-process")
LINE = r"error: a fault of the harness, not of the input: {}; please report it, with (\S+), to the issue tracker of the project\n"


class Panic(BaseException):
    """As a library in Rust raises it: no Exception."""


class Mute(Exception):
    """Cannot say what it is."""

    def __str__(self) -> str:
        raise ValueError("no text")


def raises(error: BaseException) -> Callable[..., None]:
    def work(*given: object) -> None:
        raise error

    return work


@pytest.fixture(autouse=True)
def _files_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ZeroDivisionError("division by zero"), "ZeroDivisionError: division by zero"),
        (RecursionError("maximum recursion depth exceeded"), "RecursionError: maximum recursion depth exceeded"),
        (MemoryError(), "MemoryError"),
        (SystemExit(1), "SystemExit: 1"),
        (SystemExit(0), "SystemExit: 0"),
        (Panic("index out of bounds"), "Panic: index out of bounds"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), r"BrokenPipeError: \[Errno 32\] Broken pipe"),
        (Mute(), "Mute"),
        (ValueError("two\n\x1b[31mlines" + "x" * 1000), "ValueError: two \ufffd\\[31mlinesx+\\.\\.\\."),
    ],
    ids=lambda x: type(x).__name__,
)
def test_a_fault_is_70_and_one_line(error: BaseException, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert attempt(raises(error)) == 70
    told = re.fullmatch(LINE.format(text), capsys.readouterr().err)
    assert told
    assert type(error).__name__ in Path(told[1]).read_text()


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (InputError("expected 1, got 2", where="x.toml"), 2, "error: x.toml: expected 1, got 2\n"),
        (EngineUnavailable("urdf:x", "not there"), 3, "error: urdf:x: not there\n"),
        (OSError(errno.ENAMETOOLONG, "File name too long", "/x"), 2, "error: /x: File name too long\n"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "error: No space left on device\n"),
        (PermissionError(errno.EACCES, "Permission denied", b"/x"), 2, "error: /x: Permission denied\n"),
    ],
    ids=str,
)
def test_what_was_foreseen(error: Exception, code: int, line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert attempt(raises(error)) == code
    assert capsys.readouterr().err == line


@pytest.mark.parametrize("error", [KeyboardInterrupt(), click.Abort(), click.UsageError("x")], ids=repr)
def test_what_the_caller_answers(error: BaseException) -> None:
    with pytest.raises(type(error)):
        attempt(raises(error))


def test_a_code_is_handed_on() -> None:
    assert [attempt(lambda: 3), attempt(lambda: None), attempt(lambda: "text")] == [3, 0, 0]


def test_the_file_of_a_fault(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["crosscheck", "run", "a robot"])
    assert attempt(raises(ZeroDivisionError("x")), "ur5") == 70
    assert "error: ur5: a fault of the harness" in capsys.readouterr().err
    (file,) = (tmp_path / "temporary").iterdir()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    text = file.read_text()
    for part in (
        "command: crosscheck run 'a robot'",
        "fk-crosscheck ",
        "Python 3.",
        "numpy ",
        "Traceback",
        "in work",
        "ZeroDivisionError: x",
    ):
        assert part in text


def test_no_file_can_be_written(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert attempt(raises(ZeroDivisionError("x"))) == 70
    line = capsys.readouterr().err
    assert "ZeroDivisionError: x; please report it, the traceback could not be written (FileNotFoundError: " in line
    assert line.count("\n") == 1


def invoke(*args: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of `crosscheck run` in this process."""
    result = CliRunner().invoke(run, args, standalone_mode=False)
    assert result.exception is None, result.exception
    return int(result.return_value), result.stdout, result.stderr


@pytest.fixture
def three(copy_model: Callable[..., Path]) -> Path:
    """A folder of three robot models."""
    for robot in ("sixr", "stanford", "ur5"):
        folder = copy_model(robot)
    return folder.parent


@pytest.mark.parametrize("error", [RecursionError("too deep"), MemoryError(), SystemExit(1), Panic("oh")], ids=repr)
def test_a_fault_ends_one_robot(three: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    real = api.Session.crosscheck

    def faulty(self: api.Session, model: Any, **more: Any) -> Report:
        if model.name == "stanford":
            raise error
        return real(self, model, **more)

    monkeypatch.setattr(api.Session, "crosscheck", faulty)
    code, out, err = invoke("--models", str(three), "--out", str(tmp_path / "reports"), *FAST)
    assert code == 70
    assert out.endswith(f"2 of 3 robots agree; 1 ended by a fault of the harness: stanford; reports in {tmp_path / 'reports'}\n")
    assert err.startswith("error: stanford: a fault of the harness, not of the input: ")
    assert err.count("\n") == 1
    assert {p.name for p in (tmp_path / "reports").glob("*.json")} == {"sixr.json", "ur5.json", "report.schema.json"}


def test_a_disagreement_stays_found(three: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its reports cannot be written, another robot ends by a fault, the index too: the exit code is still 1."""
    table = three / "sixr" / "dh.csv"
    table.write_text(table.read_text().replace("0.2", "0.21"))
    assert "0.21" in table.read_text()

    def full(report: Report, folder: Path) -> list[Path]:
        if report.robot.name == "sixr":
            raise InputError("cannot be written: No space left on device", where=folder)
        if report.robot.name == "ur5":
            raise ZeroDivisionError("x")
        return write_report(report, folder)

    monkeypatch.setattr(module, "write_report", full)
    monkeypatch.setattr(module, "write_index", raises(ZeroDivisionError("x")))
    code, out, err = invoke("--models", str(three), "--out", str(tmp_path / "reports"), *FAST)
    assert code == 1, err
    assert "FAIL sixr DISAGREES" in out
    assert "PASS ur5" in out
    assert "1 of 3 robots agree; 1 ended by a fault of the harness: ur5" in out


BURST = """
import os, sys, threading, time
import click
from harness.__main__ import main
from harness.cli.main import cli

@click.command()
@click.argument("kind")
def burst(kind):
    if kind == "thread":
        thread = threading.Thread(target=lambda: 1 / 0)
        thread.start()
        thread.join()
        return 0
    if kind == "stubborn":
        try:
            print("ready", flush=True)
            time.sleep(60)
        finally:
            time.sleep(60)
    raise {
        "error": ZeroDivisionError("x"), "end": EOFError("x"), "exit": SystemExit(1), "pipe": BrokenPipeError(32, "Broken pipe"),
        "memory": MemoryError(), "abort": click.Abort(), "interrupt": KeyboardInterrupt(), "long": OSError(36, "too long", "/x"),
    }[kind]

cli.get_command = lambda ctx, name: burst
sys.argv = ["crosscheck", "burst", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize(
    ("kind", "code", "message"),
    [
        ("error", 70, "fault of the harness, not of the input: ZeroDivisionError: x; please report"),
        ("end", 70, "fault of the harness, not of the input: EOFError: x"),
        ("exit", 70, "fault of the harness, not of the input: SystemExit: 1"),
        ("pipe", 70, "fault of the harness, not of the input: BrokenPipeError"),
        ("memory", 70, "fault of the harness, not of the input: MemoryError"),
        ("thread", 70, "fault of the harness, not of the input: ZeroDivisionError: division by zero"),
        ("long", 2, "error: /x: too long"),
        ("abort", 130, "interrupted"),
        ("interrupt", 130, "interrupted"),
    ],
)
def test_the_command_never_ends_with_1_by_accident(tmp_path: Path, kind: str, code: int, message: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", BURST, kind], env={**os.environ, "TMPDIR": str(tmp_path)}, capture_output=True, text=True,
        timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    (line,) = done.stderr.strip().splitlines()
    assert message in line
    assert "Traceback" not in done.stderr
