"""`urdf:urchin`: its batched link kinematics (https://github.com/fishbotics/urchin)."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfUrchin(Engine):
    """`URDF.load`, `link_fk_batch`, as its documentation shows; frames are the URDF links."""

    source = "urdf:urchin"
    requirements = ("urchin>=0.0.30",)
    traits = (
        Trait(
            "mimic-applied",
            "mimic joints follow their leader, as the specification says",
            "urchin 0.0.30 on a two-joint URDF",
            lint="mimic",
        ),
        Trait(
            "mimic-one-level",
            "a joint that mimics a mimic joint stays at zero",
            "urchin 0.0.30 on a three-joint URDF",
            lint="mimic",
        ),
        Trait(
            "short-axis-x",
            "an axis shorter than 1e-4 is taken for a missing one: x",
            "urchin 0.0.30 on a one-joint URDF: axis 0 0 1e-5 turns about x",
            lint="unnormalised-axis",
        ),
        *refusals(
            "urchin 0.0.30",
            {
                "undeclared-prefix": "XMLSyntaxError, 'Namespace prefix drake for acceleration on limit is not defined'",
                "default-namespace": "NetworkXPointlessConcept: it finds no link",
                "limit-without-effort": "ValueError, 'Missing required attribute effort'",
                "limit-without-velocity": "ValueError, 'Missing required attribute velocity'",
                "limit-not-a-number": "ValueError, 'Missing required attribute effort'",
                "prismatic-without-limit": "ValueError, 'Require joint limit for prismatic and revolute joints'",
                "revolute-without-limit": "ValueError, 'Require joint limit for prismatic and revolute joints'",
                "fixed-axis-without-xyz": "KeyError, 'xyz'",
                "fixed-axis-not-numbers": "ValueError, 'string or file could not be read to its end due to unmatched data'",
                "fixed-limit-not-a-number": "ValueError, 'could not convert string to float'",
                "fixed-mimic-not-a-number": "ValueError, 'could not convert string to float'",
                "unknown-mimic": "ValueError, 'Joint k has an invalid mimic joint name nobody'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        urchin = self.library("urchin")
        try:
            with tempfile.TemporaryDirectory() as folder:  # it takes a file name, or a file that has one
                path = Path(folder, "robot.urdf")
                path.write_text(description.text, encoding="utf-8")
                self._robot = urchin.URDF.load(str(path))
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"URDF.load refused the URDF: {type(error).__name__}: {error}") from error
        # Floating and planar joints count as actuated, but its batches cannot move them: left out, they stay at their origin.
        moving = [joint for joint in self._robot.actuated_joints if joint.joint_type not in ("floating", "planar")]
        self.joints = tuple(joint.name for joint in moving)
        self.frames = tuple(link.name for link in self._robot.links)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        count = q.shape[0]
        columns = {name: q[:, i] for i, name in enumerate(self.joints)}
        # A robot without joints has no column that tells the number of configurations.
        poses = self._robot.link_fk_batch(columns or [{}] * count, links=list(frames), use_names=True)
        out = np.empty((count, len(frames), 4, 4))
        for slot, frame in enumerate(frames):
            out[:, slot] = poses[frame]
        return out
