"""What a report says of a source tested against its own description. Units are metres and radians."""

from __future__ import annotations

from typing import Literal

from harness.report.parts import Configuration, Count, Discrepancy, NonNegative, Part

DESCRIPTIONS = {"dh": "dh.csv", "urdf": "the URDF"}


class TestedKind(Part):
    """One kind of configurations: answers compared, calls of its own (none: rows of the full block), largest differences."""

    name: str
    count: Count
    calls: Count
    position: Discrepancy
    rotation: Discrepancy


class TestedAt(Part):
    """One configuration at which a source was tested: how far the frame is off there; turns: of the furthest revolute joint."""

    kind: str
    q: Configuration
    frame: str
    turns: NonNegative
    position: Discrepancy
    rotation: Discrepancy


class TestedTwice(Part):
    """Two answers to one configuration: the largest change of an entry, how large rounding lets it be, how it was asked the
    first and the second time, and how far each answer is off [m], if there is a description to tell."""

    change: Discrepancy
    allowed: NonNegative
    q: Configuration
    frame: str
    first: str
    second: str
    first_off: Discrepancy | None = None
    second_off: Discrepancy | None = None


class Tested(Part):
    """A source tested against its own description, dh.csv or the URDF as specified: how far, and what was seen.

    description: which one; empty if none is at hand, and `reason` says why. position, rotation: the largest differences within a
    turn or the joint limits, at `worst`; limit: what rounding can be; ignored_step: joint steps so small are ignored by the
    engine, as one of its traits says. caught: the difference that speaks against it. beyond: the first place further out that
    is off by more than the tolerance. again: the largest change between two answers to one configuration. invalid: answers that
    are not finite. refused: why it does not answer beyond the joint limits. problem: what speaks against it, in a clause.
    """

    description: Literal["dh", "urdf", ""]
    reason: str = ""
    configurations: Count
    answers: Count
    calls: Count
    turns: NonNegative
    kinds: list[TestedKind]
    limit: Discrepancy
    ignored_step: NonNegative = 0.0
    position: Discrepancy = 0.0
    rotation: Discrepancy = 0.0
    worst: TestedAt | None = None
    caught: TestedAt | None = None
    beyond: TestedAt | None = None
    again: TestedTwice | None = None
    invalid: Count = 0
    invalid_at: TestedAt | None = None
    refused: str = ""
    problem: str = ""

    @property
    def spots(self) -> list[TestedAt | TestedTwice]:
        """Every configuration it speaks of."""
        return [at for at in (self.worst, self.caught, self.beyond, self.again, self.invalid_at) if at is not None]
