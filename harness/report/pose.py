"""The part of the report document that can be drawn: both sides at the configuration where a source is furthest off."""

from __future__ import annotations

from harness.report.parts import Matrix, Part
from harness.report.source_parts import At


class FramePair(Part):
    """One mapped frame as the reference and as the source place it, both in the base frame of the report."""

    frame: str
    reference: Matrix
    source: Matrix


class Pose(Part):
    """All common frames at the configuration `at`, where the discrepancy of `frame` is the largest seen, over its tolerance."""

    at: At
    frame: str
    frames: list[FramePair]
