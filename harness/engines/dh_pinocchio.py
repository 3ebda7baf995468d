"""`dh:pinocchio`: a Pinocchio model built joint by joint from the DH table, with Pinocchio's own transforms."""

from __future__ import annotations

from typing import Any

from harness.description.dh import DHRow, DHTable
from harness.engines.pinocchio_base import PinocchioEngine


class DHPinocchio(PinocchioEngine):
    """One `JointModelRZ` or `JointModelPZ` per moving row; every constant of the table becomes a placement.

    A row is `pre * joint * post`. Standard: pre = 1, post = RotZ(theta) TransZ(d) TransX(a) RotX(alpha). Modified:
    pre = RotX(alpha) TransX(a), post = RotZ(theta) TransZ(d). The variable part commutes with RotZ and TransZ, so
    offsets may stand behind it.
    """

    source = "dh:pinocchio"

    def __init__(self, description: DHTable) -> None:
        pin = self.library("pinocchio")
        model = pin.Model()
        frame_ids: dict[str, int] = {}
        joint, since = 0, pin.SE3.Identity()  # placement of the current DH frame on joint `joint`

        def mark(label: str) -> None:
            # "dh_" keeps labels such as "base" clear of the joint names, which are frames of the model too.
            frame = pin.Frame(f"dh_{label}", joint, 0, since, pin.FrameType.OP_FRAME)
            frame_ids[label] = model.addFrame(frame, False)

        mark("base")
        since = pin.SE3(description.base)
        mark("0")
        for i, row in enumerate(description.rows, start=1):
            pre, post = _parts(pin, row, description.convention)
            since = since * pre
            if row.kind != "fixed":
                kind = pin.JointModelRZ() if row.kind == "revolute" else pin.JointModelPZ()
                joint = model.addJoint(joint, kind, since, row.name)
                since = pin.SE3.Identity()
            since = since * post
            mark(str(i))
        since = since * pin.SE3(description.tool)
        mark("tool")
        self._adopt(pin, model, frame_ids)


def _parts(pin: Any, row: DHRow, convention: str) -> tuple[Any, Any]:
    def turn(axis: str, angle: float) -> Any:
        return pin.SE3(pin.utils.rotate(axis, angle), pin.utils.zero(3))

    def shift(x: float, z: float) -> Any:
        placement = pin.SE3.Identity()
        placement.translation[0], placement.translation[2] = x, z
        return placement

    about_z = turn("z", row.theta) * shift(0.0, row.d)
    if convention == "modified":
        return turn("x", row.alpha) * shift(row.a, 0.0), about_z
    return pin.SE3.Identity(), about_z * shift(row.a, 0.0) * turn("x", row.alpha)
