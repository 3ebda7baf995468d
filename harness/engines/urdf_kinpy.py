"""`urdf:kinpy`: its quaternion chain, one configuration at a time (https://github.com/neka-nat/kinpy)."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfKinpy(Engine):
    """`build_chain_from_urdf`, `forward_kinematics` of the whole tree, as its README shows."""

    source = "urdf:kinpy"
    requirements = ("kinpy>=0.6",)
    traits = (
        Misreading(
            "missing-axis-z",
            "a joint without <axis> moves along or turns about z; the specification says x",
            "kinpy 0.6.1 on a one-joint URDF",
            lint="missing-axis",
        ),
        Misreading(
            "prismatic-scaled",
            "the travel of a prismatic joint is multiplied by the length of its axis",
            "kinpy 0.6.1 on a one-joint URDF: axis 0 0 2 moves twice as far",
            lint="unnormalised-axis",
            on="prismatic",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "kinpy 0.6.1 on a two-joint URDF: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "floating and planar joints raise KeyError",
            "kinpy 0.6.1 on a two-joint URDF",
            lint="unsupported-joint",
        ),
        Trait(
            "joints-depth-first",
            "joints are ordered depth first, not as written",
            "kinpy 0.6.1: order jz1 jz2 ja1 ja2 for a file that writes jz1 ja1 jz2 ja2",
        ),
        *refusals(
            "kinpy 0.6.1",
            {
                "undeclared-prefix": "XMLSyntaxError, 'Namespace prefix drake for acceleration on limit is not defined'",
                "default-namespace": "UnboundLocalError: it finds no link",
                "limit-without-effort": "ParseError, 'Required attribute not set in XML: effort'",
                "limit-without-velocity": "ParseError, 'Required attribute not set in XML: velocity'",
                "limit-not-a-number": "ParseError, 'could not convert string to float'",
                "fixed-axis-without-xyz": "AttributeError, 'NoneType' object has no attribute 'split'",
                "fixed-axis-not-numbers": "ValueError, 'could not convert string to float'",
                "fixed-limit-not-a-number": "ParseError, 'could not convert string to float'",
                "fixed-mimic-not-a-number": "ParseError, 'could not convert string to float'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        kinpy = self.library("kinpy")
        try:
            with contextlib.redirect_stderr(io.StringIO()):  # it lists every attribute it does not know
                self._chain = kinpy.build_chain_from_urdf(description.text)
            self.joints = tuple(self._chain.get_joint_parameter_names())
            self.frames = tuple(frame.link.name for frame in self._chain)
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"build_chain_from_urdf refused the URDF: {type(error).__name__}: {error}") from error

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        out = np.empty((q.shape[0], len(frames), 4, 4))
        forward = self._chain.forward_kinematics
        for k, q_k in enumerate(q):
            poses = forward(dict(zip(self.joints, q_k, strict=True)))
            row = out[k]
            for slot, frame in enumerate(frames):
                row[slot] = poses[frame].matrix()
        return out
