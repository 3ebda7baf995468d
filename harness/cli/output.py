"""Standard output and error that never raise: what can no longer be written is dropped, and the reason kept.

A reader may go away (`| head -1`), the disk behind a redirection may be full, the descriptor may be closed from the start
(`>&-`). None of these may end a run early: its reports are still to be written, and its exit code is still the verdict.
Light, as `crosscheck --help` imports it.
"""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import re
import select
import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class Kept(int):
    """An exit code that stands although its text may not have been read: the result is in files, or is the code itself.

    Every command returns one whose work is done when the text is printed. The text then only says so, and nobody need read it.
    """


class Outlet(io.RawIOBase):
    """A file descriptor to write to. After the first error everything is dropped.

    name: what it is called, as Python's own streams are.
    problem: why nothing is written any more; None as long as it is.
    """

    def __init__(self, fd: int, name: str, closed: bool) -> None:
        """`closed`: the descriptor was closed when the program started, and leads nowhere now."""
        super().__init__()
        self.name = name
        self.problem: OSError | None = None
        self._fd = fd
        self._nowhere = closed

    def write(self, data: ReadableBuffer, /) -> int:
        """Write what the descriptor takes, at least one byte. Returns how many are dealt with."""
        size = memoryview(data).nbytes
        if self._nowhere and size:
            self.problem = BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
        while self.problem is None:
            try:
                return os.write(self._fd, data)
            except BlockingIOError:  # whoever shares the pipe has made it so: wait, as if it were not
                select.select([], [self._fd], [])
            except OSError as error:
                self.problem = error
        return size

    def writable(self) -> bool:
        """Always."""
        return True

    def fileno(self) -> int:
        """The descriptor."""
        return self._fd

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return os.isatty(self._fd)


class Outputs:
    """Both standard streams of the command, from now to its end."""

    def __init__(self) -> None:
        """Put them in the place of Python's own."""
        closed = _occupied()
        self.stdout = Outlet(1, "<stdout>", 1 in closed)
        self.stderr = Outlet(2, "<stderr>", 2 in closed)
        sys.stdout = _text(self.stdout, sys.stdout, "replace")
        sys.stderr = _text(self.stderr, sys.stderr, "backslashreplace")

    def flush(self) -> None:
        """Write what is still kept back."""
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):  # replaced, or closed, by whoever writes there
                stream.flush()

    def loss(self) -> str:
        """Why standard output was not written, if it is the fault of what it leads to; empty if the reader went away."""
        problem = self.stdout.problem
        if problem is None or isinstance(problem, BrokenPipeError):
            return ""
        return problem.strerror or type(problem).__name__

    @property
    def unread(self) -> bool:
        """Whether the reader of standard output went away before the end."""
        return isinstance(self.stdout.problem, BrokenPipeError)


def _occupied() -> set[int]:
    """Which of the descriptors 0, 1, 2 are closed. They are opened on nothing: a report must not become number 1."""
    closed = set()
    for fd in range(3):
        try:
            os.fstat(fd)
        except OSError:
            closed.add(fd)
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # the lowest free number, so this one
    return closed


def _text(outlet: Outlet, old: TextIO | None, errors: str) -> TextIO:
    """A text stream to the outlet, as `old` is. What its encoding does not have is replaced."""
    return io.TextIOWrapper(
        io.BufferedWriter(outlet),
        encoding=(old and old.encoding) or "utf-8",
        errors=errors,
        line_buffering=outlet.name == "<stderr>" or outlet.isatty(),
        write_through=bool(getattr(old, "write_through", False)),
    )


# What changes more than its own letter on a terminal: delete, C1 controls, line separators, marks that turn the direction.
_CONTROL = "[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]"


def json_line(text: str) -> str:
    """JSON for standard output, with escapes of JSON for control characters.

    Where standard output is not UTF-8, every character beyond ASCII is an escape.
    """
    utf8 = (sys.stdout.encoding or "").lower().replace("-", "") == "utf8"
    return re.sub(_CONTROL if utf8 else r"[^\x00-\x7e]", lambda match: _escape(match[0]), text)


def _escape(letter: str) -> str:
    return r"\u007f" if letter == "\x7f" else json.dumps(letter)[1:-1]
