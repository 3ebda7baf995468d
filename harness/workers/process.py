"""An engine in a process of its own, spoken to by the worker protocol. What goes wrong there is an EngineFailed here."""

from __future__ import annotations

import json
import math
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError, field_validator

from harness.engines.base import Engine
from harness.errors import EngineFailed, EngineUnavailable, InputError
from harness.se3 import Array
from harness.workers import protocol
from harness.workers.child import Child, ChildError

LONGEST_TEXT = 2000


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


class Answer(BaseModel):
    """A worker's answer to the greeting. Unknown keys are let through: a later version may have more.

    Attributes:
        protocol: name of the protocol.
        version: version of the protocol.
        joints: names of its joints, the columns of q.
        frames: names of the frames it answers at.
        name: what it calls itself.
        versions: versions of its libraries.
        again: whether it takes another greeting after this one.
    """

    protocol: str
    version: int
    joints: list[str]
    frames: list[str]
    name: str = ""
    versions: dict[str, str] = {}
    again: bool = False

    @field_validator("protocol")
    @classmethod
    def _ours(cls, value: str) -> str:
        if value != protocol.PROTOCOL:
            raise ValueError(f"expected {protocol.PROTOCOL!r}, got {value!r}")
        return value

    @field_validator("version")
    @classmethod
    def _known(cls, value: int) -> int:
        if value != protocol.VERSION:
            raise ValueError(f"expected {protocol.VERSION}, the version this harness speaks, got {value}")
        return value

    @field_validator("joints", "frames")
    @classmethod
    def _distinct(cls, value: list[str]) -> list[str]:
        if not value:
            raise ValueError("expected at least one name, got none")
        if twice := next((name for name, count in Counter(value).items() if count > 1), None):
            raise ValueError(f"{twice!r} is there twice")
        return value


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
            raise EngineFailed(self.source, f"{error}{self.child.last_words()}") from error

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
            reason = _error(_parsed(self.child.line(b"", self._limits.block)))
            if reason is None:
                raise ChildError('reported a failure, but not why: expected {"error": "why"}')
            raise EngineFailed(self.source, reason)
        if count != expected:
            raise ChildError(explain_count(count, expected))


def _parsed(text: bytes) -> Any:
    """A line of JSON, None if it is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _error(message: Any) -> str | None:
    """The text under `error`, cut to a length and to characters that can be written anywhere; None if there is none."""
    if not isinstance(message, Mapping) or not isinstance(message.get("error"), str):
        return None
    return str(message["error"])[:LONGEST_TEXT].encode("utf-8", "replace").decode() or "it gave no reason"


def read_answer(source: str, text: bytes) -> Answer:
    """Parse a worker's answer to the greeting.

    Args:
        source: source name, for messages.
        text: the line.

    Raises:
        ValueError: the answer is wrong, or the worker refused; the text says what, or the worker's own reason.
        EngineUnavailable: the worker says that its library is not installed.
    """
    message = _parsed(text)
    if message is None:
        got = text[:60].decode(errors="replace")
        raise ValueError(f"expected its answer, one line of JSON, got {got!r}: does it print to stdout?")
    if not isinstance(message, Mapping):
        raise ValueError(f"expected its answer, a JSON object, got {text[:60].decode(errors='replace')!r}")
    if "error" in message:
        reason = _error(message)
        if reason is None:
            raise ValueError(f'refused, but not why: expected {{"error": "why"}}, got {text[:60].decode(errors="replace")!r}')
        if message.get("unavailable") is True:
            raise EngineUnavailable(source, reason)
        raise ValueError(reason)
    try:
        json.dumps(message, ensure_ascii=False).encode()
        return Answer.model_validate(message)
    except UnicodeEncodeError:
        raise ValueError("its answer to the greeting holds half of a surrogate pair: expected UTF-8") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"its answer to the greeting is wrong: {where}: {first['msg'].removeprefix('Value error, ')}") from None


def explain_count(count: float, expected: int) -> str:
    """What a wrong count at the head of a block says about its writer.

    Args:
        count: the count that came.
        expected: the number of configurations asked for.
    """
    raw = np.array([count], protocol.FLOAT)
    text = raw.tobytes()
    if raw.byteswap()[0] == expected:
        return f"expected the count {expected}, got it with its bytes the other way round: write little-endian"
    if np.frombuffer(text, "<f4")[0] == expected:
        return f"expected the count {expected} as float64, got it as float32"
    if int.from_bytes(text, "little") == expected or int.from_bytes(text[:4], "little") == expected:
        return f"expected the count {expected} as float64, got it as an integer"
    printed = all(32 <= byte < 127 or byte in b"\r\n\t" for byte in text)
    got = f"{text.decode()!r}: does it print to stdout?" if printed else f"{count:g}"
    return f"expected the count {expected}, got {got}"
