"""An engine in a process of its own, spoken to by the worker protocol. What goes wrong there is an EngineFailed here."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError, field_validator

from harness.engines import protocol
from harness.engines.base import Engine
from harness.engines.child import Child, ChildError
from harness.errors import EngineFailed, EngineUnavailable
from harness.se3 import Array


@dataclass(frozen=True)
class Limits:
    """What a worker may take: seconds to answer the greeting, seconds a block, bytes of memory."""

    start: float = 120.0
    block: float = 120.0
    memory: int = 4 << 30


class Answer(BaseModel):
    """A worker's answer to the greeting. Unknown keys are let through: a later version may have more."""

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
        if twice := [name for name in value if value.count(name) > 1]:
            raise ValueError(f"{twice[0]!r} is there twice")
        return value


class Refusal(BaseModel):
    """A worker's answer if it cannot: `unavailable` if its library is not there."""

    error: str
    unavailable: bool = False


class ProcessEngine(Engine):
    """A worker that has answered the greeting. `seconds` is its own computing time, `waited` the harness's for its blocks."""

    def __init__(self, source: str, child: Child, greeting: bytes, limits: Limits, adapter: type[Engine] | None = None) -> None:
        """Greet it. Raises EngineUnavailable (its library is not there) or EngineFailed.

        `adapter` is what it runs, if it is one of ours; a command of the user's may have the frames it likes.
        """
        self.source = source
        self.traits = adapter.traits if adapter else ()
        self.partial = adapter.partial if adapter else True
        self.child, self._limits = child, limits
        self._lock = threading.Lock()
        self.seconds = self.waited = 0.0
        start = time.perf_counter()
        answer = self._greet(greeting)
        self.started_in = time.perf_counter() - start
        self.joints, self.frames, self._versions = tuple(answer.joints), tuple(answer.frames), answer.versions
        self.idle = answer.again  # whether its child may be greeted again

    def _greet(self, greeting: bytes) -> Answer:
        try:
            text = self.child.line(greeting, self._limits.start)
        except ChildError as error:
            self.child.kill()
            raise EngineFailed(self.source, f"at the start: {error}") from error
        try:
            return read_answer(text)
        except EngineUnavailable as error:
            raise EngineUnavailable(self.source, error.reason) from None
        except ValueError as error:
            self.child.kill()
            raise EngineFailed(self.source, f"{error}{self.child.last_words()}") from error

    def finish(self, timeout: float) -> int | None:
        """Let it end by itself. Returns its exit code, None if it goes on for longer than `timeout` [s]."""
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
                raise EngineFailed(self.source, f"in a block of {len(q)}: {error}") from error
            finally:
                self.waited += time.perf_counter() - start
            self.seconds += float(back[1]) if np.isfinite(back[1]) else 0.0
        return np.asarray(back[2:].reshape(len(q), len(self.frames), 4, 4), dtype=np.float64)

    def _check_count(self, count: float, expected: int) -> None:
        """Raise EngineFailed with the worker's own reason, or ChildError if the count is not the one asked for."""
        if count == protocol.FAILED:
            text = self.child.line(b"", self._limits.block)
            try:
                raise EngineFailed(self.source, Refusal.model_validate_json(text).error)
            except ValidationError:
                raise ChildError(f"reported a failure, but not why: {text[:80]!r}") from None
        if count != expected:
            raise ChildError(explain_count(count, expected))


def read_answer(text: bytes) -> Answer:
    """Parse the answer line. Raises ValueError, EngineUnavailable; EngineFailed is a ValueError here with its reason."""
    try:
        message: Any = json.loads(text)
    except ValueError:
        raise ValueError(
            f"expected its answer, one line of JSON, got {text[:60].decode(errors='replace')!r}: does it print to stdout?"
        ) from None
    if isinstance(message, Mapping) and "error" in message:
        refusal = Refusal.model_validate(message)
        if refusal.unavailable:
            raise EngineUnavailable("", refusal.error)
        raise ValueError(refusal.error)
    try:
        return Answer.model_validate(message)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"its answer to the greeting is wrong: {where}: {first['msg'].removeprefix('Value error, ')}") from None


def explain_count(count: float, expected: int) -> str:
    """What a wrong count at the head of a block says about its writer."""
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
