"""How a description becomes a mechanism, as data: what a structural repair changes before the mechanism is built again.

A recipe is a DH table or a URDF, where each compared frame is in it, and what is done to the result: joint values mixed,
lengths and angles in another unit. Edits of one recipe compose, whatever their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

from harness.analysis.descriptions import SPECIFIED, Reading, of_table, of_urdf
from harness.analysis.mechanism import Factor, Mechanism
from harness.description.dh import DHTable
from harness.description.joints import JointMap
from harness.description.urdf import Urdf
from harness.se3 import Array


@dataclass(frozen=True)
class Handling:
    """What an implementation does besides the product of its factors.

    P: (n, n), it takes P q for q; length, angle: factors on every constant length and angle of the description.
    """

    P: Array | None = None
    length: float = 1.0
    angle: float = 1.0

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism so handled."""
        if self.length != 1.0 or self.angle != 1.0:
            mechanism = mechanism.edited(self._scaled)
        return mechanism if self.P is None else mechanism.driven(self.P)

    def _scaled(self, factor: Factor) -> Factor:
        if factor.T is not None:
            T = factor.T.copy()
            T[:3, 3] *= self.length
            return replace(factor, T=T)
        return replace(factor, value=factor.value * (self.angle if factor.turns else self.length))

    def mixed(self, P: Array) -> Handling:
        """The same, taking P q for q first."""
        return replace(self, P=P if self.P is None else self.P @ P)


@dataclass(frozen=True)
class TableRecipe:
    """A DH table; frames: for each compared frame its DH label and the constant transform behind it, (4, 4)."""

    table: DHTable
    frames: Mapping[str, tuple[str, Array]]
    backwards: bool = False
    handling: Handling = field(default_factory=Handling)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism that comes of it."""
        return self.handling.applied(of_table(self.table, self.frames, self.backwards))


@dataclass(frozen=True)
class UrdfRecipe:
    """A URDF seen from link `base`; frames: for each compared frame its link; joints: the map from the model's joints."""

    urdf: Urdf
    base: str
    frames: Mapping[str, str]
    joints: JointMap
    model_joints: tuple[str, ...]
    prismatic: tuple[bool, ...]
    reading: Reading = SPECIFIED
    handling: Handling = field(default_factory=Handling)
    gauge: bool = False

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism that comes of it."""
        return self.handling.applied(self.bare(self.base, self.frames))

    def bare(self, base: str, frames: Mapping[str, str]) -> Mechanism:
        """The mechanism without handling, for other links."""
        return of_urdf(self.urdf, base, frames, self.joints, self.model_joints, self.prismatic, self.reading, self.gauge)

    def with_joint(self, name: str, **changes: object) -> UrdfRecipe:
        """With one joint of the URDF changed."""
        joints = tuple(replace(j, **changes) if j.name == name else j for j in self.urdf.joint_list)  # type: ignore[arg-type]
        return replace(self, urdf=replace(self.urdf, joint_list=joints))


Recipe: TypeAlias = TableRecipe | UrdfRecipe
