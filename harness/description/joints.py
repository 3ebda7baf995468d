"""The map from model joints to URDF joints, q_urdf = A q + b: names, sign, zero offset, coupling, and mimic followers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.description.dh import DHTable
from harness.description.frames import FrameMap
from harness.description.frames_file import JointEntry
from harness.description.urdf import MOVABLE, NO_LIMIT, UNSUPPORTED, Urdf, UrdfJoint
from harness.description.values import LARGEST_ANGLE, LARGEST_LENGTH, checked_angle
from harness.errors import MappingError, UrdfError, nearest
from harness.se3 import Array

TRAVEL = 10.0  # [m]: how far a slide is looked at whose limits mean none


@dataclass(frozen=True, kw_only=True)
class JointMap:
    """Affine map from the model's n joints to the m movable joints of a description: q_description = A q + b.

    Attributes:
        names: the description's joints, (m,).
        A: factors (m, n).
        b: offsets (m,) [rad or m].
        followers: those that mimic another. Their rows are multiplier * leader + offset already.
        held: those that no model joint moves: they stay at zero.
    """

    names: tuple[str, ...]
    A: Array
    b: Array
    followers: tuple[str, ...] = ()
    held: tuple[str, ...] = ()

    @property
    def moved(self) -> tuple[str, ...]:
        """Joints that some model joint moves."""
        return tuple(name for name, row in zip(self.names, self.A, strict=True) if row.any())

    def renamed(self, names: Mapping[str, str]) -> JointMap:
        """The same map, with joints under other names as far as `names` gives them."""
        if not names:
            return self
        new = {name: names.get(name, name) for name in self.names}
        return replace(
            self,
            names=tuple(new.values()),
            followers=tuple(new[name] for name in self.followers),
            held=tuple(new[name] for name in self.held),
        )

    def values(self, q: Array, joints: tuple[str, ...]) -> Array:
        """Values of some of the description's joints.

        Args:
            q: values of the model's joints (N, n) [rad or m].
            joints: names in the description.

        Returns:
            Values (N, len(joints)) [rad or m].

        Raises:
            KeyError: a joint is not in the map.
        """
        rows = [self.names.index(name) for name in joints if name in self.names]
        if len(rows) != len(joints):
            missing = next(name for name in joints if name not in self.names)
            raise KeyError(f"no joint {missing!r}; {nearest(missing, self.names)}")
        return q @ self.A[rows].T + self.b[rows]


def identity_map(table: DHTable) -> JointMap:
    """The joints of the model as they are: what DH sources take."""
    n = len(table.joints)
    return JointMap(names=table.joints, A=np.eye(n), b=np.zeros(n))


def resolve_joints(entries: Mapping[str, JointEntry], table: DHTable, urdf: Urdf, frames: FrameMap, path: Path) -> JointMap:
    """Match the model's joints to the URDF's, and check that both have the same joints on the mapped chain.

    Args:
        entries: `[joints.NAME]` of frames.toml, by model joint.
        table: the DH table.
        urdf: the URDF.
        frames: the mapping of frames, which says what the chain is.
        path: frames.toml, for messages.

    Raises:
        MappingError: a joint is unknown, mapped twice, or has no partner.
        UrdfError: a joint on the chain is floating or planar.
    """
    for name in entries:
        if name not in table.joints:
            raise MappingError(f"no joint {name!r} in dh.csv; {nearest(name, table.joints)}", where=path, key=f"joints.{name}")
    rows: dict[str, tuple[Array, float]] = {}
    source: dict[str, str] = {}
    for index, name in enumerate(table.joints):
        entry = entries.get(name) or JointEntry()
        joint = _target(name, entry, table, urdf, path)
        if joint.name in source:
            raise MappingError(
                f"URDF joint {joint.name!r} is mapped twice: by {source[joint.name]!r} and {name!r}",
                where=path,
                key=f"joints.{name}",
            )
        source[joint.name] = name
        row = np.zeros(len(table.joints))
        row[index] = entry.sign
        for other, factor in entry.coupling.items():
            if other not in table.joints or other == name:
                hint = nearest(other, [j for j in table.joints if j != name])
                raise MappingError(f"no other joint {other!r}; {hint}", where=path, key=f"joints.{name}.coupling")
            row[table.joints.index(other)] += factor
        if table.kind(name) == "revolute":
            checked_angle(entry.offset, path, f"joints.{name}.offset")
        rows[joint.name] = (row, entry.offset)
    _check_chain(source, urdf, frames, path)
    return complete(rows, urdf, len(table.joints))


def _target(name: str, entry: JointEntry, table: DHTable, urdf: Urdf, path: Path) -> UrdfJoint:
    wanted = entry.urdf or name
    joint = urdf.joints.get(wanted)
    if joint is None:
        hint = nearest(wanted, urdf.movable)
        what = f"no joint {wanted!r}" if entry.urdf else f"joint {name!r} of dh.csv is not"
        raise MappingError(f"{what} in {urdf.path.name}; {hint}", where=path, key=f"joints.{name}")
    if joint.type not in MOVABLE:
        raise MappingError(f"URDF joint {joint.name!r} is {joint.type}, it takes no value", where=path, key=f"joints.{name}")
    if joint.mimic is not None:
        raise MappingError(
            f"URDF joint {joint.name!r} is a follower: map {joint.mimic.joint!r}", where=path, key=f"joints.{name}"
        )
    if (joint.type == "prismatic") != (table.kind(name) == "prismatic"):
        raise MappingError(
            f"{name!r} is {table.kind(name)} in dh.csv, {joint.name!r} is {joint.type} in the URDF",
            where=path,
            key=f"joints.{name}",
        )
    return joint


def _check_chain(source: Mapping[str, str], urdf: Urdf, frames: FrameMap, path: Path) -> None:
    """Every joint that moves a mapped link must be driven, and every model joint must move one."""
    if frames.base.urdf is None:
        raise MappingError("the base frame needs 'urdf': placements of URDF sources are expressed in it", where=path)
    on_chain = mapped_chain(urdf, frames)
    for joint in on_chain.values():
        if joint.type in UNSUPPORTED:
            raise UrdfError(
                f"joint {joint.name!r} on the chain is {joint.type}: expected revolute, continuous, prismatic or fixed",
                where=urdf.path,
                line=joint.line,
                hint="no DH row can describe it; map frames on one side of it only",
            )
        leader = leader_of(urdf, joint)
        if joint.type in MOVABLE and leader.name not in source:
            moved = sum(j.type in MOVABLE and j.mimic is None for j in on_chain.values())
            raise MappingError(
                f"URDF joint {leader.name!r} moves a mapped link, but no model joint drives it: dh.csv has {len(source)} "
                f"joints, the chain has {moved}; {nearest(leader.name, source.values())}",
                where=path,
                key="joints",
            )
    leaders = {leader_of(urdf, j).name for j in on_chain.values()}
    for joint_name, name in source.items():
        if joint_name not in leaders:
            raise MappingError(
                f"{joint_name!r} moves none of the mapped links: dh.csv and the chain do not have the same joints",
                where=path,
                key=f"joints.{name}",
            )


def mapped_chain(urdf: Urdf, frames: FrameMap) -> dict[str, UrdfJoint]:
    """Every joint between the base frame's link and a mapped link, by name; none if the base frame has no link."""
    chain: dict[str, UrdfJoint] = {}
    for frame in frames.frames:
        if frame.urdf is not None and frames.base.urdf is not None:
            chain.update({joint.name: joint for joint in urdf.between(frames.base.urdf, frame.urdf)})
    return chain


def leader_of(urdf: Urdf, joint: UrdfJoint) -> UrdfJoint:
    """The joint that a follower follows in the end; a joint that follows none itself, or is fixed.

    Raises:
        UrdfError: a leader does not exist.
    """
    while joint.mimic is not None and joint.type != "fixed":
        leader = urdf.joints.get(joint.mimic.joint)
        if leader is None:
            raise UrdfError(
                f"joint {joint.name!r} mimics {joint.mimic.joint!r}, which does not exist",
                where=urdf.path,
                line=joint.line,
                hint=nearest(joint.mimic.joint, urdf.joints),
            )
        joint = leader
    return joint


def _follows(urdf: Urdf, joint: UrdfJoint) -> bool:
    """Whether it follows another joint; not if a leader does not exist: then nothing moves it."""
    if joint.mimic is None:
        return False
    try:
        leader_of(urdf, joint)
    except UrdfError:
        return False
    return True


def complete(rows: Mapping[str, tuple[Array, float]], urdf: Urdf, n: int) -> JointMap:
    """The map to all movable joints of a URDF.

    Args:
        rows: for each URDF joint that is driven its row of A, (n,), and its entry of b [rad or m].
        urdf: the URDF; its followers follow their leader, all other joints stay at zero, followers without a leader too.
        n: number of model joints.
    """

    followers = {name for name in urdf.movable if _follows(urdf, urdf.joints[name])}

    def row(joint: UrdfJoint) -> tuple[Array, float]:
        if joint.mimic is None or joint.name not in followers:
            return rows.get(joint.name, (np.zeros(n), 0.0))
        a, b = row(urdf.joints[joint.mimic.joint])
        return joint.mimic.multiplier * a, joint.mimic.multiplier * b + joint.mimic.offset

    joints = [urdf.joints[name] for name in urdf.movable]
    pairs = [row(joint) for joint in joints]
    return JointMap(
        names=urdf.movable,
        A=np.array([a for a, _ in pairs]).reshape(len(joints), n),
        b=np.array([b for _, b in pairs]),
        followers=tuple(j.name for j in joints if j.name in followers),
        held=tuple(j.name for j in joints if j.name not in followers and j.name not in rows),
    )


def random_limits(table: DHTable, urdf: Urdf | None, joint_map: JointMap | None) -> dict[str, tuple[float, float]]:
    """Range of each model joint for random draws, (lower, upper) [rad or m].

    It is the URDF's where a URDF joint is that joint up to sign and offset. Revolute joints without limits get [-pi, pi];
    limits that no description can hold mean none.
    Prismatic ones without limits are not in the result: no range can be assumed.
    """
    ranges: dict[str, tuple[float, float]] = {}
    single = [] if joint_map is None else np.count_nonzero(joint_map.A, axis=1) == 1
    for i, name in enumerate(table.joints):
        if table.kind(name) == "revolute":
            ranges[name] = (-math.pi, math.pi)
        if urdf is None or joint_map is None:
            continue
        for row, joint_name in enumerate(joint_map.names):
            joint, a = urdf.joints[joint_name], joint_map.A[row]
            alone = single[row] and abs(a[i]) == 1.0 and joint.mimic is None
            if alone and joint.type != "continuous" and joint.limits and is_range(joint.limits, joint.type == "prismatic"):
                ends = sorted((limit - joint_map.b[row]) / a[i] for limit in joint.limits)
                slides = joint.type == "prismatic"
                ranges[name] = _sane(float(ends[0]), float(ends[1])) if slides else (float(ends[0]), float(ends[1]))
    return ranges


def within_travel(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Ranges (...) [m] cut to `TRAVEL` each way from their point nearest to zero: limits of kilometres mean none."""
    nearest = np.clip(0.0, lower, upper)
    return np.maximum(lower, nearest - TRAVEL), np.minimum(upper, nearest + TRAVEL)


def _sane(lower: float, upper: float) -> tuple[float, float]:
    """The range of a slide; an end that means none, such as 999999 m, is taken as 10 m from where the other one lets it begin."""
    nearest = min(max(0.0, lower), upper)
    low = lower if abs(lower) < NO_LIMIT else max(lower, nearest - TRAVEL)
    high = upper if abs(upper) < NO_LIMIT else min(upper, nearest + TRAVEL)
    return low, high


def is_range(limits: tuple[float, float], slides: bool) -> bool:
    """Whether configurations can be drawn between two limits [m if it slides, else rad]."""
    return limits[0] < limits[1] and max(map(abs, limits)) <= (LARGEST_LENGTH if slides else LARGEST_ANGLE)
