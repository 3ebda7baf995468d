"""Mutants that are the same mechanism written otherwise: the gate must not flag them. And a follower that an engine ignores."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from lxml import etree

from harness import se3
from harness.description.frames import MappedFrame
from harness.description.joints import JointMap, mapped_chain
from harness.description.model import RobotModel
from harness.mutation.mutant import Cause, Mutant, offset_by, with_frames, with_row, with_rows
from harness.mutation.numbers import with_urdf
from harness.se3 import Array

SLIDE = 0.25


def equivalents(model: RobotModel) -> Iterator[Mutant]:
    """theta + 2 pi, slides along parallel axes, the base's height moved into d1, standard rewritten as modified."""
    rows = model.table.rows
    for i, row in enumerate(rows):
        if row.kind == "revolute":
            turned = with_row(model, i, theta=row.theta + 2.0 * math.pi)
            yield Mutant(name=f"theta of {row.name} + 2 pi", side="table", operator="theta + 2 pi", model=turned)
    yield from _slides(model)
    yield _base_into_d1(model)
    if model.table.convention == "standard":
        yield _as_modified(model)


def _slides(model: RobotModel) -> Iterator[Mutant]:
    """Rows i and i + 1 turn about parallel axes: frame i may stand anywhere along them."""
    rows, standard = model.table.rows, model.table.convention == "standard"
    for i in range(len(rows) - 1):
        one, other = rows[i], rows[i + 1]
        twist = one.alpha if standard else other.alpha
        if one.kind == other.kind == "revolute" and twist == 0.0:
            slid = list(rows)
            slid[i], slid[i + 1] = replace(one, d=one.d + SLIDE), replace(other, d=other.d - SLIDE)
            back = se3.translation((0.0, 0.0, -SLIDE))
            frames = [offset_by(f, back) if f.dh == str(i + 1) else f for f in model.frames.frames]
            name = f"d of {one.name} and {other.name} slid along their parallel axes"
            yield Mutant(name=name, side="table", operator="slide", model=with_frames(with_rows(model, slid), frames))


def _base_into_d1(model: RobotModel) -> Mutant:
    """base Tz(s) and d1 - s, where row 1 turns or slides along z of frame 0."""
    rows, table = list(model.table.rows), model.table
    rows[0] = replace(rows[0], d=rows[0].d - SLIDE)
    frames = [_lowered(f.dh, f, table.base) for f in model.frames.frames]
    moved = with_rows(model, rows, base=table.base @ se3.translation((0.0, 0.0, SLIDE)))
    return Mutant(name="base moved into d1", side="table", operator="base into d1", model=with_frames(moved, frames))


def _lowered(label: str, frame: MappedFrame, base: Array) -> MappedFrame:
    """A frame on DH frame 0, which has moved: on the base now, which has not."""
    if label != "0":
        return frame
    if np.array_equal(base, np.eye(4)):
        return replace(frame, dh="base")
    return offset_by(frame, se3.translation((0.0, 0.0, -SLIDE)))


def _as_modified(model: RobotModel) -> Mutant:
    """Rows regrouped as Craig has them: alpha and a one row later, the last ones in the tool."""
    table = model.table
    alphas, lengths = [0.0, *(r.alpha for r in table.rows)], [0.0, *(r.a for r in table.rows)]
    rows = [replace(r, alpha=alphas[i], a=lengths[i]) for i, r in enumerate(table.rows)]
    # By DH frame: what its row has after the joint, which modified DH writes on the next row.
    ends = {str(i): se3.translation((r.a, 0.0, 0.0)) @ se3.rotation("x", r.alpha) for i, r in enumerate(table.rows, start=1)}
    last = str(len(table.rows))
    tool = ends[last] @ table.tool
    frames = [offset_by(f, ends[f.dh]) if f.dh in ends else f for f in model.frames.frames]
    modified = with_rows(model, rows, convention="modified", tool=tool)
    return Mutant(
        name="standard rewritten as modified", side="table", operator="as modified", model=with_frames(modified, frames)
    )


def with_follower(model: RobotModel) -> Iterator[Mutant]:
    """The second joint split in two about one axis, a leader at -q and a follower at -2 times that: the same motion.

    An engine that ignores the follower turns the joint the other way.
    """
    urdf, joints = model.urdf, model.urdf_joints
    if urdf is None or joints is None:
        return
    turning = [
        j for j in mapped_chain(urdf, model.frames).values() if j.name in joints.moved and j.type != "prismatic" and j.axis
    ]
    if len(turning) < 2:
        return
    joint = turning[1]
    robot = etree.fromstring(urdf.text.encode())
    element = next(e for e in robot.iter("joint") if e.get("name") == joint.name)
    middle, follower = f"{joint.name}_middle", f"{joint.name}_follower"
    child = element.find("child")
    if child is None:
        return
    etree.SubElement(robot, "link", name=middle)
    second = etree.SubElement(robot, "joint", name=follower, type=joint.type)
    etree.SubElement(second, "parent", link=middle)
    etree.SubElement(second, "child", link=str(child.get("link")))
    for tag in ("axis", "limit"):
        if (part := element.find(tag)) is not None:
            second.append(etree.fromstring(etree.tostring(part)))
    etree.SubElement(second, "mimic", joint=joint.name, multiplier="-2", offset="0")
    child.set("link", middle)
    split = with_urdf(model, robot)
    row = joints.names.index(joint.name)
    A = np.vstack([joints.A, 2.0 * joints.A[row]])
    A[row] *= -1.0
    names = (*joints.names, follower)
    b = np.append(joints.b, 2.0 * joints.b[row])
    b[row] *= -1.0
    order = [names.index(name) for name in (split.urdf.movable if split.urdf else names)]
    joint_map = JointMap(
        names=tuple(names[i] for i in order), A=A[order], b=b[order], followers=(*joints.followers, follower), held=joints.held
    )
    split = replace(split, urdf_joints=joint_map)
    yield Mutant(name=f"{joint.name} split into a leader and a follower", side="urdf", operator="mimic", model=split)
    own = model.table.joints[int(np.flatnonzero(joints.A[row])[0])]
    causes = (Cause("mimic", follower), Cause("sign", own))
    yield Mutant(
        name=f"follower of {joint.name} ignored",
        side="controller",
        operator="mimic ignored",
        model=split,
        causes=causes,
        fault="mimic ignored",
    )
