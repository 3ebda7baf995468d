"""What both Pinocchio sources share: filling q by joint name and reading frame placements `oMf`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from harness.engines.base import Engine, Trait
from harness.errors import EngineFailed
from harness.se3 import Array


class PinocchioEngine(Engine):
    """Forward kinematics of a `pinocchio.Model`. Subclasses build `model` and name its frames."""

    requirements: ClassVar[tuple[str, ...]] = ("pin>=3.9",)
    traits: tuple[Trait, ...] = (
        Trait(
            "joints-alphabetical",
            "joints are ordered alphabetically below each link, not as written",
            "stack-of-tasks/pinocchio#379; order ja1 ja2 jz1 jz2 for a file that writes jz1 ja1 jz2 ja2",
        ),
        Trait(
            "continuous-cos-sin",
            "a continuous joint is held as (cos q, sin q): nq differs from nv",
            "pinocchio 4.1.0, JointModelRUBZ: nq 2, nv 1",
        ),
    )

    def _adopt(self, pin: Any, model: Any, frame_ids: dict[str, int]) -> None:
        """Take over a finished model; `frame_ids` maps frame names to indices into `model.frames`."""
        self._pin, self._model, self._data = pin, model, model.createData()
        self._frame_ids = frame_ids
        self.frames = tuple(frame_ids)
        # Joint 0 is the universe. Joints of the model's own making (a free flyer) have no name in the description.
        self._columns: list[tuple[int, int]] = []
        names = []
        for i in range(1, model.njoints):
            nq, nv = model.joints[i].nq, model.joints[i].nv
            if nv == 1 and nq in (1, 2):
                names.append(model.names[i])
                self._columns.append((model.joints[i].idx_q, nq))
        self.joints = tuple(names)
        self._neutral = pin.neutral(model)

    def _fill(self, q: Array) -> Array:
        """q by name (N, n) as Pinocchio's configuration vectors (N, nq)."""
        full = np.tile(self._neutral, (q.shape[0], 1))
        for column, (start, width) in enumerate(self._columns):
            if width == 1:
                full[:, start] = q[:, column]
            else:
                full[:, start] = np.cos(q[:, column])
                full[:, start + 1] = np.sin(q[:, column])
        return full

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        out = np.empty((q.shape[0], len(frames), 4, 4))
        model, data, forward = self._model, self._data, self._pin.framesForwardKinematics
        # Views of the C++ placements: each call of `forward` updates them in place.
        oMf = [data.oMf[self._frame_ids[frame]] for frame in frames]
        try:
            for k, q_k in enumerate(self._fill(q)):
                forward(model, data, q_k)
                row = out[k]
                for slot, placement in enumerate(oMf):
                    row[slot] = placement.homogeneous
        except (ValueError, RuntimeError) as error:
            raise EngineFailed(self.source, f"framesForwardKinematics: {error}") from error
        return out
