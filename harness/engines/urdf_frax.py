"""`urdf:frax`: robot kinematics in JAX, compiled and batched (https://github.com/danielpmorton/frax)."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array

MASS = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"


class UrdfFrax(Engine):
    """`jit(vmap(Robot(file).joint_to_world_transforms))` in float64: a joint's frame is that of the link it moves.

    The root is frax's world. Its parser tells which link each joint moves. Links get a mass, which frax insists on and the
    stripped URDF has not; it does not enter these frames.
    """

    source = "urdf:frax"
    partial = True
    requirements = ("frax>=0.1", "jax>=0.4.30")
    traits = (
        Trait(
            "fixed-links-merged",
            "links behind fixed joints are merged into their parents: no frame such as base_link or tool0 remains",
            "frax 0.1.0: of a UR5 with root `world` it has `world` and the six links that move",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "frax 0.1.0: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "floating joints raise NotImplementedError, planar ones Exception",
            "frax 0.1.0 on a one-joint URDF",
            lint="unsupported-joint",
        ),
        Trait(
            "joints-breadth-first",
            "joints are ordered breadth first",
            "frax 0.1.0: order jz1 ja1 jz2 ja2",
        ),
        *refusals(
            "frax 0.1.0",
            {
                "undeclared-prefix": "XMLSyntaxError, 'Namespace prefix drake for acceleration on limit is not defined'",
                "default-namespace": "ValueError, 'Missing required subelement(s) of type Link'",
                "unnamed-robot": "ValueError, 'Missing required attribute name'",
                "limit-without-effort": "TypeError, float() of None",
                "limit-without-velocity": "TypeError, float() of None",
                "limit-not-a-number": "ValueError, 'could not convert string to float'",
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
        jax = self.library("jax")
        jax.config.update("jax_enable_x64", True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # advice on XLA flags, at import
            frax, parser = self.library("frax"), self.library("frax.utils.urdf_parser")
        try:
            robot_xml = ET.fromstring(description.text)
            for link in robot_xml.findall("link"):
                link.append(ET.fromstring(MASS))
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder, "robot.urdf")
                path.write_bytes(ET.tostring(robot_xml))
                robot = frax.Robot(str(path))
                links, _ = parser.gs_parse_urdf(str(path))
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"Robot refused the URDF: {type(error).__name__}: {error}") from error
        self.joints = tuple(robot.joint_names)
        self.frames = tuple(link["name"] for link in links)  # the root, then the child of each joint
        self._transforms = jax.jit(jax.vmap(robot.joint_to_world_transforms))

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        count = q.shape[0]
        padded = np.zeros((1 << max(count - 1, 0).bit_length(), len(self.joints)))  # each new shape costs a compilation
        padded[:count] = q
        T = np.empty((count, len(self.frames), 4, 4))
        T[:, 0] = np.eye(4)
        T[:, 1:] = self._transforms(padded)[:count]
        return T[:, [self.frames.index(frame) for frame in frames]]
