"""The part of the report document that says what moved since the numbers on file were accepted."""

from __future__ import annotations

from typing import Literal

from harness.report.parts import NonNegative, Part

Quantity = Literal["position", "rotation", "position, for all q", "rotation, for all q"]


class Moved(Part):
    """A number that differs from the accepted one by more than the source's noise floor [m or rad]."""

    source: str
    frame: str
    quantity: Quantity
    unit: Literal["m", "rad"]
    before: NonNegative
    after: NonNegative
    floor: NonNegative


class Changed(Part):
    """Something that is no number and differs: a verdict, an input, a source or a frame that came or went.

    worse: it fails a strict run.
    """

    what: str
    before: str
    after: str
    worse: bool = False


class Regression(Part):
    """Against the numbers accepted on the day `accepted`. problem: why they cannot be compared with this run, if so.
    note: what was looked at, if less than what was accepted; what shrank is not told then."""

    accepted: str
    problem: str = ""
    note: str = ""
    moved: list[Moved] = []
    changed: list[Changed] = []
    strict: bool = False

    @property
    def grown(self) -> list[Moved]:
        """What a strict run fails for, beside changes for the worse."""
        return [m for m in self.moved if m.after > m.before]

    @property
    def worse(self) -> bool:
        """Whether a strict run fails: a number grew, something changed for the worse, or nothing could be compared."""
        return bool(self.problem or self.grown or any(c.worse for c in self.changed))
