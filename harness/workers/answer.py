"""What a worker writes back: its answer to the greeting, its errors, and the count at the head of a block."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError, field_validator

from harness.errors import EngineUnavailable
from harness.workers import protocol

LONGEST_TEXT = 2000


class RefusedError(ValueError):
    """The worker does not take the description; the text is its own reason."""


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


def parsed(text: bytes) -> Any:
    """A line of JSON, None if it is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def error_text(message: Any) -> str | None:
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
        ValueError: the answer is wrong; the text says what.
        RefusedError: the worker does not take the description.
        EngineUnavailable: the worker says that its library is not installed.
    """
    message = parsed(text)
    if message is None:
        got = text[:60].decode(errors="replace")
        raise ValueError(f"expected its answer, one line of JSON, got {got!r}: does it print to stdout?")
    if not isinstance(message, Mapping):
        raise ValueError(f"expected its answer, a JSON object, got {text[:60].decode(errors='replace')!r}")
    if "error" in message:
        reason = error_text(message)
        if reason is None:
            raise ValueError(f'refused, but not why: expected {{"error": "why"}}, got {text[:60].decode(errors="replace")!r}')
        if message.get("unavailable") is True:
            raise EngineUnavailable(source, reason)
        raise RefusedError(reason)
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
