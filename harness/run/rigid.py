"""Offsets of rigid frames: measured once with the source in which they are constant, held against all others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness import se3
from harness.description.model import RobotModel
from harness.digits import discrepancy
from harness.run.binding import Bound
from harness.se3 import Array

DECIMALS = 15  # of an entry of a measured offset: what a mean has behind them is rounding


@dataclass(frozen=True)
class Offset:
    """The measured offset of a rigid frame.

    T_dh_frame: (4, 4), the mean over the configurations asked.
    spread: largest entry by which it changes with q.
    measured_from: the source it was measured with.
    """

    T_dh_frame: Array
    spread: float
    measured_from: str


def transforms(offsets: dict[str, Offset]) -> dict[str, Array]:
    """The transforms T_dh_frame (4, 4) alone, by frame name."""
    return {name: offset.T_dh_frame for name, offset in offsets.items()}


def measure_rigid(model: RobotModel, in_house: Bound, urdf_source: Bound, q: Array) -> dict[str, Offset]:
    """Offset of each rigid frame, by frame name: the mean of T_dh_link = T_base_dh^-1 T_base_link over q (N, n).

    A mean over evenly spread configurations, not one of them: an offset taken at one absorbs whatever discrepancy there is
    at that one, and shows it doubled elsewhere. Rotations are averaged in the chordal sense, by projecting the mean matrix
    on SO(3) (Moakher 2002, doi:10.1137/S0895479801383877). Frames whose placements are not finite are left out.
    """
    T_base_dh, T_base_link = in_house.mapped(q), urdf_source.mapped(q)
    offsets = {}
    for i, frame in enumerate(model.frames.frames):
        if frame.relation == "rigid" and i in T_base_link and np.isfinite(T_base_link[i]).all():
            T_dh_link = se3.inverse(T_base_dh[i]) @ T_base_link[i]
            mean = np.round(se3.mean_transform(T_dh_link), DECIMALS) + 0.0
            spread = float(np.abs(T_dh_link - mean).max())
            offsets[frame.name] = Offset(mean, spread, urdf_source.engine.source)
    return offsets


class RigidOffsets:
    """Collects the offsets over the URDF sources of a run.

    Each frame is measured with the first URDF source that has it. If the offset varies there by more than that source's
    tolerance, it is measured with the source where it varies least.
    """

    def __init__(self, model: RobotModel, in_house: Bound) -> None:
        self._model, self._in_house = model, in_house
        self._rigid = [frame.name for frame in model.frames.frames if frame.relation == "rigid"]
        self._lattice = model.configurations.lattice()
        self.offsets: dict[str, Offset] = {}

    def measure(self, source: Bound, tolerance: float) -> None:
        """Measure with one more URDF source the offsets that still vary by more than `tolerance` [m, rad]."""
        loose = {name for name in self._rigid if self._spread(name) > tolerance}
        if not loose:
            return
        for name, offset in measure_rigid(self._model, self._in_house, source, self._lattice).items():
            # By as much as is written: else rounding would choose between two that are alike.
            if name in loose and discrepancy(offset.spread) < discrepancy(self._spread(name)):
                self.offsets[name] = offset

    def _spread(self, name: str) -> float:
        return self.offsets[name].spread if name in self.offsets else np.inf
