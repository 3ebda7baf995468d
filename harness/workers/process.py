"""An engine in a process of its own, spoken to by the worker protocol. What goes wrong there is an EngineFailed here."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.engines.base import Engine
from harness.errors import EngineFailed, EngineRefused, InputError
from harness.se3 import Array
from harness.workers import protocol
from harness.workers.answer import Answer, RefusedError, error_text, explain_count, parsed, read_answer
from harness.workers.child import Child, ChildError


@dataclass(frozen=True)
class Limits:
    """What a worker may take.

    Attributes:
        start: time to answer the greeting [s].
        block: time for a block of configurations [s].
        memory: memory of the worker and all that it has started [bytes].

    Raises:
        InputError: a limit is not above 0, or not finite.
    """

    start: float = 120.0
    block: float = 120.0
    memory: float = 4 * 2**30

    def __post_init__(self) -> None:
        """Refuse what is no limit."""
        for name, value in (("start timeout", self.start), ("block timeout", self.block), ("memory limit", self.memory)):
            if not 0.0 < value < math.inf:
                raise InputError(f"expected a {name} above 0 and finite, got {value:g}")


class ProcessEngine(Engine):
    """A worker that has answered the greeting.

    Attributes:
        is_program: whether it is a program of the user's, and no adapter.
        child: its process.
        seconds: its computing time, as it measures it itself [s].
        waited: time spent on its blocks as seen from here [s].
        died: how its process came to an end; empty if it did not.
        started_in: time until it had answered the greeting [s].
        idle: whether its process may be greeted again.
    """

    def __init__(self, source: str, child: Child, greeting: bytes, limits: Limits, adapter: type[Engine] | None = None) -> None:
        """Greet it.

        Args:
            source: source name.
            child: its process.
            greeting: the line it is sent, see `protocol.greeting`.
            limits: what it may take.
            adapter: the adapter that it runs; None for a program of the user's, which may have the frames it likes.

        Raises:
            EngineUnavailable: its library is not installed.
            EngineRefused: its library does not take the description.
            EngineFailed: it ended, did not answer in time, or its answer is wrong.
        """
        self.source = source
        self.traits = adapter.traits if adapter else ()
        self.partial = adapter.partial if adapter else True
        self.is_program = adapter is None
        self.child, self._limits = child, limits
        self._lock = threading.Lock()
        self.seconds = self.waited = 0.0
        self.died = ""
        start = time.perf_counter()
        answer = self._greet(greeting)
        self.started_in = time.perf_counter() - start
        self.joints, self.frames, self._versions = tuple(answer.joints), tuple(answer.frames), answer.versions
        self.idle = answer.again

    def _greet(self, greeting: bytes) -> Answer:
        try:
            text = self.child.line(greeting, self._limits.start)
        except ChildError as error:
            self.child.kill()
            raise EngineFailed(self.source, f"at the start: {error}") from error
        try:
            return read_answer(self.source, text)
        except ValueError as error:
            self.child.kill()
            failed = EngineRefused if isinstance(error, RefusedError) else EngineFailed
            raise failed(self.source, f"{error}{self.child.last_words()}") from error

    def finish(self, timeout: float) -> int | None:
        """Let it end by itself, and wait for `timeout` [s]. Returns its exit code, None if it goes on."""
        return self.child.finish(timeout)

    def installed(self) -> dict[str, str]:
        """Versions of its libraries, as it says."""
        return self._versions

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        parts = [self._block(q[i : i + protocol.MAX_BLOCK]) for i in range(0, len(q), protocol.MAX_BLOCK)]
        T = parts[0] if len(parts) == 1 else np.concatenate([np.empty((0, len(self.frames), 4, 4)), *parts])
        if tuple(frames) == self.frames:
            return T
        return np.ascontiguousarray(T[:, [self.frames.index(frame) for frame in frames]])

    def _block(self, q: Array) -> Array:
        """One block: q (N, n) out, placements (N, F, 4, 4) back."""
        out = np.concatenate([[float(len(q))], q.ravel()]).astype(protocol.FLOAT)
        back = np.empty(2 + len(q) * len(self.frames) * 16, protocol.FLOAT)
        with self._lock:
            start = time.perf_counter()
            try:
                self.child.expect_silence()
                self.child.into(out.data.cast("B"), back[:1].data.cast("B"), self._limits.block)
                self._check_count(back[0], len(q))
                self.child.into(memoryview(b""), back[1:].data.cast("B"), self._limits.block)
                self.child.expect_silence()
            except ChildError as error:
                self.idle = False
                self.child.kill()
                self.died = f"in a block of {len(q)}: {error}"
                raise EngineFailed(self.source, self.died) from error
            finally:
                self.waited += time.perf_counter() - start
            if 0.0 <= back[1] <= self.waited:  # what cannot be is as good as not measured
                self.seconds += float(back[1])
        return np.asarray(back[2:].reshape(len(q), len(self.frames), 4, 4), dtype=np.float64)

    def _check_count(self, count: float, expected: int) -> None:
        """Raise EngineFailed with the worker's own reason, or ChildError if the count is not the one asked for."""
        if count == protocol.FAILED:
            reason = error_text(parsed(self.child.line(b"", self._limits.block)))
            if reason is None:
                raise ChildError('reported a failure, but not why: expected {"error": "why"}')
            raise EngineFailed(self.source, reason)
        if count != expected:
            raise ChildError(explain_count(count, expected))
