"""Controllers with a fault, run as the gate runs a program of the user's; and the workers that start them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness import se3
from harness.description.dh import DHTable
from harness.description.model import RobotModel
from harness.engines import requirements
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.mutation.mutant import Fault
from harness.se3 import Array
from harness.workers.pool import Workers

NAMES: dict[Fault, str] = {
    "degrees": "controller", "inverse": "controller", "reversed": "controller", "mimic ignored": "urdf:controller",
}  # fmt: skip


class Degrees(DHNumpy):
    """Reads its joint values, given in degrees by a caller that means well, as radians."""

    source = "controller"

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        turns = [self.table.kind(name) == "revolute" for name in self.joints]
        return super()._placements(np.where(turns, np.degrees(q), q), frames)


class Inverse(DHNumpy):
    """Gives the base seen from the frame."""

    source = "controller"

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return se3.inverse(super()._placements(q, frames))


class Reversed(DHNumpy):
    """Multiplies on the wrong side: T = A T."""

    source = "controller"

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        table = self.table
        T = np.tile(table.base, (len(q), 1, 1))
        placed, joint = {"base": np.tile(np.eye(4), (len(q), 1, 1)), "0": T}, 0
        for i, row in enumerate(table.rows, start=1):
            moves = row.kind != "fixed"
            one_row = DHNumpy(DHTable((row,), table.convention))
            A = one_row.placements(q[:, joint : joint + 1] if moves else np.empty((len(q), 0)), ("1",))[:, 0]
            joint += moves
            placed[str(i)] = T = A @ T
        placed["tool"] = table.tool @ T
        return np.stack([placed[name] for name in frames], axis=1)


class IgnoresFollowers(UrdfPinocchio):
    """Leaves joints that mimic another at zero, whatever it is given."""

    source = "urdf:controller"
    followers: tuple[str, ...] = ()

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(q * [name not in self.followers for name in self.joints], frames)


class FaultyWorkers(Workers):
    """In this process; a command is a controller with a fault on `model`."""

    def __init__(self) -> None:
        super().__init__(in_process=True)
        self.model: RobotModel | None = None

    def start(  # type: ignore[override]
        self, source: str, command: Sequence[str], greeting: bytes, cwd: Path | None = None, adapter: type[Engine] | None = None
    ) -> Engine:
        """The controller whose fault is the command."""
        if self.model is None:
            raise ValueError("expected a model")
        return controller(command[0], self.model)


def controller(fault: str, model: RobotModel) -> Engine:
    """A controller of the model with this fault."""
    adapters: dict[str, type[DHNumpy]] = {"degrees": Degrees, "inverse": Inverse, "reversed": Reversed}
    if fault in adapters:
        return adapters[fault](model.table)
    if model.urdf is None or model.urdf_joints is None:
        raise ValueError("expected a model with a URDF")
    engine = requirements.build(IgnoresFollowers, model.urdf)
    if isinstance(engine, IgnoresFollowers):
        engine.followers = model.urdf_joints.followers
    return engine
