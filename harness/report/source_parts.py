"""What a report says of one source: statistics, tolerances, placements checked, certificate.

Units are metres and radians.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from harness.report.parts import Configuration, Count, Matrix, NonNegative, Part
from harness.report.verdicts import FrameVerdict

Decade = Annotated[str, Field(pattern=r"^-?[0-9]{1,3}$")]  # a power of ten


class At(Part):
    """A configuration: its index (fixed first, then random), its name and q [rad or m]."""

    index: Count
    label: str
    q: Configuration


class Statistics(Part):
    """Of one discrepancy, over all configurations. Quantiles are upper bounds, at most 15.5 % high; `decades` counts
    values by power of ten."""

    count: Count
    max: NonNegative
    mean: NonNegative
    p50: NonNegative
    p95: NonNegative
    p99: NonNegative
    decades: dict[Decade, Count]
    worst: At | None


class Tolerance(Part):
    """Largest discrepancy that counts as agreement."""

    position: NonNegative
    rotation: NonNegative


class Accepted(Part):
    """A deviation on file for this source and frame."""

    position: NonNegative
    rotation: NonNegative
    within: NonNegative
    reason: str


class FrameResult(Part):
    """One source at one mapped frame, against the reference."""

    frame: str
    verdict: FrameVerdict
    position: Statistics
    rotation: Statistics
    noise: str
    accepted: Accepted | None = None

    @property
    def passes(self) -> bool:
        """Whether its verdict is a good one."""
        return self.verdict.passes


class Reproducer(Part):
    """The worst configuration of a source, shrunk: joints set to zero while the frame still disagrees."""

    frame: str
    q: Configuration
    position: NonNegative
    rotation: NonNegative
    reference_placement: Matrix
    source_placement: Matrix


class TraitNote(Part):
    """A trait of an engine. `lint` is the URDF finding that makes it matter; `applies` says whether this URDF has it."""

    key: str
    text: str
    evidence: str
    lint: str
    applies: bool


class Validity(Part):
    """Placements checked for being placements: finite, last row 0 0 0 1, rotation in SO(3); and for depending on q alone:
    `again` is the largest change of an entry when a configuration, `again_at`, was asked for a second time."""

    checked: Count
    invalid: Count
    residual: NonNegative
    first: At | None = None
    first_frame: str = ""
    again: NonNegative = 0.0
    again_at: At | None = None


class FrameBound(Part):
    """For every configuration: no discrepancy at this frame is above `upper`; `found` is the largest one seen."""

    frame: str
    position_upper: NonNegative
    position_found: NonNegative
    rotation_upper: NonNegative
    rotation_found: NonNegative
    method: str


class Certificate(Part):
    """Agreement for every angle of every revolute joint, and every prismatic joint within its range; or why there is none.

    form: `grid` or `links`; nodes: configurations evaluated. residual, reference_residual: how far each engine is from the
    interpolant of its own values at random configurations; limit: how far rounding explains.
    """

    status: Literal["certified", "refused"]
    reason: str = ""
    form: str = ""
    nodes: Count = 0
    residual: NonNegative | None = None
    reference_residual: NonNegative | None = None
    limit: NonNegative | None = None
    frames: list[FrameBound] = []

    @model_validator(mode="after")
    def _certifies_something(self) -> Certificate:
        if self.status == "certified" and not self.frames:
            raise ValueError("expected a bound of at least one frame in a certificate")
        return self


class TestedKind(Part):
    """One kind of configurations: answers compared, calls of its own (none: rows of the full block), largest differences."""

    name: str
    count: Count
    calls: Count
    position: NonNegative
    rotation: NonNegative


class TestedAt(Part):
    """One configuration at which a source was tested: how far the frame is off there; turns: of the furthest revolute joint."""

    kind: str
    q: Configuration
    frame: str
    turns: NonNegative
    position: NonNegative
    rotation: NonNegative


class TestedTwice(Part):
    """Two answers to one configuration: the largest change of an entry, how large rounding lets it be, how it was asked the
    first and the second time, and how far each answer is off [m], if there is a description to tell."""

    change: NonNegative
    allowed: NonNegative
    q: Configuration
    frame: str
    first: str
    second: str
    first_off: NonNegative | None = None
    second_off: NonNegative | None = None


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
    limit: NonNegative
    ignored_step: NonNegative = 0.0
    position: NonNegative = 0.0
    rotation: NonNegative = 0.0
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
