"""Results of a report that are not of one source: pairs of sources, published placements, what the lint says."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from harness.report.parts import Coordinate, Discrepancy, Matrix, NonNegative, Part, Rotation, Vector


class PairResult(Part):
    """Largest discrepancies of two sources over the subset of configurations."""

    a: str
    b: str
    position: Discrepancy
    position_frame: str
    rotation: Discrepancy
    rotation_frame: str


class PublishedResult(Part):
    """A published placement, as claimed and as computed by the in-house FK. Errors are largest entry differences."""

    configuration: str
    frame: str
    relative_to: str
    provenance: str
    status: Literal["holds", "wrong"]
    found: Literal["holds", "wrong"]
    reason: str
    claimed_position: Vector
    claimed_rotation: Rotation | None
    computed: Matrix
    computed_rpy: Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
    tolerance: NonNegative
    rotation_tolerance: NonNegative
    position_error: Discrepancy
    rotation_error: Discrepancy | None


class Lint(Part):
    """A finding about the URDF, the table or the mapping."""

    code: str
    level: Literal["error", "warning", "note"]
    subject: str
    message: str
