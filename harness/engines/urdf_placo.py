"""`urdf:placo`: the PlaCo planning and control library, which is built on Pinocchio 3.8 (https://github.com/Rhoban/placo)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Trait
from harness.engines.refusals import URDFDOM, refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfPlaco(Engine):
    """`RobotWrapper`, `set_joint`, `update_kinematics`, `get_T_world_frame`; placements in its world, the base not moved."""

    source = "urdf:placo"
    requirements = ("placo>=0.10",)
    traits = (
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "placo 0.10.2: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Trait(
            "free-flyer",
            "the root floats: q begins with a free flyer, which stays at the identity",
            "placo 0.10.2 on a one-joint URDF: nq is 8",
        ),
        Trait(
            "joints-alphabetical",
            "joints are ordered alphabetically below each link, not as written",
            "placo 0.10.2: order ja1 ja2 jz1 jz2",
        ),
        Trait(
            "shared-names-lost",
            "a link that has the name of a joint cannot be asked for",
            "placo 0.10.2 on a one-joint URDF with joint l1 and link l1: get_T_world_frame raises ValueError",
        ),
        *refusals(
            "placo 0.10.2",
            {
                **dict.fromkeys(URDFDOM, "'The XML stream does not contain a valid URDF model.'"),
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        placo = self.library("placo")
        body = self.library("pinocchio").FrameType.BODY
        try:
            self._robot = robot = placo.RobotWrapper("", int(placo.Flags.ignore_collisions), description.text)
        except Exception as error:  # C++ exceptions of several kinds
            raise EngineFailed(self.source, f"RobotWrapper refused the URDF: {type(error).__name__}: {error}") from error
        self.joints = tuple(name for name in robot.joint_names() if robot.get_joint_v_size(name) == 1)
        named = Counter(robot.frame_names())
        self.frames = tuple(f.name for f in robot.model.frames if f.type == body and named[f.name] == 1)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        out = np.empty((q.shape[0], len(frames), 4, 4))
        robot = self._robot
        for k, q_k in enumerate(q.tolist()):
            for name, value in zip(self.joints, q_k, strict=True):
                robot.set_joint(name, value)
            robot.update_kinematics()
            for slot, frame in enumerate(frames):
                out[k, slot] = robot.get_T_world_frame(frame)
        return out
