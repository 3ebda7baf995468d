"""What became of testing one source against its own description: how far it was tested, and what was seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from harness.se3 import REPEATED, Array

Size = tuple[float, float]  # position [m], rotation [rad]


@dataclass(frozen=True, kw_only=True)
class Place:
    """One configuration at which a source was asked.

    kind: of the probes, see `harness.run.probes`.
    q: (n,) [rad or m], in the model's order.
    frame: index of the mapped frame.
    off: how far the frame is from where the description has it [m], [rad].
    """

    kind: str
    q: Array
    frame: int
    off: Size


@dataclass(frozen=True, kw_only=True)
class KindTested:
    """One kind of probes: how many answers there were, in how many calls of its own, and the largest differences [m], [rad].

    Kinds without calls of their own are rows of the full block.
    """

    name: str
    count: int
    calls: int
    position: float
    rotation: float


@dataclass(frozen=True, kw_only=True)
class FrameTested:
    """The differences at one mapped frame that rounding does not explain, where they count: within a turn, or the limits.

    frame: index of the mapped frame.
    position, rotation: the largest ones [m], [rad]; 0 if rounding explains all.
    position_at, rotation_at: where they are.
    compared: the same, over the configurations that the comparison has asked too [m], [rad].
    """

    frame: int
    position: float
    rotation: float
    position_at: Place | None
    rotation_at: Place | None
    compared: Size


@dataclass(frozen=True, kw_only=True)
class Repeated:
    """Two answers to one configuration.

    change: the largest change of an entry of a placement between the two [m or 1].
    allowed: how large it may be.
    q: the configuration (n,).
    frame: index of the mapped frame that changed most.
    ways: how it was asked, the first time and the second.
    off: how far each answer is from the description at that frame [m], [rad]; None if there is none to compare with.
    """

    change: float
    allowed: float
    q: Array
    frame: int
    ways: tuple[str, str]
    off: tuple[Size, Size] | None

    @property
    def keeps_state(self) -> bool:
        """Whether the answer depends on what was asked before or beside it."""
        return self.change > self.allowed


def repeated_allowance(limit: float) -> float:
    """How large a change between two answers may be: batches round differently from single rows. limit: of one answer."""
    return max(REPEATED, 2.0 * limit)


@dataclass(frozen=True, kw_only=True)
class Tested:
    """One source tested against its own description.

    description: which one it reads; empty if none that is at hand.
    reason: why it was not compared with it; empty if it was.
    configurations: how many different ones were asked.
    answers: how many answers there were; one configuration may be asked several times.
    calls: in how many calls.
    turns: how far away the furthest revolute joint was, in turns from zero.
    kinds: the kinds of probes.
    ignored_step: joint steps up to this are ignored by the engine, as one of its traits says [rad or m].
    limit: what rounding may be, where the joints are within a turn or their limits; see `Described.allowance` [m, rad].
    position, rotation: the largest differences there, rounding included [m], [rad].
    worst: where these are largest, the larger of the two.
    frames: at each frame what rounding does not explain.
    beyond: the first place further out, by turns, where a difference is above the source's tolerance and above rounding.
    again: the largest change between two answers to one configuration.
    invalid: answers within the limits that are not finite; `invalid_at` is the first.
    refused: why it has not answered beyond the limits; empty if it has.
    """

    description: Literal["dh", "urdf", ""]
    reason: str = ""
    configurations: int = 0
    answers: int = 0
    calls: int = 0
    turns: float = 0.0
    kinds: Sequence[KindTested] = ()
    limit: float = 0.0
    ignored_step: float = 0.0
    position: float = 0.0
    rotation: float = 0.0
    worst: Place | None = None
    frames: Sequence[FrameTested] = ()
    beyond: Place | None = None
    again: Repeated | None = None
    invalid: int = 0
    invalid_at: Place | None = None
    refused: str = ""

    @property
    def keeps_state(self) -> bool:
        """Whether an answer depends on what was asked before or beside it."""
        return self.again is not None and self.again.keeps_state
