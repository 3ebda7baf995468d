"""What a report says is proven. It speaks of the two descriptions, not of engines. Units are metres and radians."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from harness.report.parts import Configuration, Finite, LowerBound, Part, UpperBound

Equality = Literal["equal", "equal but for the digits of pi", "not equal", "not decided", "offset measured"]


class FrameBound(Part):
    """Two descriptions at one frame: at no configuration are they further apart than `upper`, at one they are `found` apart.

    slope: what each metre of slide can add; None if that was not looked at. method: how the position's bound was found;
    `constant` if the discrepancy is the same everywhere.
    """

    frame: str
    position_upper: UpperBound
    position_found: LowerBound
    rotation_upper: UpperBound
    rotation_found: LowerBound
    slope: UpperBound | None
    method: Literal["constant", "joints", "coefficients", "grid"]


class Range(Part):
    """Lower and upper end of a joint that slides something; in radians if it turns something too."""

    lower: Finite
    upper: Finite
    unit: Literal["m", "rad"] = "m"


class Theorem(Part):
    """What is proven of the table and the URDF, from their numbers alone, for every angle of every joint that turns.

    equality: for each frame, whether both are the same function; nothing is said of one whose offset an engine has measured.
    worst: the configuration of `position_found`, for frames at which that is more than rounding.
    slides: the range that each joint which slides is looked at in.
    """

    frames: list[FrameBound]
    equality: dict[str, Equality]
    worst: dict[str, Configuration]
    slides: dict[str, Range] = {}

    @property
    def is_equal(self) -> bool:
        """Whether both are the same function at every frame."""
        return set(self.equality.values()) == {"equal"}  # no frame, no equality

    def require(self, frames: set[str], joints: int) -> None:
        """Raise ValueError unless it speaks of these frames alone, of each in full, and of so many joints."""
        own = [bound.frame for bound in self.frames]
        if not set(own) <= frames or set(own) != set(self.equality) or not set(self.worst) <= set(own):
            raise ValueError(f"expected bounds, equality and configurations of frames of the report, got {', '.join(own)}")
        if any(len(q) != joints for q in self.worst.values()):
            raise ValueError(f"expected {joints} joint values in each configuration of the theorem")


class Certificate(Part):
    """What is proven of the descriptions that a source and the reference read; or why that does not count for the source.

    That the source computes what its description says is tested, not proven.
    """

    status: Literal["certified", "refused"]
    reason: str = ""
    frames: list[FrameBound] = []

    @model_validator(mode="after")
    def _certifies_something(self) -> Certificate:
        if self.status == "certified" and not self.frames:
            raise ValueError("expected a bound of at least one frame in a certificate")
        return self
