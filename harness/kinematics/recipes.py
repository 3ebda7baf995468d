"""How a description becomes a mechanism, as data: what a structural repair changes before the mechanism is built again.

A recipe is a DH table or a URDF, where each compared frame is in it, and how the implementation mixes its joint values. Edits of
one recipe compose, whatever their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

from harness.description.dh import DHTable
from harness.description.joints import JointMap
from harness.description.urdf import Urdf
from harness.kinematics.descriptions import SPECIFIED, Reading, of_table, of_urdf
from harness.kinematics.mechanism import Mechanism
from harness.se3 import Array


def asked(mechanism: Mechanism, P: Array | None) -> Mechanism:
    """The mechanism of an implementation that takes P q for q. P: (n, n); None for q itself."""
    return mechanism if P is None else mechanism.driven(P)


@dataclass(frozen=True)
class TableRecipe:
    """A DH table as an implementation uses it.

    frames: for each compared frame its DH label, and the constant transform (4, 4) from that DH frame to it.
    backwards: whether the product is taken in reverse order.
    P: the implementation takes P q for q, (n, n); None for q itself.
    """

    table: DHTable
    frames: Mapping[str, tuple[str, Array]]
    backwards: bool = False
    P: Array | None = None

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism that comes of it."""
        return asked(of_table(self.table, self.frames, self.backwards), self.P)


@dataclass(frozen=True, kw_only=True)
class UrdfRecipe:
    """A URDF as an implementation uses it, seen from link `base`.

    frames: for each compared frame its link.
    joints: the map from the model's joints to the URDF's.
    model_joints, prismatic: the model's joints, in the order of q, and which of them slide.
    reading: how the URDF is read.
    P: the implementation takes P q for q, (n, n); None for q itself.
    gauge: whether base and tool have parameters of their own.
    """

    urdf: Urdf
    base: str
    frames: Mapping[str, str]
    joints: JointMap
    model_joints: tuple[str, ...]
    prismatic: tuple[bool, ...]
    reading: Reading = SPECIFIED
    P: Array | None = None
    gauge: bool = False

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism that comes of it."""
        return asked(self.bare(self.base, self.frames), self.P)

    def bare(self, base: str, frames: Mapping[str, str]) -> Mechanism:
        """The mechanism asked at q itself, for other links."""
        return of_urdf(self.urdf, base, frames, self.joints, self.model_joints, self.prismatic, self.reading, self.gauge)

    def with_joint(self, name: str, **changes: object) -> UrdfRecipe:
        """With one joint of the URDF changed."""
        joints = tuple(replace(j, **changes) if j.name == name else j for j in self.urdf.joint_list)  # type: ignore[arg-type]
        return replace(self, urdf=replace(self.urdf, joint_list=joints))


Recipe: TypeAlias = TableRecipe | UrdfRecipe


def mixed(recipe: Recipe, P: Array) -> Recipe:
    """The recipe, taking P q for q first."""
    return replace(recipe, P=P if recipe.P is None else recipe.P @ P)
