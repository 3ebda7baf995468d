"""`urdf:mujoco`: body frames after `mj_kinematics` of the model MuJoCo compiles from the URDF (https://mujoco.org)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array

# What every user has to write: by default links on fixed joints are fused away, and links without mass are refused.
_COMPILER = {"fusestatic": "false", "discardvisual": "false", "boundmass": "1e-3", "boundinertia": "1e-6"}


class UrdfMujoco(Engine):
    """`MjModel.from_xml_string` with the compiler options that keep every link; frames are the bodies."""

    source = "urdf:mujoco"
    requirements = ("mujoco>=3.3",)
    traits = (
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom: the equality made of it acts on the dynamics only",
            "MuJoCo 4.0.0 on a two-joint URDF: a follower stays at zero when only its leader is set; google-deepmind/mujoco#3527",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "a floating joint is refused except at the top level",
            "MuJoCo 4.0.0 on a two-joint URDF: 'free joint can only be used on top level'",
            lint="unsupported-joint",
            on="floating",
        ),
        Misreading(
            "planar-three-joints",
            "a planar joint becomes three joints, which stay at zero",
            "MuJoCo 4.0.0 on a two-joint URDF: joints off_TX, off_TY, off_RZ",
            lint="unsupported-joint",
            on="planar",
        ),
        Trait(
            "world-is-the-root",
            "a link called world that is not the root is taken for it: what hangs below it is placed from the root",
            "MuJoCo 4.0.0 on a three-joint URDF; a root link called world is as any other",
        ),
        Trait(
            "joints-depth-first",
            "joints are ordered depth first, not as written",
            "MuJoCo 4.0.0: order jz1 jz2 ja1 ja2 for a file that writes jz1 ja1 jz2 ja2",
        ),
        *refusals(
            "MuJoCo 4.0.0",
            {
                "limit-not-a-number": "'bad format in attribute effort'",
                "fixed-axis-without-xyz": "'required attribute missing: xyz'",
                "fixed-axis-not-numbers": "'bad format in attribute xyz'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        self._mujoco = mujoco = self.library("mujoco")
        mujoco.set_mju_user_warning(lambda _: None)  # which else go to stdout and to a file in the working directory
        try:
            robot = ElementTree.fromstring(description.text)
            ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", _COMPILER)
            self._model = model = mujoco.MjModel.from_xml_string(ElementTree.tostring(robot, encoding="unicode"))
        except Exception as error:  # the compiler raises ValueError, and mujoco.FatalError where it meant to exit
            raise EngineFailed(self.source, f"from_xml_string refused the URDF: {type(error).__name__}: {error}") from error
        self._data = mujoco.MjData(model)
        # Body 0 is MuJoCo's own "world", and the root link too if that is its name. Elsewhere a link "world" is lost.
        children = {child.get("link") for child in robot.iterfind("joint/child")}
        world_is_root = "world" not in children and any(link.get("name") == "world" for link in robot.iterfind("link"))
        bodies = {model.body(i).name: i for i in range(0 if world_is_root else 1, model.nbody)}
        # One joint to a body, except for planar: three joints of MuJoCo's own making.
        one_value = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        joints = [i for i in range(model.njnt) if model.jnt_type[i] in one_value and model.body_jntnum[model.jnt_bodyid[i]] == 1]
        self.joints = tuple(model.joint(i).name for i in joints)
        self.frames = tuple(bodies)
        self._bodies = bodies
        self._columns = [int(model.jnt_qposadr[i]) for i in joints]

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        model, data, forward = self._model, self._data, self._mujoco.mj_kinematics
        qpos, xpos, xmat = data.qpos, data.xpos, data.xmat  # views, which each call of `forward` fills anew
        bodies = [self._bodies[frame] for frame in frames]
        full = np.tile(model.qpos0, (q.shape[0], 1))
        full[:, self._columns] = q
        positions = np.empty((q.shape[0], len(frames), 3))
        rotations = np.empty((q.shape[0], len(frames), 9))
        for k, q_k in enumerate(full):
            qpos[:] = q_k
            forward(model, data)
            xpos.take(bodies, axis=0, out=positions[k])
            xmat.take(bodies, axis=0, out=rotations[k])
        out = np.zeros((q.shape[0], len(frames), 4, 4))
        out[..., :3, :3] = rotations.reshape(q.shape[0], len(frames), 3, 3)
        out[..., :3, 3] = positions
        out[..., 3, 3] = 1.0
        return out
