"""`urdf:kdl`: an Orocos KDL tree, converted from the URDF as ROS's kdl_parser_py does (https://github.com/ros/kdl_parser)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from harness.description.urdf import UrdfText
from harness.engines.base import Misreading, Refusal, Trait
from harness.engines.kdl_base import KdlEngine, cells, placements
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfKdl(KdlEngine):
    """`PyKDL.Tree`, one chain and `ChainFkSolverPos_recursive` per leaf; the other links are segments on the way there.

    PyKDL reads no URDF, and neither Debian nor PyPI has kdl_parser_py. So its conversion is written out here: depth first,
    children in document order, `Joint(name, origin, axis, type)` in the parent's frame, `Segment(child, joint, frame)`; no
    axis is filled in, and a type other than revolute, continuous or prismatic is a fixed joint.
    """

    source = "urdf:kdl"
    traits = (
        Refusal(
            "missing-axis-refused",
            "a moving joint without <axis> is refused",
            "kdl_parser_py with urdf-parser-py 0.0.4 on a one-joint URDF: TypeError, the axis is None",
            lint="missing-axis",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "PyKDL 1.5.1: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Misreading(
            "floating-planar-fixed",
            "floating and planar joints become fixed joints",
            "PyKDL 1.5.1 with kdl_parser_py on a one-joint URDF: no joint, the link stays at the joint's origin",
            lint="unsupported-joint",
        ),
        Trait("joints-depth-first", "joints are ordered depth first, not as written", "PyKDL 1.5.1: jz1 jz2 ja1 ja2"),
    )

    def __init__(self, description: UrdfText) -> None:
        self._kdl = kdl = self.library("PyKDL")
        try:
            robot = ET.fromstring(description.text)
            above = {_named(joint, "child"): _named(joint, "parent") for joint in robot.findall("joint")}
            (root,) = (link.attrib["name"] for link in robot.findall("link") if link.attrib["name"] not in above)
            tree = kdl.Tree(root)
            segments = []
            for parent, segment in _segments(kdl, robot, root):
                if not tree.addSegment(segment, parent):
                    raise ValueError(f"addSegment({segment.getName()!r}, {parent!r}) returned False")
                segments.append(segment)
        except Exception as error:  # whatever a broken file makes it hit
            raise EngineFailed(self.source, f"kdl_parser refused the URDF: {type(error).__name__}: {error}") from error
        self.joints = tuple(s.getJoint().getName() for s in segments if s.getJoint().getType() != kdl.Joint.Fixed)
        self.frames = (root, *(segment.getName() for segment in segments))
        # Each link is a number of segments along one chain: its solver, its joints as columns of q, its JntArray, and the
        # chain itself, to which the solver has a mere reference.
        self._ways: dict[str, tuple[int, int]] = {}
        self._chains: list[tuple[Any, list[int], Any, Any]] = []
        for leaf in (name for name in self.frames if name not in above.values()):
            chain = tree.getChain(root, leaf)
            path = [chain.getSegment(i) for i in range(chain.getNrOfSegments())]
            for count, name in enumerate((root, *(segment.getName() for segment in path))):
                self._ways.setdefault(name, (len(self._chains), count))
            columns = [self.joints.index(j) for segment in path if (j := segment.getJoint().getName()) in self.joints]
            self._chains.append((kdl.ChainFkSolverPos_recursive(chain), columns, kdl.JntArray(len(columns)), chain))

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        frame = self._kdl.Frame()
        used = [self._chains[i] for i in {self._ways[name][0] for name in frames}]
        calls = [(self._chains[i][0], self._chains[i][2], count) for i, count in (self._ways[name] for name in frames)]
        values: list[float] = []
        for q_k in q.tolist():
            for _, columns, joints, _ in used:
                for i, column in enumerate(columns):
                    joints[i] = q_k[column]
            for solver, joints, count in calls:
                if solver.JntToCart(joints, frame, count) != 0:
                    raise EngineFailed(self.source, f"JntToCart: {solver.strError(solver.getError())}")
                values.extend(cells(frame))
        return placements(values, q.shape[0], len(frames))


def _segments(kdl: Any, robot: ET.Element, root: str) -> Iterator[tuple[str, Any]]:
    """Parent link and segment of every joint that can be reached from the root, depth first."""
    below: dict[str, list[ET.Element]] = {}
    for joint in robot.findall("joint"):
        below.setdefault(_named(joint, "parent"), []).append(joint)
    waiting = below.get(root, [])[::-1]
    while waiting:
        joint = waiting.pop()
        child = _named(joint, "child")
        origin = kdl.Frame(kdl.Rotation.RPY(*_numbers(joint, "rpy")), kdl.Vector(*_numbers(joint, "xyz")))
        yield _named(joint, "parent"), kdl.Segment(child, _joint(kdl, joint, origin), origin)
        waiting += below.get(child, [])[::-1]


def _joint(kdl: Any, joint: ET.Element, origin: Any) -> Any:
    types = {"revolute": kdl.Joint.RotAxis, "continuous": kdl.Joint.RotAxis, "prismatic": kdl.Joint.TransAxis}
    name, kind = joint.attrib["name"], joint.attrib["type"]
    if kind not in types:
        return kdl.Joint(name, kdl.Joint.Fixed)
    axis = joint.find("axis")
    if axis is None:
        raise TypeError(f"joint {name!r} has no <axis>")
    return kdl.Joint(name, origin.p, origin.M * kdl.Vector(*map(float, axis.attrib["xyz"].split())), types[kind])


def _named(joint: ET.Element, tag: str) -> str:
    return joint.findall(tag)[0].attrib["link"]


def _numbers(joint: ET.Element, name: str) -> list[float]:
    origin = joint.find("origin")
    return [float(x) for x in ("0 0 0" if origin is None else origin.get(name, "0 0 0")).split()]
