"""What a report says of one source: statistics, tolerances, placements checked.

Units are metres and radians.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator, model_validator

from harness.digits import as_fine_as
from harness.report.parts import (
    Configuration,
    Count,
    Discrepancy,
    FineMatrix,
    NonNegative,
    Part,
    anchor,
)
from harness.report.verdicts import FrameVerdict

Decade = Annotated[str, Field(pattern=r"^-?[0-9]{1,3}$")]  # a power of ten


class At(Part):
    """A configuration: its index (fixed first, then random), its name and q [rad or m]."""

    index: Count
    label: str
    q: Configuration


class Statistics(Part):
    """Of one discrepancy, over all configurations. Quantiles are upper bounds, at most 15.5 % high; `decades` counts
    values by power of ten, under -15 all that are below 1e-14. `worst` is the first configuration with this `max`."""

    count: Count
    max: Discrepancy
    mean: Discrepancy
    p50: Discrepancy
    p95: Discrepancy
    p99: Discrepancy
    decades: dict[Decade, Count]
    worst: At | None

    @field_validator("mean")
    @classmethod
    def _no_finer_than_the_largest(cls, mean: float, info: ValidationInfo) -> float:
        return as_fine_as(mean, info.data.get("max", mean))


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
    position: Discrepancy
    rotation: Discrepancy
    reference_placement: FineMatrix
    source_placement: FineMatrix

    @model_validator(mode="after")
    def _written_side_by_side(self) -> Reproducer:
        anchor(self.reference_placement, self.source_placement)
        return self


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
    residual: Discrepancy
    first: At | None = None
    first_frame: str = ""
    again: Discrepancy = 0.0
    again_at: At | None = None
