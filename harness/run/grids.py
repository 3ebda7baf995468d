"""The grid that fixes a serial chain everywhere: in each joint that turns a placement is a combination of 1, cos q and sin q.

A joint that drives several links, by factors a_i, brings frequencies up to sum |a_i|: 2 m + 1 nodes for degree m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from harness.description.joints import mapped_chain
from harness.description.model import RobotModel
from harness.se3 import Array

GRID_LIMIT = 4096  # nodes of the largest grid on which an engine is evaluated
LARGEST_DENOMINATOR = 12


@dataclass(frozen=True)
class Axis:
    """The nodes of one joint.

    turns: whether they are evenly spaced over a period; else they are the two ends of a range.
    degree: highest frequency, in units of a period.
    lower, upper: the period, or the range [rad or m].
    """

    turns: bool
    degree: int
    lower: float
    upper: float

    @property
    def count(self) -> int:
        """Number of nodes."""
        return 2 * self.degree + 1 if self.turns else 2

    @property
    def nodes(self) -> Array:
        """The nodes, (count,) [rad or m]."""
        return np.linspace(self.lower, self.upper, self.count, endpoint=not self.turns)


def grid(axes: list[Axis]) -> Array:
    """All combinations of the nodes of all axes, (product of counts, len(axes)), the last axis fastest."""
    mesh = np.meshgrid(*(axis.nodes for axis in axes), indexing="ij")
    return np.stack([m.ravel() for m in mesh], axis=1)


def axes_of(model: RobotModel, lower: Array, upper: Array) -> list[Axis]:
    """The nodes of each model joint; of one that slides at the ends `lower` and `upper`, (n,) [m].

    A joint with a factor that is no simple fraction counts as if it had none: no grid fixes such a chain.
    """
    axes = []
    for j, name in enumerate(model.table.joints):
        if model.table.kind(name) == "prismatic":
            axes.append(Axis(False, 1, float(lower[j]), float(upper[j])))
            continue
        factors = [Fraction(x).limit_denominator(LARGEST_DENOMINATOR) for x in _factors(model, j)]
        stretch = math.lcm(1, *(f.denominator for f in factors))
        axes.append(Axis(True, max(1, int(sum(factors) * stretch)), 0.0, 2.0 * math.pi * stretch))
    return axes


def _factors(model: RobotModel, joint: int) -> list[float]:
    """By how much a model joint turns each link of the chain, in size."""
    if model.urdf is None or model.urdf_joints is None:
        return [1.0]
    chain = mapped_chain(model.urdf, model.frames)
    turning = [row for row, name in enumerate(model.urdf_joints.names) if name in chain and chain[name].type != "prismatic"]
    return [abs(float(x)) for x in model.urdf_joints.A[turning, joint] if x]
