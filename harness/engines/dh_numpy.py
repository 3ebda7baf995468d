"""`dh:numpy`, the in-house forward kinematics: a DH product over structure-of-arrays blocks.

A frame is three axes and an origin, each (3, B) with one configuration a column. Every elementary DH factor moves only
two axes or the origin, so a row costs a dozen vector operations and no 4x4 product. Blocks keep these in the cache.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.engines.base import Engine, Trait
from harness.se3 import Array, sincos

BLOCK = 4096  # configurations at a time, so that one frame of all of them stays in the cache
THREADED = 4  # blocks from which threads pay


@dataclass
class _Frame:
    """Axes x, y, z and origin p of one frame in the base frame, each (3, 1) while constant, else (3, B)."""

    x: Array
    y: Array
    z: Array
    p: Array

    @classmethod
    def constant(cls, T: Array) -> _Frame:
        return cls(*(np.ascontiguousarray(T[:3, k : k + 1]) for k in range(4)))

    def rot_z(self, s: Any, c: Any) -> None:
        self.x, self.y = self.x * c + self.y * s, self.y * c - self.x * s

    def rot_x(self, angle: float) -> None:
        if angle == 0.0:
            return
        s, c = sincos(angle)
        if c == 0.0:  # a right angle, as in most tables: the axes only trade places
            self.y, self.z = (self.z, -self.y) if s > 0 else (-self.z, self.y)
        else:
            self.y, self.z = self.y * c + self.z * s, self.z * c - self.y * s

    def move(self, axis: Array, distance: Any) -> None:
        if isinstance(distance, np.ndarray) or distance != 0.0:
            self.p = self.p + axis * distance

    def times(self, T: Array) -> _Frame:
        if np.array_equal(T, np.eye(4)):
            return self
        x, y, z = (self.x * T[0, k] + self.y * T[1, k] + self.z * T[2, k] for k in range(3))
        return _Frame(x, y, z, self.p + self.x * T[0, 3] + self.y * T[1, 3] + self.z * T[2, 3])


class DHNumpy(Engine):
    """The in-house FK of a `DHTable`: standard and modified; revolute, prismatic and fixed rows; base and tool."""

    source = "dh:numpy"
    isolated = False  # our own, and the yardstick: without it there is no run
    traits = (Trait("in-house", "vectorised DH product in float64", "harness/engines/dh_numpy.py"),)

    def __init__(self, description: DHTable) -> None:
        self.table = description
        self.joints = description.joints
        self.frames = description.frames

    def installed(self) -> dict[str, str]:
        """Version of NumPy, which the harness itself needs."""
        return {"numpy": np.__version__, **self.versions()}

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        count = q.shape[0]
        # (F, 4, 4, N): each entry of a placement is one contiguous vector over the configurations.
        out = np.empty((len(frames), 4, 4, count))
        out[:, 3, :3] = 0.0
        out[:, 3, 3] = 1.0
        slots: dict[str, list[int]] = {}
        for slot, label in enumerate(frames):
            slots.setdefault(label, []).append(slot)

        def fill(start: int) -> None:
            block = slice(start, min(start + BLOCK, count))
            for label, frame in self._chain(np.ascontiguousarray(q[block].T)):
                for slot in slots.get(label, ()):
                    for column, axis in enumerate((frame.x, frame.y, frame.z, frame.p)):
                        out[slot, :3, column, block] = axis

        starts = range(0, count, BLOCK)
        if len(starts) < THREADED:
            for start in starts:
                fill(start)
        else:  # blocks are independent, and NumPy lets go of the interpreter inside each operation
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                list(pool.map(fill, starts))
        return out.transpose(3, 0, 1, 2)

    def _chain(self, q: Array) -> Iterator[tuple[str, _Frame]]:
        """Every frame of the table for one block of configurations, q (n, B)."""
        frame = _Frame.constant(np.eye(4))
        yield "base", frame
        frame = _Frame.constant(self.table.base)
        yield "0", frame
        joint = 0
        for i, row in enumerate(self.table.rows, start=1):
            if row.kind == "fixed":
                self._row(frame, row, None)
            else:
                self._row(frame, row, q[joint])
                joint += 1
            yield str(i), frame
        yield "tool", frame.times(self.table.tool)

    def _row(self, frame: _Frame, row: DHRow, q: Array | None) -> None:
        """frame <- frame A_i, factor by factor in the table's convention."""
        distance = row.d if q is None or row.kind != "prismatic" else q + row.d
        if self.table.convention == "modified":
            frame.rot_x(row.alpha)
            frame.move(frame.x, row.a)
            self._joint_angle(frame, row, q)
            frame.move(frame.z, distance)
        else:
            self._joint_angle(frame, row, q)
            frame.move(frame.z, distance)
            frame.move(frame.x, row.a)
            frame.rot_x(row.alpha)

    def _joint_angle(self, frame: _Frame, row: DHRow, q: Array | None) -> None:
        if q is not None and row.kind == "revolute":
            s, c = np.sin(q), np.cos(q)
            if row.theta != 0.0:  # by the sum formula: q + theta would round, and an offset of pi/2 is exact here
                so, co = sincos(row.theta)
                s, c = s * co + c * so, c * co - s * so
            frame.rot_z(s, c)
        elif row.theta != 0.0:
            frame.rot_z(*sincos(row.theta))
