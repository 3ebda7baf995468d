"""`dh:roboticstoolbox`: a `DHRobot` of the Robotics Toolbox for Python (https://github.com/petercorke/robotics-toolbox-python)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.description.dh import DHTable
from harness.engines.base import Engine, Trait
from harness.errors import EngineFailed
from harness.se3 import Array


class DHRoboticstoolbox(Engine):
    """`DHRobot` of `RevoluteDH`, `PrismaticDH` or their MDH counterparts; `fkine_all` for links, `fkine` for the tool.

    A DHRobot has no fixed link. Fixed rows at the end go into its tool, as the hand does in the packaged Panda; any other is
    a revolute joint that is held at zero.
    """

    source = "dh:roboticstoolbox"
    requirements = ("roboticstoolbox-python>=1.5",)
    traits = (
        Trait(
            "no-fixed-rows",
            "a DHRobot has no fixed link: fixed rows at the end are part of its tool, others are joints held at zero",
            "roboticstoolbox 1.5.0: DHLink is revolute (sigma 0) or prismatic (sigma 1); models.DH.Panda has its hand in tool",
        ),
        Trait(
            "link-frames-without-tool",
            "fkine_all stops at the last link, fkine goes on to the tool",
            "roboticstoolbox 1.5.0, one-joint DHRobot with base and tool: fkine_all(q)[-1] * tool == fkine(q)",
        ),
    )

    def __init__(self, description: DHTable) -> None:
        rtb, SE3 = self.library("roboticstoolbox"), self.library("spatialmath").SE3
        standard = description.convention == "standard"
        revolute = rtb.RevoluteDH if standard else rtb.RevoluteMDH
        prismatic = rtb.PrismaticDH if standard else rtb.PrismaticMDH
        rows = description.rows
        try:
            links = []
            for row in rows:
                if row.kind == "prismatic":
                    links.append(prismatic(theta=row.theta, a=row.a, alpha=row.alpha, offset=row.d))
                else:
                    links.append(revolute(d=row.d, a=row.a, alpha=row.alpha, offset=row.theta))
            tool = SE3(description.tool)
            moving = [i for i, row in enumerate(rows) if row.kind != "fixed"]
            while moving and len(links) > moving[-1] + 1:
                tool = links.pop().A(0.0) * tool
            robot = rtb.DHRobot(links, base=SE3(description.base), tool=tool)
        except Exception as error:  # the constructors check their arguments in many ways
            raise EngineFailed(self.source, f"DHRobot refused the table: {type(error).__name__}: {error}") from error
        self._adopt(robot, description.joints, moving)
        if len(links) < len(rows) and np.array_equal(description.tool, np.eye(4)):
            self._tools.add(str(len(rows)))
            self.frames = (*self.frames[:-1], str(len(rows)), "tool")

    def _adopt(self, robot: Any, joints: Sequence[str], moving: Sequence[int]) -> None:
        """Take over a finished robot; `moving` are the indices of its links that are joints of the description."""
        self._robot = robot
        self._moving = list(moving)
        self.joints = tuple(joints)
        self._links = {str(i): i for i in range(robot.n + 1)}  # index into fkine_all; "base" is the world
        self._tools = {"tool"}
        self.frames = ("base", *self._links, "tool")

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        full = np.zeros((q.shape[0], self._robot.n))
        full[:, self._moving] = q
        links = [(slot, self._links[name]) for slot, name in enumerate(frames) if name in self._links]
        tools = [slot for slot, name in enumerate(frames) if name in self._tools]
        out = np.tile(np.eye(4), (q.shape[0], len(frames), 1, 1))
        for k, q_k in enumerate(full):
            if links:
                T = self._robot.fkine_all(q_k).A
                for slot, link in links:
                    out[k, slot] = T[link]
            if tools:
                out[k, tools] = self._robot.fkine(q_k).A
        return out
