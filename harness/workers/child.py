"""A worker as a child process: writes and reads with deadlines, keeps the end of its stderr, says how it ended.

POSIX only: pipes are polled, and the child joins the process group of the warden (see `warden`).
"""

from __future__ import annotations

import contextlib
import os
import select
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import psutil

TAIL = 4096  # bytes of its stderr that are kept
LOOK_UP = 0.5  # seconds between two looks at whether it still runs
LONGEST_LINE = 16_000_000
PIPE_BYTES = 1 << 20
_F_SETPIPE_SZ = 1031  # Linux: a large pipe saves waking up for every 64 KiB


class ChildError(Exception):
    """The child did not do its part; the text says what happened instead, with the end of its stderr."""


class Child:
    """One running command. Not safe for several threads at once.

    `kill_reason` is set by whoever kills it for using too much memory, and is then why it ended.
    """

    def __init__(self, command: Sequence[str], group: int, cwd: Path | None = None, env: Mapping[str, str] | None = None) -> None:
        """Start it. Raises ChildError if the program cannot be started."""
        joining: dict[str, Any] = {"process_group": group}
        if sys.version_info < (3, 11):
            joining = {"preexec_fn": lambda: os.setpgid(0, group)}
        pipe = subprocess.PIPE
        try:
            self.process = subprocess.Popen(command, bufsize=0, stdin=pipe, stdout=pipe, stderr=pipe, cwd=cwd, env=env, **joining)
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            raise ChildError(f"cannot start {command[0]!r}: {error}") from error
        self.command, self.cwd, self.kill_reason = tuple(command), cwd, ""
        self._tail = b""
        self._surplus = b""  # what came after a line
        self._selector = selectors.DefaultSelector()
        streams = (self.process.stdin, self.process.stdout, self.process.stderr)
        self._stdin, self._stdout, self._stderr = (stream.fileno() for stream in streams if stream is not None)
        for fd in (self._stdin, self._stdout, self._stderr):
            os.set_blocking(fd, False)
            _widen(fd)
        self._selector.register(self._stdout, selectors.EVENT_READ)
        self._selector.register(self._stderr, selectors.EVENT_READ)

    def line(self, data: bytes, timeout: float) -> bytes:
        """Write `data`, then read one line and return it without its end. Raises ChildError."""
        got = bytearray()

        def take() -> bool:
            chunk = os.read(self._stdout, 65536)
            if not chunk:
                raise EOFError
            got.extend(chunk)
            if len(got) > LONGEST_LINE:
                raise ChildError(f"expected one line of JSON, got {len(got)} bytes without an end of line")
            return b"\n" in chunk

        self._converse(memoryview(data), take, timeout, lambda: f"{len(got)} bytes of a line, {_excerpt(got)}" if got else "")
        first, _, self._surplus = bytes(got).partition(b"\n")
        return first

    def into(self, data: memoryview, buffer: memoryview, timeout: float) -> None:
        """Write `data`, then fill `buffer`. Raises ChildError; `timeout` [s] is for both together."""
        got = 0

        def take() -> bool:
            nonlocal got
            count = os.readv(self._stdout, [buffer[got:]])
            if not count:
                raise EOFError
            got += count
            return got == len(buffer)

        self._converse(data, take, timeout, lambda: f"{got} of {len(buffer)} bytes" if got else "")

    def expect_silence(self) -> None:
        """Raise ChildError if something stands on its stdout that nobody asked for."""
        more = self._surplus
        if not more and select.select([self._stdout], [], [], 0.0)[0]:
            more = os.read(self._stdout, 65536)
        if more:
            raise ChildError(f"wrote at least {len(more)} bytes more than it was asked for: {_excerpt(more)}{self.last_words()}")

    def _converse(self, data: memoryview, take: Callable[[], bool], timeout: float, so_far: Callable[[], str]) -> None:
        """Write `data` while reading, so that neither side waits for a full pipe, until `take` has all it wants."""
        end, taken = time.monotonic() + timeout, False
        if len(data):
            self._selector.register(self._stdin, selectors.EVENT_WRITE)
        try:
            while not taken or len(data):
                remaining = end - time.monotonic()
                ready = self._selector.select(min(max(remaining, 0.0), LOOK_UP))
                if not ready and remaining <= 0.0:
                    raise ChildError(self._story(f"did not answer within {timeout:.3g} s", so_far()))
                if not ready and self.process.poll() is not None:
                    raise EOFError  # it has ended, and something it started holds on to the pipe
                for key, _ in ready:
                    if key.fd == self._stderr:
                        self._drain()
                    elif key.fd == self._stdin:
                        data = self._write(data)
                    elif not taken:
                        taken = take()
        except EOFError:
            raise ChildError(self._story(self._how_it_ended(), so_far())) from None
        finally:
            with contextlib.suppress(KeyError):
                self._selector.unregister(self._stdin)

    def _write(self, data: memoryview) -> memoryview:
        try:
            data = data[os.write(self._stdin, data[:PIPE_BYTES]) :]
        except BrokenPipeError:  # it has closed its stdin: what it says on stdout, or its end, tells why
            data = data[:0]
        if not len(data):
            self._selector.unregister(self._stdin)
        return data

    def _drain(self) -> None:
        """Read stderr and keep its end: it may write without limit, and must not wait for us."""
        try:
            chunk = os.read(self._stderr, 65536)
        except BlockingIOError:
            return
        self._tail = (self._tail + chunk)[-TAIL:]
        if not chunk:
            self._selector.unregister(self._stderr)

    def _how_it_ended(self) -> str:
        try:
            code = self.process.wait(2.0)
        except subprocess.TimeoutExpired:
            return "closed its stdout and went on running"
        if self.kill_reason:
            return self.kill_reason
        return ending(code)

    def _story(self, what: str, so_far: str) -> str:
        while self._stderr in self._selector.get_map() and select.select([self._stderr], [], [], 0.0)[0]:
            self._drain()
        return f"{what}{f' after {so_far}' if so_far else ''}{self.last_words()}"

    def last_words(self) -> str:
        """The last lines of its stderr, as a clause; empty if it wrote none."""
        lines = [line.strip() for line in self._tail.decode(errors="replace").splitlines() if line.strip()]
        return f"; stderr ends: {' / '.join(lines[-5:])[-400:]}" if lines else ""

    def finish(self, timeout: float) -> int | None:
        """Close its stdin and wait for it to end by itself. Returns its exit code, None if it goes on."""
        if self.process.stdin is not None:
            self.process.stdin.close()
        end = time.monotonic() + timeout
        while self.process.poll() is None and time.monotonic() < end:
            for key, _ in self._selector.select(0.1):  # what it still says must not keep it waiting
                if key.fd == self._stderr:
                    self._drain()
                elif not os.read(self._stdout, 65536):
                    self._selector.unregister(self._stdout)
        return self.process.poll()

    def kill(self) -> None:
        """End it and everything it has started; nothing if it has ended: its number may be another's by now."""
        if self.process.poll() is not None:
            return
        with contextlib.suppress(psutil.Error):
            for process in psutil.Process(self.process.pid).children(recursive=True):
                with contextlib.suppress(psutil.Error):
                    process.kill()
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        """Kill it if it still runs, and let go of its pipes."""
        self.kill()
        self._selector.close()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()


def ending(code: int) -> str:
    """How a process ended, by its exit code as Python tells it."""
    if code >= 0:
        return f"exited with code {code}"
    try:
        return f"killed by {signal.Signals(-code).name} ({signal.strsignal(-code)})"
    except ValueError:  # a real-time signal has no name
        return f"killed by signal {-code}"


def _widen(fd: int) -> None:
    if sys.platform == "linux":
        import fcntl  # noqa: PLC0415  (not everywhere)

        with contextlib.suppress(OSError):  # above the user's limit: it works as it is
            fcntl.fcntl(fd, _F_SETPIPE_SZ, PIPE_BYTES)


def _excerpt(data: bytes | bytearray) -> str:
    return repr(bytes(data[:60]).decode(errors="replace")) + ("..." if len(data) > 60 else "")
