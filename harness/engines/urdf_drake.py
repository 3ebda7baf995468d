"""`urdf:drake`: body poses of the MultibodyPlant Drake parses from the URDF (https://drake.mit.edu)."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfDrake(Engine):
    """`Parser.AddModelsFromString`, the root welded to the world, `Body.EvalPoseInWorld`, as its tutorials show."""

    source = "urdf:drake"
    requirements = ("drake>=1.51",)
    traits = (
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "Drake 1.51.1 on a two-joint URDF: two positions; a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-fixed-mimic",
            "refuses a <mimic> on a fixed joint",
            "Drake 1.51.1 on a two-joint URDF, 'has 0 DOF cannot mimic'; 1.45.0 took it; four of example-robot-data's files",
            lint="fixed-mimic",
        ),
        Misreading(
            "floating-free",
            "a floating joint is dropped: its child link is a free body, placed at the world's origin, not at the joint's",
            "Drake 1.51.1 on a two-joint URDF: 'not supported by MultibodyPlant. Leaving l2 as a free body', l2 at 0 0 0",
            lint="unsupported-joint",
            on="floating",
        ),
        Trait(
            "joints-depth-first",
            "positions are ordered depth first, joints as written",
            "Drake 1.51.1: order jz1 jz2 ja1 ja2 for a file that writes jz1 ja1 jz2 ja2",
        ),
        *refusals(
            "Drake 1.51.1",
            {
                "unnamed-robot": "'Your robot must have a name attribute or a model name must be specified.'",
                "empty-name": "an assertion of model_instance.cc ends the program",
                "limit-not-a-number": "'Expected single value for attribute effort'",
                "limit-not-finite": "'Expected single value for attribute effort'",
                "negative-velocity": "an assertion of its multibody tree ends the program",
                "limits-reversed": "an assertion of its multibody tree ends the program",
                "fixed-mimic-not-a-number": "'Expected single value for attribute multiplier'",
                "fixed-mimic-not-finite": "'Expected single value for attribute multiplier'",
                "unknown-mimic": "'Joint k mimic element specifies joint nobody which does not exist'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        parsing = self.library("pydrake.multibody.parsing")
        plant = self.library("pydrake.multibody.plant").MultibodyPlant(0.0)
        logging.getLogger("drake").setLevel(logging.ERROR)
        try:
            robot = ElementTree.fromstring(description.text)
            links = [link.get("name") for link in robot.iterfind("link")]
            (instance,) = parsing.Parser(plant).AddModelsFromString(description.text, "urdf")
            bodies = [plant.get_body(i) for i in plant.GetBodyIndices(instance)]
            if "world" in links:  # Drake takes a link of this name for its own world
                bodies.insert(0, plant.world_body())
            else:
                children = {child.get("link") for child in robot.iterfind("joint/child")}
                root = next(link for link in links if link not in children)
                plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(root, instance))
            plant.Finalize()
        except (Exception, SystemExit) as error:  # Drake's assertions raise SystemExit: no name, limits the wrong way round
            raise EngineFailed(self.source, f"Parser refused the URDF: {type(error).__name__}: {error}") from error
        self._plant = plant
        self._context = plant.CreateDefaultContext()
        joints = [plant.get_joint(i) for i in plant.GetJointIndices(instance)]
        moving = sorted((j for j in joints if j.num_positions() == 1), key=lambda joint: joint.position_start())
        self._columns = [joint.position_start() for joint in moving]
        self._bodies = {body.name(): body for body in bodies}
        self.joints = tuple(joint.name() for joint in moving)
        self.frames = tuple(self._bodies)
        self._neutral = plant.GetPositions(self._context)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        context, set_positions = self._context, self._plant.SetPositions
        poses = [self._bodies[frame].EvalPoseInWorld for frame in frames]
        full = np.tile(self._neutral, (q.shape[0], 1))
        full[:, self._columns] = q
        out = np.empty((q.shape[0], len(frames), 4, 4))
        for k, q_k in enumerate(full):
            set_positions(context, q_k)
            row = out[k]
            for slot, pose in enumerate(poses):
                row[slot] = pose(context).GetAsMatrix4()
        return out
