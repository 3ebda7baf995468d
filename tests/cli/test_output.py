"""Standard output that cannot be written: a reader that has gone, a full disk, a closed descriptor, a poor encoding."""

from __future__ import annotations

import errno
import io
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.cli.output import Outlet, json_line
from harness.description.locate import default_models_dir

FAST = ("--source", "urdf:pinocchio", "--samples", "1", "--no-certify", "--no-explain")
FULL = "error: standard output: cannot be written: No space left on device\n"
CROSSCHECK = f"{sys.executable} -m harness"


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """A pipe: the end to read, the end to write."""
    ends = os.pipe()
    yield ends
    for fd in ends:
        try:
            os.close(fd)
        except OSError as error:
            assert error.errno == errno.EBADF  # noqa: PT017 - the test has closed it


def test_what_is_written_arrives(pipe: tuple[int, int]) -> None:
    out = Outlet(pipe[1], "<x>", False)
    assert (out.write(b"abc"), out.problem, out.fileno(), out.isatty()) == (3, None, pipe[1], False)
    assert os.read(pipe[0], 10) == b"abc"


def test_a_reader_that_has_gone(pipe: tuple[int, int]) -> None:
    os.close(pipe[0])
    stream = io.TextIOWrapper(io.BufferedWriter(Outlet(pipe[1], "<x>", False)))
    for _ in range(1000):
        stream.write("x" * 1000)
    stream.flush()
    raw = stream.buffer.raw
    assert isinstance(raw, Outlet)
    assert isinstance(raw.problem, BrokenPipeError)


def test_a_full_disk_is_kept_as_the_reason() -> None:
    with open("/dev/full", "wb", buffering=0) as full:
        out = Outlet(full.fileno(), "<x>", False)
        assert out.write(b"abc") == 3
        assert out.problem is not None
        assert out.problem.errno == errno.ENOSPC


def test_a_pipe_that_does_not_block(pipe: tuple[int, int]) -> None:
    """Whoever shares a pipe may make it so. What does not fit is waited for, and nothing is lost."""
    os.set_blocking(pipe[1], False)
    text, got = b"0123456789" * 100_000, bytearray()

    def read() -> None:
        while len(got) < len(text):
            got.extend(os.read(pipe[0], 65536))

    reader = threading.Thread(target=read)
    reader.start()
    with io.BufferedWriter(Outlet(pipe[1], "<x>", False)) as out:
        out.write(text)
    reader.join(timeout=30)
    assert got == text


def test_a_descriptor_that_was_closed() -> None:
    with open(os.devnull, "wb") as nowhere:
        out = Outlet(nowhere.fileno(), "<x>", True)
        assert (out.write(b""), out.problem) == (0, None)
        assert out.write(b"x") == 1
        assert isinstance(out.problem, BrokenPipeError)


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_json_in_an_encoding_that_lacks_letters(text: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="latin-1"))
        line = json_line(json.dumps({"a": text}, ensure_ascii=False))
        patch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="UTF-8"))
        whole = json_line(json.dumps({"a": text}, ensure_ascii=False))
    assert line.isascii()
    assert json.loads(line) == json.loads(whole) == {"a": text}


def test_json_has_no_control_characters() -> None:
    """A name in a report may be meant for the terminal that shows it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="UTF-8"))
        line = json_line('{"a": "\x7f\x86\x9b31m\u2028\u202e\u2066é\U0001f916"}')
    assert line == r'{"a": "\u007f\u0086\u009b31m\u2028\u202e\u2066é' + '\U0001f916"}'


def shell(command: str, folder: Path, **env: str) -> tuple[int, str]:
    """Run a command line, with pipefail. Its exit code, and what stands on stderr."""
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], cwd=folder, env={**os.environ, **env}, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True, timeout=180, check=False,
    )  # fmt: skip
    return done.returncode, done.stderr


@pytest.mark.parametrize("command", ["--help", "completion bash", "frames sixr", "export-urdf sixr", "diff sixr sixr"])
def test_commands_whose_output_is_all(tmp_path: Path, command: str) -> None:
    for end in ("| true", ">&-", "2>&- | true"):
        assert shell(f"{CROSSCHECK} {command} {end}", tmp_path) == (141, "")
    assert shell(f"{CROSSCHECK} {command} > /dev/full", tmp_path) == (2, FULL)


@pytest.mark.parametrize(
    "command",
    [
        "accept sixr",
        "render reports/sixr.json --out rendered",
        "derive-dh {urdf} --out derived",
        "export-urdf sixr --out sixr.urdf",
    ],
    ids=lambda command: command.split()[0],
)
def test_commands_whose_result_is_a_file(tmp_path: Path, command: str) -> None:
    """That a file was written is so whether or not somebody reads the line that says it."""
    assert shell(f"{CROSSCHECK} run sixr {' '.join(FAST)} --quiet", tmp_path) == (0, "")
    command = command.format(urdf=default_models_dir().parent / "urdf" / "sixr.urdf")
    before = {p.name for p in tmp_path.rglob("*")}
    for end in ("| true", ">&-"):
        assert shell(f"{CROSSCHECK} {command} {end}", tmp_path) == (0, "")
        made = {p.name for p in tmp_path.rglob("*")} - before
        assert made
        for path in (tmp_path / name for name in ("derived", "rendered", "sixr.urdf", "reports/accepted")):
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


@pytest.mark.parametrize(
    ("end", "agrees", "disagrees", "message"),
    [
        ("| head -1", 0, 1, ""),
        ("| true", 0, 1, ""),
        ("--json | true", 0, 1, ""),
        (">&-", 0, 1, ""),
        (">&- 2>&- <&-", 0, 1, ""),
        ("2> /dev/full", 0, 1, ""),
        ("> /dev/full", 2, 1, FULL),
    ],
)
def test_a_run_keeps_its_verdict(
    copy_model: Callable[..., Path], tmp_path: Path, end: str, agrees: int, disagrees: int, message: str
) -> None:
    models = copy_model("sixr").parent
    command = f"{CROSSCHECK} run --models {models} {' '.join(FAST)} {end}"
    assert shell(command, tmp_path) == (agrees, message)
    assert len(list((tmp_path / "reports").glob("sixr.*"))) == 4
    copy_model("stanford", ("dh.csv", "joint5,revolute,0", "joint5,revolute,0.1"))
    assert shell(command, tmp_path) == (disagrees, message)
    assert len(list((tmp_path / "reports").glob("stanford.*"))) == 4  # after a robot whose output nobody read


def test_a_usage_error_is_told_although_nobody_reads_the_output(tmp_path: Path) -> None:
    code, text = shell(f"{CROSSCHECK} frames nosuch | true", tmp_path)
    assert (code, text.count("\n")) == (2, 1)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-16"])
def test_an_encoding_that_lacks_letters(copy_model: Callable[..., Path], tmp_path: Path, encoding: str) -> None:
    folder = copy_model("sixr", ("model.toml", 'description = "', 'description = "\u4e2d\u6587 \u2264 \U0001f916 '))
    for command in (f"run {folder} {' '.join(FAST)}", f"run {folder} {' '.join(FAST)} --json", f"frames {folder}"):
        assert shell(f"{CROSSCHECK} {command}", tmp_path, PYTHONIOENCODING=encoding) == (0, "")
