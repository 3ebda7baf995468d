"""The verdict on one source at one frame, on one source, and on one published placement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.comparison.compare import Validity
from harness.description.published import Published
from harness.report.verdicts import FrameVerdict, SourceVerdict, Verdict
from harness.se3 import Array

OwnVerdict = Literal[Verdict.INVALID_PLACEMENTS, Verdict.KEEPS_STATE, Verdict.DISAGREES]


@dataclass(frozen=True)
class Deviation:
    """A deviation on file: largest discrepancy [m], [rad], right to within `within` (relative); 0 means none."""

    position: float
    rotation: float
    within: float


def judge(position: float, rotation: float, tolerance: tuple[float, float], deviation: Deviation | None) -> FrameVerdict:
    """Verdict on the largest discrepancies of one source at one frame.

    position, rotation: the discrepancies [m], [rad].
    tolerance: [m], [rad].
    deviation: what model.toml accepts there. It behaves like a strict expected failure: bigger, smaller or gone fails.
    """
    inside = position <= tolerance[0] and rotation <= tolerance[1]
    if deviation is None:
        return Verdict.AGREES if inside else Verdict.DISAGREES
    if inside:
        return Verdict.DEVIATION_VANISHED
    parts = ((position, deviation.position, tolerance[0]), (rotation, deviation.rotation, tolerance[1]))
    for seen, on_file, limit in parts:
        as_filed = abs(seen - on_file) <= deviation.within * on_file if on_file > 0 else seen <= limit
        if not as_filed:
            return Verdict.DEVIATION_CHANGED
    return Verdict.ACCEPTED


def judge_source(frames: Sequence[FrameVerdict], validity: Validity, own: OwnVerdict | None = None) -> SourceVerdict:
    """Verdict on one source.

    frames: those at its frames.
    validity: whether its answers are placements that depend on q alone.
    own: what speaks against it where it was tested against its own description.
    """
    unfit = judge_validity(validity)
    for verdict in (Verdict.INVALID_PLACEMENTS, Verdict.KEEPS_STATE):
        if verdict in (unfit, own):
            return verdict
    if own is Verdict.DISAGREES or any(verdict.disagrees for verdict in frames):
        return Verdict.DISAGREES
    return Verdict.AGREES_AS_ACCEPTED if Verdict.ACCEPTED in frames else Verdict.AGREES


def judge_validity(validity: Validity) -> Literal[Verdict.INVALID_PLACEMENTS, Verdict.KEEPS_STATE] | None:
    """Why the answers of a source are no placements of a mechanism; None if they are."""
    if validity.invalid:
        return Verdict.INVALID_PLACEMENTS
    return Verdict.KEEPS_STATE if validity.stateful else None


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
