"""The part of the report document that holds a published placement, as somebody claims it, against the table."""

from __future__ import annotations

from typing import Literal

from harness.report.parts import Angles, Discrepancy, Matrix, NonNegative, Part, Rotation, Vector


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
    computed_rpy: Angles
    tolerance: NonNegative
    rotation_tolerance: NonNegative
    position_error: Discrepancy
    rotation_error: Discrepancy | None
