"""A DH table or a URDF as a `Mechanism`, with the numbers of the description as its parameters.

A URDF is read as its specification says: origin = translation, then Rz(yaw) Ry(pitch) Rx(roll); a missing axis is x; an axis has
unit length; a mimic joint follows. `Reading` names the other ways in which libraries are known to read it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness import se3
from harness.description.dh import DHRow, DHTable
from harness.description.joints import JointMap
from harness.description.urdf import MOVABLE, Urdf, UrdfJoint
from harness.kinematics.mechanism import Factor, Mechanism, Parameter
from harness.se3 import Array

X_AXIS, Z_AXIS = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def of_table(table: DHTable, frames: Mapping[str, tuple[str, Array]], backwards: bool = False) -> Mechanism:
    """The mechanism of a DH table.

    frames: for each name its DH label, and the constant transform (4, 4) from that DH frame to it.
    backwards: with the product in the wrong order, T = tool A_n ... A_1 base. Frame k is then A_k ... A_1 base.
    """
    if backwards:
        return _backwards(table, frames)
    factors = [Factor(parent=-1, T=table.base)]
    at, joint = {"base": -1, "0": 0}, 0
    end = gauge(factors, 0, "base")
    for i, row in enumerate(table.rows, start=1):
        end = _row(factors, end, row, table, joint)
        joint += row.kind != "fixed"
        at[str(i)] = end
    end = gauge(factors, end, "tool")
    factors.append(Factor(parent=end, T=table.tool))
    at["tool"] = len(factors) - 1
    if all(label != "tool" for label, _ in frames.values()):
        at[str(len(table.rows))] = end  # the last row's frame is the tool
    return _framed(table, factors, {name: (at[label], T) for name, (label, T) in frames.items()})


def gauge(factors: list[Factor], parent: int, owner: str) -> int:
    """Append an identity transform whose six numbers are parameters of `owner`. Returns the last factor's index."""
    moves = [Factor(parent=0, turns=False, axis=axis, parameter=Parameter(owner, f"move {axis}", "m")) for axis in "xyz"]
    turns = [Factor(parent=0, turns=True, axis=axis, parameter=Parameter(owner, f"turn {axis}", "rad")) for axis in "zyx"]
    return _chained(factors, parent, [*moves, *turns])


def _chained(factors: list[Factor], parent: int, steps: Sequence[Factor]) -> int:
    for step in steps:
        factors.append(replace(step, parent=parent))
        parent = len(factors) - 1
    return parent


def _backwards(table: DHTable, frames: Mapping[str, tuple[str, Array]]) -> Mechanism:
    factors: list[Factor] = []
    at = {}
    for label in dict.fromkeys(label for label, _ in frames.values()):
        if label == "base":
            at[label] = -1
            continue
        count = len(table.rows) if label == "tool" else int(label)
        end = -1
        if label == "tool":
            factors.append(Factor(parent=-1, T=table.tool))
            end = len(factors) - 1
        for i in reversed(range(count)):
            joint = sum(row.kind != "fixed" for row in table.rows[:i])
            end = _row(factors, end, table.rows[i], table, joint)
        factors.append(Factor(parent=end, T=table.base))
        at[label] = len(factors) - 1
    return _framed(table, factors, {name: (at[label], T) for name, (label, T) in frames.items()})


def _framed(table: DHTable, factors: list[Factor], frames: Mapping[str, tuple[int, Array]]) -> Mechanism:
    kinds = [row.kind for row in table.rows if row.kind != "fixed"]
    bare = Mechanism(
        table.joints, tuple(k == "prismatic" for k in kinds), tuple(factors), {n: at for n, (at, _) in frames.items()}
    )
    return bare.ended({name: T for name, (_, T) in frames.items() if not np.array_equal(T, np.eye(4))})


def _row(factors: list[Factor], parent: int, row: DHRow, table: DHTable, joint: int) -> int:
    """Append the four factors of a row, in the order of the table's convention. Returns the last one's index."""
    unit = np.zeros(len(table.joints))
    if row.kind != "fixed":
        unit[joint] = 1.0
    turn = tuple(unit) if row.kind == "revolute" else None
    slide = tuple(unit) if row.kind == "prismatic" else None
    about_z = [
        Factor(parent=0, turns=True, axis="z", value=row.theta, row=turn, parameter=Parameter(row.name, "theta", "rad")),
        Factor(parent=0, turns=False, axis="z", value=row.d, row=slide, parameter=Parameter(row.name, "d", "m")),
    ]
    about_x = [
        Factor(parent=0, turns=False, axis="x", value=row.a, row=None, parameter=Parameter(row.name, "a", "m")),
        Factor(parent=0, turns=True, axis="x", value=row.alpha, row=None, parameter=Parameter(row.name, "alpha", "rad")),
    ]
    return _chained(factors, parent, [*about_x[::-1], *about_z] if table.convention == "modified" else [*about_z, *about_x])


@dataclass(frozen=True)
class Reading:
    """How a URDF is read.

    default_axis: the axis of a joint that has none.
    stretched: whether the length of its axis multiplies a prismatic joint's travel.
    mimic: whether a mimic joint follows its leader; else it stays at zero.
    float32: whether joint origins are kept as float32.
    """

    default_axis: tuple[float, ...] = X_AXIS
    stretched: bool = False
    mimic: bool = True
    float32: bool = False


SPECIFIED = Reading()


def of_urdf(
    urdf: Urdf,
    base: str,
    frames: Mapping[str, str],
    joints: JointMap,
    model_joints: Sequence[str],
    prismatic: Sequence[bool],
    reading: Reading = SPECIFIED,
    gauged: bool = False,
) -> Mechanism:
    """The mechanism of a URDF seen from link `base`.

    frames: for each name its link.
    joints: the map from the model's joints to the URDF's.
    model_joints, prismatic: the model's joints, in the order of q, and which of them slide.
    reading: how the URDF is read.
    gauged: with base and tool parameters of its own, before and after every frame but the base link.
    """
    factors: list[Factor] = []
    at = {base: gauge(factors, -1, "base") if gauged else -1}
    for link in frames.values():
        here = base
        for joint in urdf.between(base, link):
            down = joint.parent == here
            there = joint.child if down else joint.parent
            if there not in at:
                at[there] = _joint(factors, at[here], joint, joints, len(model_joints), reading, down)
            here = there
    ends = {name: at[link] for name, link in frames.items() if link != base}
    if gauged:
        ends = {name: gauge(factors, end, "tool") for name, end in ends.items()}
    all_ends = {name: ends.get(name, -1) for name in frames}
    return Mechanism(tuple(model_joints), tuple(prismatic), tuple(factors), all_ends)


def _joint(factors: list[Factor], parent: int, joint: UrdfJoint, joints: JointMap, n: int, reading: Reading, down: bool) -> int:
    """Append the factors of one joint. Returns the last one's index.

    down: whether the joint is passed from parent to child. If not, the factors are inverted and in reverse order.
    n: number of the model's joints.
    """
    xyz = zip("xyz", joint.xyz, strict=True)
    steps = [
        Factor(parent=0, turns=False, axis=axis, value=x, row=None, parameter=Parameter(joint.name, f"origin {axis}", "m"))
        for axis, x in xyz
    ]
    named = zip("zyx", ("yaw", "pitch", "roll"), reversed(joint.rpy), strict=True)
    steps += [
        Factor(parent=0, turns=True, axis=axis, value=x, row=None, parameter=Parameter(joint.name, name, "rad"))
        for axis, name, x in named
    ]
    if reading.float32:
        steps = [Factor(parent=0, T=se3.from_xyz_rpy(joint.xyz, joint.rpy).astype(np.float32).astype(np.float64))]
    if joint.type in MOVABLE:
        steps += _motion(joint, joints, n, reading)
    for step in steps if down else reversed(steps):
        sign = 1.0 if down else -1.0
        row = None if step.row is None else tuple(sign * x for x in step.row)
        T = step.T if step.T is None or down else np.asarray(np.linalg.inv(step.T))
        factors.append(
            Factor(
                parent=parent,
                turns=step.turns,
                axis=step.axis,
                value=sign * step.value,
                row=row,
                parameter=step.parameter,
                sign=sign,
                T=T,
            )
        )
        parent = len(factors) - 1
    return parent


def _motion(joint: UrdfJoint, joints: JointMap, n: int, reading: Reading) -> list[Factor]:
    """The joint's motion along its axis, as one about z between a rotation and its inverse."""
    axis = np.array(joint.axis if joint.axis is not None else reading.default_axis)
    length = float(np.linalg.norm(axis))
    index = joints.names.index(joint.name) if joint.name in joints.names else None
    row, value = np.zeros(n), 0.0
    if index is not None and (joint.mimic is None or reading.mimic):
        row, value = joints.A[index], float(joints.b[index])
    slides = joint.type == "prismatic"
    stretch = length if slides and reading.stretched else 1.0
    zero = Parameter(joint.name, "zero", "m" if slides else "rad")
    motion = Factor(parent=0, turns=not slides, axis="z", value=stretch * value, row=tuple(stretch * row), parameter=zero)
    R = _onto(axis / length if length > 0 else np.array(Z_AXIS))
    return [motion] if np.array_equal(R, np.eye(4)) else [Factor(parent=0, T=R), motion, Factor(parent=0, T=R.T)]


def _onto(axis: Array) -> Array:
    """A rotation (4, 4) that takes z onto the unit vector `axis`."""
    T = np.eye(4)
    if axis[2] > 1.0 - 1e-15:
        return T
    x = np.eye(3)[int(np.abs(axis).argmin())]
    y = np.cross(axis, x)
    y /= math.sqrt(float(y @ y))
    T[:3, 0], T[:3, 1], T[:3, 2] = np.cross(y, axis), y, axis
    return T
