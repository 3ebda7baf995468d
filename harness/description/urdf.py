"""The kinematics of a URDF: links, joints, and the tree they form (specification: https://wiki.ros.org/urdf/XML)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from harness.description.finding import Finding
from harness.errors import InputError, UrdfError, nearest

MOVABLE = ("revolute", "continuous", "prismatic")
UNSUPPORTED = ("floating", "planar")
TYPES = (*MOVABLE, "fixed", *UNSUPPORTED)

# From here on a joint limit means that there is none: files write 1000, 10000, 999999, 1e16.
NO_LIMIT = 1e3  # [rad or m]


class Mimic(NamedTuple):
    """`q = multiplier * q[joint] + offset` [rad or m]."""

    joint: str
    multiplier: float
    offset: float


class Limit(NamedTuple):
    """What a `<limit>` says beside the range, as it is written; None where the attribute is absent."""

    effort: str | None
    velocity: str | None


@dataclass(frozen=True, kw_only=True)
class UrdfJoint:
    """One joint as written.

    Attributes:
        name: its name.
        type: one of `TYPES`.
        parent: name of the parent link.
        child: name of the child link.
        xyz: origin, (3,) [m].
        rpy: origin, (3,) roll, pitch, yaw [rad].
        axis: (3,) as written, of any length; None if there is none.
        limits: (lower, upper) [rad or m]; None if there are none.
        limit: the rest of its `<limit>`; None if it has no such element.
        mimic: the joint it follows; None if it follows none.
        line: line in the file.
        texts: (attribute, text) of its numbers as they are written, for the lint.
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]
    axis: tuple[float, ...] | None
    limits: tuple[float, float] | None
    limit: Limit | None
    mimic: Mimic | None
    line: int
    texts: tuple[tuple[str, str], ...]

    @property
    def range(self) -> tuple[float | None, float | None]:
        """Its lower and upper limit [rad or m]; None for an end without a limit, or with a number that means none."""
        if self.limits is None or self.type == "continuous":
            return None, None
        lower, upper = self.limits
        return (lower if abs(lower) < NO_LIMIT else None), (upper if abs(upper) < NO_LIMIT else None)


@dataclass(frozen=True)
class Link:
    """One link: its name and line."""

    name: str
    line: int


@dataclass(frozen=True)
class UrdfText:
    """All that an engine is given.

    Attributes:
        text: the XML, stripped to links and joints.
        tip: the link at which a library that builds one chain only is to end it; empty if the mapping names none.
    """

    text: str
    tip: str = field(default="", kw_only=True)


@dataclass(frozen=True, kw_only=True)
class Urdf(UrdfText):
    """The kinematics of one URDF. It may be malformed as a tree: see `urdf_lint.check`.

    Attributes:
        path: the file.
        name: name of the robot.
        link_list: links in document order.
        joint_list: joints in document order.
        remarks: what was noticed while it was read, for the lint.
    """

    path: Path
    name: str
    link_list: tuple[Link, ...]
    joint_list: tuple[UrdfJoint, ...]
    remarks: tuple[Finding, ...] = ()

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Link names in document order."""
        return tuple(link.name for link in self.link_list)

    @cached_property
    def joints(self) -> dict[str, UrdfJoint]:
        """Joints by name, in document order."""
        return {joint.name: joint for joint in self.joint_list}

    @cached_property
    def movable(self) -> tuple[str, ...]:
        """Names of the revolute, continuous and prismatic joints, mimic followers included, in document order."""
        return tuple(j.name for j in self.joint_list if j.type in MOVABLE)

    @cached_property
    def parent_joint(self) -> dict[str, UrdfJoint]:
        """The joint above each link; roots are absent."""
        return {joint.child: joint for joint in self.joint_list}

    @cached_property
    def roots(self) -> tuple[str, ...]:
        """Links that no joint has as its child."""
        return tuple(link for link in self.links if link not in self.parent_joint)

    def children(self, link: str) -> tuple[UrdfJoint, ...]:
        """Joints below a link, in document order."""
        return self._children.get(link, ())

    @cached_property
    def _children(self) -> dict[str, tuple[UrdfJoint, ...]]:
        below: dict[str, tuple[UrdfJoint, ...]] = {}
        for joint in self.joint_list:
            below[joint.parent] = (*below.get(joint.parent, ()), joint)
        return below

    def require_link(self, link: str, key: str) -> None:
        """Refuse the name of a link that is not there.

        Args:
            link: the name.
            key: the option that gave it, for the message.

        Raises:
            InputError: there is no such link.
        """
        if link not in self.links:
            raise InputError(f"no link {link!r} in {self.path.name}; {nearest(link, self.links)}", key=key)

    def to_root(self, link: str) -> tuple[UrdfJoint, ...]:
        """Joints from a link up to its root.

        Raises:
            KeyError: there is no such link.
            UrdfError: the way up runs in a circle.
        """
        if link not in self.links:
            raise KeyError(f"no link {link!r}; {nearest(link, self.links)}")
        path: list[UrdfJoint] = []
        while (joint := self.parent_joint.get(link)) is not None:
            path.append(joint)
            link = joint.parent
            if len(path) > len(self.joint_list):
                raise UrdfError(f"link {link!r} is its own ancestor", where=self.path, line=joint.line)
        return tuple(path)

    def between(self, base: str, tip: str) -> tuple[UrdfJoint, ...]:
        """Joints between two links, in order from `base` to `tip`. Either may be nearer the root.

        Raises:
            KeyError: there is no such link.
            UrdfError: the way to the root runs in a circle.
        """
        up, down = self.to_root(base), self.to_root(tip)
        shared = {joint.name for joint in up} & {joint.name for joint in down}
        return tuple(j for j in up if j.name not in shared) + tuple(j for j in reversed(down) if j.name not in shared)
