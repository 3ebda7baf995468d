"""Mutants of what the files name: axes of joints, and the links that frames are mapped to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from lxml import etree

from harness.description.frames import MappedFrame
from harness.description.joints import mapped_chain
from harness.description.model import RobotModel
from harness.description.urdf import UrdfJoint
from harness.mutation.mutant import Cause, Mutant, with_frames
from harness.mutation.numbers import with_joint


def of_axes(model: RobotModel) -> Iterator[Mutant]:
    """Each axis left out, negated, and of length 2; and a joint split into a leader and a follower."""
    if model.urdf is None or model.urdf_joints is None:
        return
    moving = [j for j in mapped_chain(model.urdf, model.frames).values() if j.name in model.urdf_joints.moved and j.axis]
    for joint in moving:
        axis = joint.axis or (0.0, 0.0, 1.0)
        letter = "xyz"[int(np.abs(axis).argmax())]
        yield Mutant(
            name=f"axis of {joint.name} left out",
            side="urdf",
            operator="axis left out",
            model=_with_axis(model, joint.name, None),
            causes=(Cause("axis", joint.name, letter),),
        )
        yield Mutant(
            name=f"axis of {joint.name} negated",
            side="urdf",
            operator="joint sign",
            model=_with_axis(model, joint.name, tuple(-x for x in axis)),
            causes=(Cause("sign", _model_joint(model, joint)),),
        )
        scaled = joint.type == "prismatic"
        extra = ("urdf:yourdfpy",) if scaled else ()
        causes = (Cause("axis length"),) if scaled else ()
        yield Mutant(
            name=f"axis of {joint.name} of length 2",
            side="urdf",
            operator="axis unnormalised",
            model=_with_axis(model, joint.name, tuple(2.0 * x for x in axis)),
            causes=causes,
            extra=extra,
        )


def _with_axis(model: RobotModel, joint: str, axis: tuple[float, ...] | None) -> RobotModel:
    """The model with another axis written for a joint of its URDF; None leaves it out."""

    def edit(element: etree._Element) -> None:
        written = element.find("axis")
        if written is not None:
            element.remove(written)
        if axis is not None:
            etree.SubElement(element, "axis", xyz=" ".join(repr(x) for x in axis))

    return with_joint(model, joint, edit)


def _model_joint(model: RobotModel, joint: UrdfJoint) -> str:
    joints = model.urdf_joints
    if joints is None:
        return joint.name
    return model.table.joints[int(np.flatnonzero(joints.A[joints.names.index(joint.name)])[0])]


def of_frames(model: RobotModel) -> Iterator[Mutant]:
    """Links of two frames on one body exchanged: base and base_link, flange and tool0."""
    frames = list(model.frames.frames)
    for one, other in _neighbours(model):
        i, j = frames.index(one), frames.index(other)
        swapped = list(frames)
        swapped[i], swapped[j] = replace(one, urdf=other.urdf), replace(other, urdf=one.urdf)
        at_base = model.frames.base in (one, other)
        first, second = sorted((one.name, other.name))
        cause = Cause("base frame") if at_base else Cause("frame", first, second)
        same = one.offset is not None and other.offset is not None and np.allclose(one.offset, other.offset)
        operator = "base/base_link" if at_base else "flange/tool0"
        name = f"{one.name} and {other.name}: links exchanged"
        yield Mutant(
            name=name, side="mapping", operator=operator, model=with_frames(model, swapped), causes=() if same else (cause,)
        )


def _neighbours(model: RobotModel) -> Iterator[tuple[MappedFrame, MappedFrame]]:
    """Pairs of frames with a link at known offsets from one DH frame; of the base, and of the last row or the tool."""
    known = [f for f in model.frames.frames if f.urdf is not None and f.offset is not None]
    ends = {str(len(model.table.rows)), "tool"}
    for k, one in enumerate(known):
        for other in known[k + 1 :]:
            based = one is model.frames.base and other.dh in ("0", "base")
            if based or (one.dh == other.dh and one.dh in ends):
                yield one, other
