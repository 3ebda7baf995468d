"""`dh:roboticstoolbox-packaged`: a robot that the Robotics Toolbox ships as a DH table, `roboticstoolbox.models.DH`."""

from __future__ import annotations

import numpy as np

from harness.description.packaged import Packaged
from harness.engines.base import Trait
from harness.engines.dh_roboticstoolbox import DHRoboticstoolbox
from harness.errors import EngineFailed, nearest


class DHRoboticstoolboxPackaged(DHRoboticstoolbox):
    """`roboticstoolbox.models.DH.<robot>()` as it comes: its lengths, offsets, base and tool; joints named in its order."""

    source = "dh:roboticstoolbox-packaged"
    takes = "packaged"
    partial = True
    traits = (
        Trait(
            "packaged-numbers",
            "lengths, zero positions, base and tool are those of the library's author, not of a data sheet at hand",
            "roboticstoolbox 1.5.0: models.DH.UR5 has d1 = 0.089459 m where Universal Robots states 0.089159 m",
        ),
        *DHRoboticstoolbox.traits[1:],
    )

    def __init__(self, description: Packaged) -> None:
        rtb = self.library("roboticstoolbox")
        known = {
            name: model
            for name, model in vars(self.library("roboticstoolbox.models").DH).items()
            if isinstance(model, type) and issubclass(model, rtb.DHRobot)
        }
        if description.robot not in known:
            alike = [name for name in known if name.lower() == description.robot.lower()]
            hint = nearest(description.robot, alike or known)
            raise EngineFailed(self.source, f"no robot {description.robot!r} in roboticstoolbox.models.DH; {hint}")
        try:
            robot = known[description.robot]()
        except Exception as error:  # each model has a constructor of its own
            raise EngineFailed(self.source, f"models.DH.{description.robot}: {type(error).__name__}: {error}") from error
        if robot.n != len(description.joints):
            expected = f"expected {len(description.joints)} joints ({', '.join(description.joints)})"
            raise EngineFailed(self.source, f"{expected}, models.DH.{description.robot} has {robot.n}")
        self._adopt(robot, description.joints, range(robot.n))
        if np.array_equal(robot.tool.A, np.eye(4)):
            self.frames = self.frames[:-1]
