"""Every verdict a document can hold, and which of them pass. What decides on them is `harness.verdict`."""

from __future__ import annotations

from enum import Enum
from typing import Literal, TypeAlias


class Verdict(str, Enum):
    """The verdict on a source, or on a source at one frame. Its value is the text in every report."""

    AGREES = "agrees"
    DISAGREES = "disagrees"
    # Of a frame alone.
    ACCEPTED = "accepted"
    DEVIATION_CHANGED = "deviation changed"
    DEVIATION_VANISHED = "deviation vanished"
    NOT_COMPARED = "not compared"
    NOT_CERTIFIED = "not certified"
    # Of a source alone.
    REFERENCE = "reference"
    AGREES_AS_ACCEPTED = "agrees as accepted"
    INVALID_PLACEMENTS = "invalid placements"
    KEEPS_STATE = "keeps state"
    NOT_RUN = "not run"
    FAILED = "failed"

    @property
    def passes(self) -> bool:
        """Whether this is a good verdict."""
        return self in (Verdict.AGREES, Verdict.ACCEPTED, Verdict.AGREES_AS_ACCEPTED, Verdict.REFERENCE)

    @property
    def disagrees(self) -> bool:
        """Whether what the source gave speaks against it. A source that gave nothing neither agrees nor disagrees."""
        return not self.passes and self not in (Verdict.NOT_RUN, Verdict.FAILED)

    def __str__(self) -> str:
        return self.value

    def __repr__(self) -> str:
        return repr(self.value)

    def __format__(self, spec: str) -> str:
        return format(self.value, spec)


FrameVerdict: TypeAlias = Literal[
    Verdict.AGREES,
    Verdict.DISAGREES,
    Verdict.ACCEPTED,
    Verdict.DEVIATION_CHANGED,
    Verdict.DEVIATION_VANISHED,
    Verdict.NOT_COMPARED,
    Verdict.NOT_CERTIFIED,
]
SourceVerdict: TypeAlias = Literal[
    Verdict.REFERENCE,
    Verdict.AGREES,
    Verdict.AGREES_AS_ACCEPTED,
    Verdict.DISAGREES,
    Verdict.INVALID_PLACEMENTS,
    Verdict.KEEPS_STATE,
    Verdict.NOT_RUN,
    Verdict.FAILED,
]
