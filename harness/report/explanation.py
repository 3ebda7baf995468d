"""The part of the report document that says why."""

from __future__ import annotations

from typing import Literal

from harness.report.parts import Coordinate, Discrepancy, Part


class OneChange(Part):
    """One change, in words. kind: `parameter` for a number, which is then changed by `size` [m or rad]; else a name of the
    catalogue. side: a, the reference's description; b, the source's; between, the mapping; source, what the source does."""

    text: str
    kind: str
    side: Literal["a", "b", "between", "source"]
    subject: str = ""
    parameter: str = ""
    size: Coordinate = 0.0
    unit: Literal["m", "rad", ""] = ""


class Change(OneChange):
    """One change of a repair; equivalents: others that do the same in its place."""

    equivalents: list[OneChange] = []


class Explanation(Part):
    """Why a source disagrees: a repair that was made to one side, compared again, and left no more than `after`.

    Errors are the largest over all frames at the configurations it was tried at. No changes: no repair was found, and
    `unexplained` says where the two part.
    """

    changes: list[Change] = []
    unexplained: str = ""
    before_position: Discrepancy = 0.0
    before_rotation: Discrepancy = 0.0
    after_position: Discrepancy = 0.0
    after_rotation: Discrepancy = 0.0
