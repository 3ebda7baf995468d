"""Published placements: claims found in manuals and articles, to be checked against the table and not believed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from harness import se3
from harness.description.values import Label, Length, Lengths3, Number, Strict, Text, Vector3

Row = list[Number]


class PublishedEntry(Strict):
    """One `[[configuration.published]]`: where a frame is said to be.

    The placement is `matrix`, or `position` alone or with `rotation` or `rpy`.

    Attributes:
        dh: label of the DH frame.
        relative_to: label of the DH frame in which the placement is given.
        matrix: 3 or 4 rows of 4 numbers [m].
        position: (3,) [m].
        rotation: 3 rows of 3 numbers.
        rpy: roll, pitch, yaw (3,), in the configuration's unit.
        tolerance: largest error of any entry of the position [m].
        rotation_tolerance: largest error of any entry of the rotation; the same number as `tolerance` if it is left out.
        provenance: where it is published.
        status: whether the claim is known to hold.
        reason: why a wrong one is wrong.
    """

    dh: Label
    relative_to: Label = "base"
    matrix: list[Row] | None = None
    position: Lengths3 | None = None
    rotation: list[Row] | None = None
    rpy: Vector3 | None = None
    tolerance: Length = Field(gt=0)
    rotation_tolerance: Number | None = Field(default=None, gt=0)
    provenance: Text = Field(min_length=1)
    status: Literal["holds", "wrong"]
    reason: Text = ""

    @model_validator(mode="after")
    def _complete(self) -> PublishedEntry:
        if (self.matrix is None) == (self.position is None):
            raise ValueError("expected exactly one of 'matrix' and 'position'")
        if self.matrix is not None and (self.rotation is not None or self.rpy is not None):
            raise ValueError("'matrix' already holds the rotation: leave out rotation and rpy")
        if self.rotation is not None and self.rpy is not None:
            raise ValueError("expected at most one of 'rotation' and 'rpy'")
        for rows, heights, width in ((self.matrix, (3, 4), 4), (self.rotation, (3,), 3)):
            if rows is not None and (len(rows) not in heights or any(len(row) != width for row in rows)):
                raise ValueError(f"expected {' or '.join(map(str, heights))} rows of {width} numbers")
        if self.status == "wrong" and not self.reason:
            raise ValueError("status = 'wrong' needs a reason")
        return self


@dataclass(frozen=True, kw_only=True)
class Published:
    """A claim in radians and metres.

    Attributes:
        dh: label of the DH frame.
        relative_to: label of the DH frame in which the placement is given.
        position: (3,) [m].
        rotation: (3, 3); None if only a position is claimed.
        tolerance: largest error of any entry of the position [m].
        rotation_tolerance: largest error of any entry of the rotation [1].
        provenance: where it is published.
        status: whether the claim is known to hold.
        reason: why a wrong one is wrong.
    """

    dh: str
    relative_to: str
    position: se3.Array
    rotation: se3.Array | None
    tolerance: float
    rotation_tolerance: float
    provenance: str
    status: Literal["holds", "wrong"]
    reason: str

    @classmethod
    def from_entry(cls, entry: PublishedEntry, unit: Literal["rad", "deg"]) -> Published:
        """Convert from the file's unit.

        A matrix need not hold a rotation: a wrong claim is kept as it was printed.

        Args:
            entry: the claim as written.
            unit: unit of the configuration's angles, and so of `entry.rpy`.
        """
        rotation = None if entry.rotation is None else np.array(entry.rotation)
        if entry.matrix is not None:
            matrix = np.array(entry.matrix)
            position, rotation = matrix[:3, 3], matrix[:3, :3]
        else:
            position = np.array(entry.position)
        if entry.rpy is not None:
            rpy = [math.radians(x) for x in entry.rpy] if unit == "deg" else entry.rpy
            rotation = se3.from_xyz_rpy((0.0, 0.0, 0.0), rpy)[:3, :3]
        return cls(
            dh=str(entry.dh),
            relative_to=str(entry.relative_to),
            position=position,
            rotation=rotation,
            tolerance=entry.tolerance,
            rotation_tolerance=entry.rotation_tolerance or entry.tolerance,
            provenance=entry.provenance,
            status=entry.status,
            reason=entry.reason,
        )
