"""What a source's own description says, in float64 and by code that no engine shares, and how far rounding may be off it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from harness.comparison.components import Components, components
from harness.description.model import RobotModel
from harness.kinematics.descriptions import of_table, of_urdf
from harness.kinematics.mechanism import Mask, Mechanism
from harness.se3 import Array

UNIT_ROUNDOFF = 2.0**-53


@dataclass(frozen=True)
class Described:
    """A description as a function of the model's joints.

    kind: `dh` or `urdf`.
    mechanism: places mapped frames, by name, in the model's base frame.
    """

    kind: Literal["dh", "urdf"]
    mechanism: Mechanism

    def placements(self, q: Array, names: list[str]) -> Components:
        """The named mapped frames at q (N, n), as (F, 4, 3, N)."""
        return components(self.mechanism.placements(q, names))

    @cached_property
    def _moved(self) -> tuple[Array, Array, Mask]:
        """Of each factor that a joint moves: |row| (K, n), |value| (K,), and whether it turns (K,)."""
        moved = [(f.row, f.value, f.turns) for f in self.mechanism.factors if f.row is not None]
        rows = np.array([row for row, _, _ in moved]).reshape(len(moved), len(self.mechanism.joints))
        values = np.array([value for _, value, _ in moved])
        return np.abs(rows), np.abs(values), np.array([turns for _, _, turns in moved], dtype=bool)

    @cached_property
    def _lengths(self) -> float:
        """All constant lengths on the way from the base to a frame, added up: the largest such sum [m]."""
        until = {-1: 0.0}
        for k, factor in enumerate(self.mechanism.factors):
            move = 0.0 if factor.turns or factor.row is not None else abs(factor.value)
            if factor.T is not None:
                move = float(np.linalg.norm(factor.T[:3, 3]))
            until[k] = until[factor.parent] + move
        return max(until[end] for end in self.mechanism.frames.values())

    @property
    def gain(self) -> float:
        """How far a placement may move if every joint that moves is off by 1 rad or m: n (1 + L), see `allowance` [m, rad]."""
        return len(self._moved[0]) * (1.0 + self._lengths)

    def allowance(self, q: Array) -> Array:
        """What rounding alone may be in a placement at q (N, n): (N,) [m, rad].

            (16 (n + 2) + 8 A) u (1 + L)

        u = 2^-53; n joints that move; A the sum of their |angles|; L the lengths on the way to a frame added up, slides
        included: what a position may be on the way, also where the frame itself is near. The first term is the rounding of
        a product of n + 2 rigid factors, 4u each (Higham, "Accuracy and Stability", section 3.5), times 4 for sines and
        constants. The second is that of the angles: factor times q plus offset is off by 2u of itself, here and in the
        engine, times 2.
        """
        rows, values, turns = self._moved
        amounts = np.abs(q) @ rows.T + values
        angles, slides = amounts[:, turns].sum(axis=1), amounts[:, ~turns].sum(axis=1)
        return np.asarray((16.0 * (len(rows) + 2) + 8.0 * angles) * UNIT_ROUNDOFF * (1.0 + self._lengths + slides))


def described(model: RobotModel, kind: str, offsets: Mapping[str, Array]) -> Described:
    """A description of a model, read as its specification says.

    kind: `dh` or `urdf`.
    offsets: the measured offsets of rigid frames (4, 4) by frame name, which follow their DH frame.
    """
    frames = model.frames.frames
    if kind == "dh" or model.urdf is None or model.urdf_joints is None or model.frames.base.urdf is None:
        after = {f.name: offsets.get(f.name, np.eye(4)) if f.offset is None else f.offset for f in frames}
        return Described("dh", of_table(model.table, {f.name: (f.dh, after[f.name]) for f in frames}))
    prismatic = [model.table.kind(joint) == "prismatic" for joint in model.table.joints]
    links = {f.name: f.urdf for f in frames if f.urdf is not None}
    return Described("urdf", of_urdf(model.urdf, model.frames.base.urdf, links, model.urdf_joints, model.table.joints, prismatic))
