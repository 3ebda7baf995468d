"""`dh:kdl`: an Orocos KDL chain built from the DH table with KDL's own DH frames (https://www.orocos.org/kdl.html)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from harness.description.dh import DHTable
from harness.engines.base import Trait
from harness.engines.kdl_base import KdlEngine, cells, placements
from harness.errors import EngineFailed
from harness.se3 import Array


class DHKdl(KdlEngine):
    """One `PyKDL.Chain` with a `RotZ` or `TransZ` joint per moving row; base and tool are fixed segments.

    A segment is a joint, then a constant frame. Standard: `Frame.DH` follows the joint. Modified: the joint comes last, so
    `Frame.DH_Craig1989` is a fixed segment and the joint stands in a segment of its own. Offsets commute with the joint.
    """

    source = "dh:kdl"
    traits = (
        Trait(
            "one-frame-a-call",
            "each frame costs a pass from the base: JntToCart leaves a list of frames untouched",
            "PyKDL 1.5.1: JntToCart(q, [Frame(), ...], n) returns 0 and every frame is still the identity",
        ),
    )

    def __init__(self, description: DHTable) -> None:
        self._kdl = kdl = self.library("PyKDL")
        chain = kdl.Chain()
        self._segments = {"base": 0}  # how many segments lead from the root to each frame

        def add(name: str, joint: Any, frame: Any) -> None:
            chain.addSegment(kdl.Segment(name, joint, frame))
            self._segments[name] = chain.getNrOfSegments()

        add("0", kdl.Joint("base"), _frame(kdl, description.base))
        modified = description.convention == "modified"
        dh = kdl.Frame.DH_Craig1989 if modified else kdl.Frame.DH
        types = {"revolute": kdl.Joint.RotZ, "prismatic": kdl.Joint.TransZ, "fixed": kdl.Joint.Fixed}
        for i, row in enumerate(description.rows, start=1):
            constant = dh(row.a, row.alpha, row.d, row.theta)
            if modified:
                chain.addSegment(kdl.Segment(f"link {i}", kdl.Joint(f"link {i}"), constant))
                constant = kdl.Frame.Identity()
            add(str(i), kdl.Joint(row.name, types[row.kind]), constant)
        add("tool", kdl.Joint("tool"), _frame(kdl, description.tool))
        self._chain = chain  # the solver has a mere reference to it
        self._solver = kdl.ChainFkSolverPos_recursive(chain)
        self.joints = description.joints
        self.frames = tuple(self._segments)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        solve, frame = self._solver.JntToCart, self._kdl.Frame()
        joints = self._kdl.JntArray(len(self.joints))
        counts = [self._segments[name] for name in frames]
        values: list[float] = []
        for q_k in q.tolist():
            for i, value in enumerate(q_k):
                joints[i] = value
            for count in counts:
                if solve(joints, frame, count) != 0:
                    raise EngineFailed(self.source, f"JntToCart: {self._solver.strError(self._solver.getError())}")
                values.extend(cells(frame))
        return placements(values, q.shape[0], len(frames))


def _frame(kdl: Any, T: Array) -> Any:
    return kdl.Frame(kdl.Rotation(*T[:3, :3].ravel().tolist()), kdl.Vector(*T[:3, 3].tolist()))
