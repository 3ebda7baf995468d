"""The part of the report document that can be drawn: both sides at the configuration where a source is furthest off."""

from __future__ import annotations

from pydantic import model_validator

from harness.report.parts import FineMatrix, Part, anchor
from harness.report.source_parts import At


class FramePair(Part):
    """One mapped frame as the reference and as the source place it, both in the base frame of the report."""

    frame: str
    reference: FineMatrix
    source: FineMatrix

    @model_validator(mode="after")
    def _written_side_by_side(self) -> FramePair:
        anchor(self.reference, self.source)
        return self


class Pose(Part):
    """All common frames at the configuration `at`, where the discrepancy of `frame` is the largest seen, over its tolerance."""

    at: At
    frame: str
    frames: list[FramePair]
