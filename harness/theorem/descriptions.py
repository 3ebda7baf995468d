"""DH tables, URDFs and robot models as chains with exact numbers.

A URDF is read as its specification says; see `harness.kinematics.descriptions`. Angles of model.toml and frames.toml that are
the float64 next to a multiple of pi/12, pi/16 or a degree are that multiple (`harness.description.written.angle_of`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.description.joints import JointMap
from harness.description.model import RobotModel
from harness.description.urdf import MOVABLE, Urdf, UrdfJoint
from harness.description.values import Transform
from harness.description.written import ZERO, Exact, angle_of, length_of
from harness.se3 import Array
from harness.theorem.balls import X, Y, Z, of_array
from harness.theorem.chain import Chains, Path, Row, Step


def posed(xyz: Sequence[float], rpy: Sequence[float]) -> Path:
    """A constant transform: translation [m], then Rz(yaw) Ry(pitch) Rx(roll) [rad]. Only what changes something."""
    moves = [Step(axis=axis, amount=length_of(x)) for axis, x in zip((X, Y, Z), xyz, strict=True)]
    turns = [Step(turns=True, axis=axis, amount=angle_of(x)) for axis, x in zip((Z, Y, X), reversed(rpy), strict=True)]
    return tuple(step for step in (*moves, *turns) if not step.amount.is_zero)


def of_transform(transform: Transform) -> Path:
    """A transform of a model file."""
    return posed(transform.xyz, transform.rpy)


def of_matrix(T: Array) -> Path:
    """A constant transform (4, 4) that is known as a matrix only."""
    return () if np.array_equal(T, np.eye(4)) else (Step(T=of_array(T)),)


def of_table(table: DHTable, frames: Mapping[str, tuple[str, Path]], base: Path, tool: Path) -> Chains:
    """The chains of a DH table.

    Args:
        table: the table.
        frames: for each name its DH label, and the constant steps from that DH frame to it.
        base: the base transform, as written.
        tool: the tool transform, as written.
    """
    at: dict[str, Path] = {"base": (), "0": base}
    path, joint = base, 0
    for i, row in enumerate(table.rows, start=1):
        path = (*path, *_row(row, table, joint))
        joint += row.kind != "fixed"
        at[str(i)] = path
    at["tool"] = (*path, *tool)
    return Chains(table.joints, {name: (*at[label], *offset) for name, (label, offset) in frames.items()})


def _row(row: DHRow, table: DHTable, joint: int) -> Path:
    unit = tuple(Fraction(int(i == joint)) for i in range(len(table.joints)))
    about_z = [
        Step(turns=True, amount=angle_of(row.theta), row=unit if row.kind == "revolute" else ()),
        Step(amount=length_of(row.d), row=unit if row.kind == "prismatic" else ()),
    ]
    about_x = [Step(axis=X, amount=length_of(row.a)), Step(turns=True, axis=X, amount=angle_of(row.alpha))]
    steps = [*about_x[::-1], *about_z] if table.convention == "modified" else [*about_z, *about_x]
    return tuple(step for step in steps if step.row or not step.amount.is_zero)


def of_urdf(urdf: Urdf, base: str, frames: Mapping[str, tuple[str, Path]], joints: JointMap, names: Sequence[str]) -> Chains:
    """The chains of a URDF seen from link `base`.

    Args:
        urdf: the URDF.
        base: the link.
        frames: for each name its link, and the constant steps from that link to it.
        joints: the map from the model's joints to the URDF's.
        names: the model's joints, in the order of q.
    """
    at: dict[str, Path] = {base: ()}
    for link, _ in frames.values():
        here = base
        for joint in urdf.between(base, link):
            down = joint.parent == here
            there = joint.child if down else joint.parent
            if there not in at:
                steps = _joint(joint, urdf, joints, len(names))
                at[there] = (*at[here], *(steps if down else [step.inverted() for step in reversed(steps)]))
            here = there
    return Chains(tuple(names), {name: (*at[link], *offset) for name, (link, offset) in frames.items()})


def _joint(joint: UrdfJoint, urdf: Urdf, joints: JointMap, n: int) -> Path:
    origin = posed(joint.xyz, joint.rpy)
    if joint.type not in MOVABLE:
        return origin
    a, b, c = (length_of(x).rational for x in (joint.axis if joint.axis is not None else (1.0, 0.0, 0.0)))
    row, offset = _driven(joint, urdf, joints, n, joint.type == "prismatic")
    return (*origin, Step(turns=joint.type != "prismatic", axis=(a, b, c), amount=offset, row=row))


def _driven(joint: UrdfJoint, urdf: Urdf, joints: JointMap, n: int, slides: bool) -> tuple[Row, Exact]:
    """How the model's joints drive a URDF joint, exactly: followers by the product of the multipliers as written."""
    if joint.name in joints.followers and joint.mimic is not None:
        row, offset = _driven(urdf.joints[joint.mimic.joint], urdf, joints, n, slides)
        factor = length_of(joint.mimic.multiplier).rational
        own = (length_of if slides else angle_of)(joint.mimic.offset)
        return tuple(factor * x for x in row), offset.scaled(factor).plus(own)
    if joint.name not in joints.names:
        return (Fraction(0),) * n, ZERO
    index = joints.names.index(joint.name)
    row = tuple(length_of(float(x)).rational for x in joints.A[index])
    return row, (length_of if slides else angle_of)(float(joints.b[index]))


def of_model(model: RobotModel, rigid: Mapping[str, Array]) -> dict[str, Chains]:
    """Both descriptions of a robot model, `dh` and `urdf`, at the mapped frames that both have.

    Args:
        model: the robot model; it has a URDF.
        rigid: the offset T_dh_frame (4, 4) of each rigid frame, by name; frames without one are left out.
    """
    if model.urdf is None or model.urdf_joints is None or model.frames.base.urdf is None:
        raise ValueError("the model has no URDF")
    table, names = {}, {}
    for frame in model.frames.frames:
        if frame.urdf is None or (frame.relation == "rigid" and frame.name not in rigid):
            continue
        if frame.relation == "rigid":
            offset = of_matrix(rigid[frame.name])
        else:
            offset = tuple(step for transform in frame.declared for step in of_transform(transform))
        table[frame.name] = (frame.dh, offset)
        names[frame.name] = (frame.urdf, ())
    T = model.table
    ends = [_end(written, matrix) for written, matrix in ((model.file.base, T.base), (model.file.tool, T.tool))]
    return {
        "dh": of_table(T, table, ends[0], ends[1]),
        "urdf": of_urdf(model.urdf, model.frames.base.urdf, names, model.urdf_joints, T.joints),
    }


def _end(written: Transform | None, T: Array) -> Path:
    """A base or tool transform as the file writes it, if the table still has that one."""
    return of_transform(written) if written is not None and np.array_equal(written.matrix(), T) else of_matrix(T)
