"""A mutant: a robot model with one fault, and the cause that an explanation has to name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from harness.description.dh import DHRow
from harness.description.frames import FrameMap, MappedFrame
from harness.description.model import RobotModel
from harness.report.explanation import OneChange
from harness.se3 import Array

Fault: TypeAlias = Literal["", "degrees", "inverse", "reversed", "mimic ignored"]
WITHIN = 0.01  # of the true size


@dataclass(frozen=True)
class Cause:
    """What an explanation must name: kind of change, joint or frame, parameter, and by how much, if it is a number [m or rad]."""

    kind: str
    subject: str = ""
    parameter: str = ""
    size: float | None = None

    def named_by(self, change: OneChange) -> bool:
        """Whether a change is this one, with joint and size."""
        if change.kind != self.kind or (self.subject and {change.subject, change.parameter} < {self.subject, self.parameter}):
            return False
        if self.subject and {change.subject, change.parameter} != {self.subject, self.parameter}:
            return False
        if self.size is None:
            return True
        off = change.size - self.size
        off = math.remainder(off, 2.0 * math.pi) if change.unit == "rad" else off
        return abs(off) <= WITHIN * abs(self.size)


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One fault. side: where it was put; operator: its kind in the score; causes: any of them is right; none for an equivalent
    mutant, which must not be flagged. fault: what a controller does wrong, run as a program of its own on the model.
    extra: sources that are asked besides."""

    name: str
    side: Literal["table", "urdf", "mapping", "controller"]
    operator: str
    model: RobotModel
    causes: tuple[Cause, ...] = ()
    fault: Fault = ""
    extra: tuple[str, ...] = ()

    @property
    def equivalent(self) -> bool:
        """Whether it is the same mechanism."""
        return not self.causes


def with_rows(model: RobotModel, rows: list[DHRow] | tuple[DHRow, ...], **table: object) -> RobotModel:
    """The model with other rows, and other fields of its table."""
    return replace(model, table=replace(model.table, rows=tuple(rows), **table))  # type: ignore[arg-type]


def with_row(model: RobotModel, index: int, **changes: float) -> RobotModel:
    """The model with one row changed."""
    rows = list(model.table.rows)
    rows[index] = replace(rows[index], **changes)  # type: ignore[arg-type]
    return with_rows(model, rows)


def with_frames(model: RobotModel, frames: list[MappedFrame]) -> RobotModel:
    """The model with another mapping of frames; the base frame keeps its name."""
    base = next(f for f in frames if f.name == model.frames.base.name)
    return replace(model, frames=FrameMap(tuple(frames), base))


def offset_by(frame: MappedFrame, Y: Array) -> MappedFrame:
    """The frame with Y (4, 4) between its DH frame and its offset; it is then no longer that DH frame."""
    if frame.offset is None or np.array_equal(Y, np.eye(4)):
        return frame
    relation: Literal["declared"] = "declared"
    return replace(frame, offset=Y @ frame.offset, relation=relation)
