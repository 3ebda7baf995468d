"""The verdict on one source at one frame: agreement, disagreement, or a known deviation that must stay as it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from harness.description.published import Published
from harness.se3 import Array

FrameVerdict: TypeAlias = Literal[
    "agrees", "disagrees", "accepted", "deviation changed", "deviation vanished", "not compared", "not certified"
]

FAILING: frozenset[str] = frozenset({"disagrees", "deviation changed", "deviation vanished", "not compared", "not certified"})


@dataclass(frozen=True)
class Deviation:
    """A deviation on file: largest discrepancy [m], [rad], right to within `within` (relative); 0 means none."""

    position: float
    rotation: float
    within: float


def judge(position: float, rotation: float, tolerance: tuple[float, float], deviation: Deviation | None) -> FrameVerdict:
    """Verdict on largest discrepancies `position` [m] and `rotation` [rad], tolerance (m, rad).

    A deviation on file behaves like a strict expected failure: bigger, smaller or gone is a failure.
    """
    inside = position <= tolerance[0] and rotation <= tolerance[1]
    if deviation is None:
        return "agrees" if inside else "disagrees"
    if inside:
        return "deviation vanished"
    parts = ((position, deviation.position, tolerance[0]), (rotation, deviation.rotation, tolerance[1]))
    for seen, on_file, limit in parts:
        as_filed = abs(seen - on_file) <= deviation.within * on_file if on_file > 0 else seen <= limit
        if not as_filed:
            return "deviation changed"
    return "accepted"


@dataclass(frozen=True)
class ClaimCheck:
    """A published placement against the computed one: largest difference of any entry, position [m] and rotation."""

    position_error: float
    rotation_error: float | None
    found: Literal["holds", "wrong"]


def check_claim(claim: Published, T: Array) -> ClaimCheck:
    """Compare a claim with the computed placement T (4, 4), entry by entry, as printed digits are compared."""
    position = float(np.abs(claim.position - T[:3, 3]).max())
    rotation = None if claim.rotation is None else float(np.abs(claim.rotation - T[:3, :3]).max())
    holds = position <= claim.tolerance and (rotation is None or rotation <= claim.rotation_tolerance)
    return ClaimCheck(position, rotation, "holds" if holds else "wrong")
