"""`urdf:ikpy`: the one serial chain ikpy makes of a URDF, one configuration at a time (https://github.com/Phylliade/ikpy)."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfIkpy(Engine):
    """`Chain.from_urdf_file` from the root link, or along the way to the tip if the mapping names one, which is what its
    users pass as `base_elements`; otherwise with its defaults; `forward_kinematics(full_kinematics=True)`.

    ikpy calls its links after the URDF's joints: frames are the child links of these, after the root.
    """

    source = "urdf:ikpy"
    partial = True
    requirements = ("ikpy>=4.2",)
    traits = (
        Trait(
            "first-child-only",
            "follows the first joint written below each link and loses the other branches",
            "ikpy 4.2.1: of the two branches jz1 jz2 and ja1 ja2 it has the first; a UR5 ends at ee_link",
        ),
        Misreading(
            "revolute-skewed",
            "the rotation about an axis that is not of unit length is not a rotation",
            "ikpy 4.2.1 on one-joint URDFs: axes 0 0 2 and 1 1 0 give a matrix that is not orthogonal",
            lint="unnormalised-axis",
            on="revolute",
        ),
        Misreading(
            "prismatic-scaled",
            "the travel of a prismatic joint is multiplied by the length of its axis",
            "ikpy 4.2.1 on a one-joint URDF: axis 0 0 2 moves twice as far",
            lint="unnormalised-axis",
            on="prismatic",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "ikpy 4.2.1 on a two-joint URDF: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "floating and planar joints on its chain raise ValueError",
            "ikpy 4.2.1 on a one-joint URDF",
            lint="unsupported-joint",
        ),
        *refusals(
            "ikpy 4.2.1",
            {
                "undeclared-prefix": "ParseError, 'unbound prefix'",
                "default-namespace": "ValueError: it finds no link",
                "fixed-limit-not-a-number": "ValueError, 'could not convert string to float'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        chain_module = self.library("ikpy.chain")
        try:
            robot = ElementTree.fromstring(description.text)
            links = [link.get("name", "") for link in robot.iterfind("link")]
            child_of = {joint.get("name"): _child(joint) for joint in robot.iterfind("joint")}
            root = next(link for link in links if link not in child_of.values())
            way = _way(robot, description.tip) if description.tip else [root]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # one warning for each fixed joint
                self._chain = chain_module.Chain.from_urdf_file(io.StringIO(description.text), base_elements=way)
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"from_urdf_file refused the URDF: {type(error).__name__}: {error}") from error
        # Its link 0 is the origin: the root link itself.
        self._columns = [i for i, link in enumerate(self._chain.links) if link.joint_type != "fixed"]
        self.joints = tuple(self._chain.links[i].name for i in self._columns)
        self.frames = (root, *(child_of[link.name] for link in self._chain.links[1:]))
        if not self.joints:
            raise EngineFailed(
                self.source, f"follows the first child of each link, {' -> '.join(self.frames)}: no joint moves it"
            )

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        slots = [self.frames.index(frame) for frame in frames]
        full = np.zeros((q.shape[0], len(self._chain.links)))
        full[:, self._columns] = q
        out = np.empty((q.shape[0], len(frames), 4, 4))
        forward = self._chain.forward_kinematics
        for k, q_k in enumerate(full):
            poses = forward(q_k, full_kinematics=True)
            for slot, i in enumerate(slots):
                out[k, slot] = poses[i]
        return out


def _way(robot: ElementTree.Element, tip: str) -> list[str]:
    """Links and joints in turn, from the root to `tip`."""
    above = {_child(joint): joint for joint in robot.iterfind("joint")}
    way = [tip]
    while way[0] in above:
        joint = above[way[0]]
        parent = joint.find("parent")
        way[:0] = ["" if parent is None else parent.get("link", ""), joint.get("name", "")]
    return way


def _child(joint: ElementTree.Element) -> str:
    child = joint.find("child")
    return "" if child is None else child.get("link", "")
