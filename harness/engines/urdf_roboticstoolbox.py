"""`urdf:roboticstoolbox`: `Robot.URDF` of the Robotics Toolbox (https://github.com/petercorke/robotics-toolbox-python)."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfRoboticstoolbox(Engine):
    """`Robot.URDF(file)`; each link's elementary transform sequence, `robot.ets(end=link)`, evaluated for the whole batch."""

    source = "urdf:roboticstoolbox"
    requirements = ("roboticstoolbox-python>=1.5",)
    traits = (
        Misreading(
            "oblique-axis",
            "an axis with two or three non-zero components is taken for z, after a turn of 1 rad about that axis",
            "roboticstoolbox 1.5.0 on one-joint URDFs, axis 0.6 0 0.8, 1 1 0 and 0 1e-16 1, revolute and prismatic: the link is"
            " turned at q = 0 already; petercorke/robotics-toolbox-python#253",
            lint="oblique-axis",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "roboticstoolbox 1.5.0: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Misreading(
            "floating-planar-fixed",
            "floating and planar joints become fixed without a word",
            "roboticstoolbox 1.5.0 on a one-joint URDF: n is 0 and the link stays at the joint's origin",
            lint="unsupported-joint",
        ),
        Trait("joints-depth-first", "joints are ordered depth first, not as written", "roboticstoolbox 1.5.0: jz1 jz2 ja1 ja2"),
        *refusals(
            "roboticstoolbox 1.5.0",
            {
                "undeclared-prefix": "URDFError, 'not well-formed XML: unbound prefix'",
                "default-namespace": "URDFError, 'missing required <link> element(s)'",
                "unnamed-robot": "URDFError, 'missing required attribute name'",
                "limit-without-effort": "URDFError, 'missing required attribute effort'",
                "limit-without-velocity": "URDFError, 'missing required attribute velocity'",
                "limit-not-a-number": "URDFError, 'could not convert string to float'",
                "prismatic-without-limit": "URDFError, 'Require joint limit for prismatic and revolute joints'",
                "revolute-without-limit": "URDFError, 'Require joint limit for prismatic and revolute joints'",
                "fixed-axis-without-xyz": "URDFError, 'missing attribute xyz'",
                "fixed-axis-not-numbers": "URDFError, 'string or file could not be read to its end due to unmatched data'",
                "fixed-limit-not-a-number": "URDFError, 'could not convert string to float'",
                "fixed-mimic-not-a-number": "URDFError, 'could not convert string to float'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        rtb = self.library("roboticstoolbox")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)  # Robot.URDF itself, since 1.5
                robot = rtb.Robot.URDF(io.StringIO(description.text))
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"Robot.URDF refused the URDF: {type(error).__name__}: {error}") from error
        self._robot = robot
        self.joints = tuple(link._joint_name for link in robot.links if link.isjoint)
        self.frames = tuple(link.name for link in robot.links)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        out = np.empty((q.shape[0], len(frames), 4, 4))
        if len(q):
            for slot, frame in enumerate(frames):
                out[:, slot] = self._robot.ets(end=frame).eval(q)
        return out
