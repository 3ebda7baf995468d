"""The in-house forward kinematics as one function, for whoever has a table and joint values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from harness.description.dh import DHTable
from harness.engines.dh_numpy import DHNumpy
from harness.errors import InputError
from harness.se3 import Array


def forward_kinematics(table: DHTable, q: ArrayLike, frames: Sequence[str] | None = None) -> Array:
    """Placements of a DH table, in its base frame.

    table: the DH table.
    q: joint values (n,) or (N, n), in the order of `table.joints` [rad or m].
    frames: labels out of `table.frames`; None: the tool frame alone.

    Returns (4, 4) or (N, 4, 4) for the tool frame, (F, 4, 4) or (N, F, 4, 4) for named frames [m].
    Raises InputError for a `q` of another shape, or a frame that the table does not have.
    """
    if not isinstance(table, DHTable):
        raise InputError(f"expected a DHTable, got {type(table).__name__}", hint="harness.load_model(...).table is one")
    n, values = len(table.joints), _joint_values(q)
    if values.ndim not in (1, 2) or values.shape[-1] != n:
        raise InputError(f"expected q of shape ({n},) or (N, {n}), for the joints {', '.join(table.joints)}; got {values.shape}")
    if frames is not None and (isinstance(frames, str) or not isinstance(frames, Sequence)):
        raise InputError(f"expected a sequence of labels such as ['tool'], got {frames!r}", key="frames")
    for frame in frames or ():
        if frame not in table.frames:
            raise InputError(f"no DH frame {frame!r}", hint=f"one of {', '.join(table.frames)}")
    placed = DHNumpy(table).placements(np.atleast_2d(values), tuple(frames) if frames is not None else ("tool",))
    placed = placed if frames is not None else placed[:, 0]
    return placed[0] if values.ndim == 1 else placed


def _joint_values(q: ArrayLike) -> Array:
    """q as float64. Raises InputError for what is no array of finite real numbers."""
    try:
        values = np.asarray(q)
        values = values if values.dtype.kind == "c" else values.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"expected joint values as numbers, got {type(q).__name__}", key="q") from None
    if values.dtype.kind == "c":
        raise InputError("expected real joint values, got complex ones", key="q")
    if not np.isfinite(values).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise InputError(f"expected finite joint values, got {values[where]} at {list(where)}", key="q")
    return values
