"""What both KDL sources share: where PyKDL comes from, its version, and reading its frames."""

from __future__ import annotations

from itertools import product
from typing import Any, ClassVar

import numpy as np

from harness.engines.base import Engine
from harness.se3 import Array

CELLS = tuple(product(range(3), range(4)))


class KdlEngine(Engine):
    """Forward kinematics by PyKDL, which Debian has for the system's own Python. Subclasses set `_kdl`, the module."""

    debian: ClassVar[tuple[str, ...]] = ("python3-pykdl", "python3-numpy")
    imports: ClassVar[tuple[str, ...]] = ("PyKDL", "numpy")
    _kdl: Any

    def installed(self) -> dict[str, str]:
        """Version of PyKDL, which is no distribution of pip's."""
        return {"PyKDL": str(self._kdl.__version__)}


def cells(frame: Any) -> list[float]:
    """The upper three rows of a `PyKDL.Frame`, rows first."""
    return list(map(frame.__getitem__, CELLS))


def placements(values: list[float], count: int, frames: int) -> Array:
    """The cells of `count` times `frames` frames as (count, frames, 4, 4)."""
    out = np.zeros((count, frames, 4, 4))
    out[..., :3, :] = np.reshape(values, (count, frames, 3, 4))
    out[..., 3, 3] = 1.0
    return out
