"""The command in this process, watched: how it ends, what it prints, how long it takes and how much memory.

The contract, for every input:

- exit code 0 to 3;
- on failure one line on stderr that begins with `error: `, of at most LONGEST letters; other lines are notes;
- no control character on stdout or stderr, no traceback;
- at most SECONDS of computing, and MEBIBYTES of memory more than before;
- no file that the command does not say it writes, no temporary file left or named in a message.
"""

from __future__ import annotations

import contextlib
import os
import re
import resource
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from hypothesis import HealthCheck, settings

from harness.cli.main import main

FULL = "CROSSCHECK_FUZZ" in os.environ
COUNT = int(os.environ.get("CROSSCHECK_FUZZ", "200"))  # inputs of each kind
CODES = (0, 1, 2, 3)
SECONDS = 60.0  # of computing; the longest search for a cause has a budget of work that takes 20
HANGS = 300  # seconds after which an input is given up
MEBIBYTES = 1024.0
LONGEST = 10_000  # letters of a line on stderr
MOST_PRINTED = 50_000_000  # letters on stdout
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")

# In the plain tests the same inputs each time: a rare one found there would fail a change that did not cause it.
fuzz = settings(
    max_examples=COUNT,
    deadline=None,
    derandomize=not FULL,
    database=None,
    print_blob=True,
    report_multiple_bugs=False,
    suppress_health_check=list(HealthCheck),
)


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How one call of the command ended: exit code, texts, computing [s], memory at its largest, above that before [MiB]."""

    code: object
    out: str
    err: str
    seconds: float
    memory: float


@dataclass
class Statistics:
    """What all inputs of a session came to."""

    codes: Counter[tuple[str, str, object]] = field(default_factory=Counter)
    slowest: tuple[float, str] = (0.0, "")
    largest: tuple[float, str] = (0.0, "")

    def add(self, kind: str, command: str, text: str, ended: Ended) -> None:
        """One input more."""
        self.codes[kind, command, ended.code] += 1
        self.slowest = max(self.slowest, (ended.seconds, text))
        self.largest = max(self.largest, (ended.memory, text))

    def lines(self) -> Iterator[str]:
        """The statistics in words."""
        for kind in sorted({kind for kind, _, _ in self.codes}):
            mine = {(command, code): n for (k, command, code), n in self.codes.items() if k == kind}
            count, refused = sum(mine.values()), sum(n for (_, code), n in mine.items() if code == 2)
            yield f"{kind}: {count} inputs, {count - refused} read, {refused} refused ({refused / count:.0%})"
            for command in sorted({command for command, _ in mine}):
                codes = sorted((str(code), n) for (c, code), n in mine.items() if c == command)
                yield f"  {command}: exit codes {', '.join(f'{code}: {n}' for code, n in codes)}"
        yield f"slowest: {self.slowest[0]:.1f} s of computing (at most {SECONDS:g}): {self.slowest[1]}"
        yield f"largest: {self.largest[0]:.0f} MiB more (at most {MEBIBYTES:g}): {self.largest[1]}"


STATISTICS = Statistics()


def _hangs(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"not ended after {HANGS} s")


def _reset_peak() -> None:
    """Let the largest memory of this process begin anew; without effect where the system cannot."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _memory(key: str) -> float:
    """Memory of this process [MiB]: VmHWM at its largest, VmRSS now."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(f"{key}:")) / 1024
    except (OSError, StopIteration):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


@contextlib.contextmanager
def _into(out: int, err: int) -> Iterator[None]:
    """Descriptors 1 and 2 lead to two files; Python's streams and what else the command puts in its place come back."""
    streams, argv, hook, folder = (sys.stdout, sys.stderr), sys.argv, threading.excepthook, tempfile.tempdir
    for stream in streams:
        stream.flush()
    kept = os.dup(1), os.dup(2)
    previous = signal.signal(signal.SIGALRM, _hangs)
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        signal.alarm(HANGS)
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, previous)
        for fd, old in enumerate(kept, start=1):
            os.dup2(old, fd)
            os.close(old)
        (sys.stdout, sys.stderr), sys.argv, threading.excepthook, tempfile.tempdir = streams, argv, hook, folder


def _text(fd: int) -> str:
    os.lseek(fd, 0, os.SEEK_SET)
    with open(fd, encoding="utf-8", errors="backslashreplace", newline="", closefd=False) as file:
        return file.read()


def call(args: tuple[str, ...], folder: Path) -> Ended:
    """Run `crosscheck ARGS` here. folder: for its temporary files."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        _reset_peak()
        started, before = time.process_time(), _memory("VmRSS")
        code: object = 0
        with _into(out.fileno(), err.fileno()):
            sys.argv, tempfile.tempdir = ["crosscheck", *args], str(folder)
            try:
                main()
            except SystemExit as ended:
                code = ended.code
        seconds, memory = time.process_time() - started, _memory("VmHWM") - before
        return Ended(code=code, out=_text(out.fileno()), err=_text(err.fileno()), seconds=seconds, memory=memory)


def problems(args: tuple[str, ...], ended: Ended, folder: Path) -> Iterator[str]:
    """What is against the contract. folder: of the command's temporary files."""
    yield from _of_the_code(args, ended)
    yield from _of_the_texts(ended)
    if ended.seconds > SECONDS:
        yield f"{ended.seconds:.1f} s of computing"
    if ended.memory > MEBIBYTES:
        yield f"{ended.memory:.0f} MiB more"
    if str(folder) in ended.err and ended.code != 70:
        yield "a temporary file is named on stderr"
    if left := sorted(folder.iterdir()):
        texts = "\n".join(path.read_text(errors="replace")[-4000:] for path in left if path.is_file())
        yield f"temporary files left: {', '.join(path.name for path in left)}\n{texts}"


def _of_the_code(args: tuple[str, ...], ended: Ended) -> Iterator[str]:
    errors = [line for line in ended.err.splitlines() if line.startswith("error: ")]
    # Of a URDF that is no tree `frames` shows the tree with all its errors, and those are its answer.
    shown = args[0] == "frames" and bool(re.search("^error: ", ended.out, re.MULTILINE))
    if ended.code not in CODES:
        yield f"exit code {ended.code}"
    elif len(errors) != (ended.code == 2 and not shown) and not (ended.code == 3 and len(errors) == 1):
        yield f"{len(errors)} error lines with exit code {ended.code}"


def _of_the_texts(ended: Ended) -> Iterator[str]:
    lines = ended.err.split("\n")[:-1]
    if odd := [line for line in lines if not line.startswith(("error: ", "note: "))]:
        yield f"{len(odd)} lines that are neither error nor note"
    if (longest := max(map(len, lines), default=0)) > LONGEST:
        yield f"a line of {longest} letters on stderr"
    for name, text in (("stdout", ended.out), ("stderr", ended.err)):
        if match := _CONTROL.search(text):
            yield f"control character {match[0]!r} on {name}"
        if "Traceback (most recent call last)" in text:
            yield f"a traceback on {name}"
    if len(ended.out) > MOST_PRINTED:
        yield f"{len(ended.out)} letters on stdout"


def check(kind: str, args: tuple[str, ...], what: str = "") -> Ended:
    """Run `crosscheck ARGS` and hold it to the contract.

    kind: of the input, for the statistics.
    what: the input in short, for the message.
    """
    text = f"crosscheck {' '.join(args)}; {what}"[:3000]
    with tempfile.TemporaryDirectory() as temporary:
        ended = call(args, Path(temporary))
        wrong = list(problems(args, ended, Path(temporary)))
    assert not wrong, f"{'; '.join(wrong)}\n{text}\nstderr: {ended.err[:2000]!r}\nstdout: {ended.out[-2000:]!r}"
    STATISTICS.add(kind, args[0], text, ended)
    return ended
