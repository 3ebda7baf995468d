"""Configurations where an arm loses a direction of motion: the smallest singular value of its Jacobian is zero."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from harness.se3 import Array

Tip: TypeAlias = Callable[[Array], Array]  # q (N, n) -> placements (N, 4, 4) of the tip

STEP = 1e-5
STARTS, ROUNDS = 24, 60
SINGULAR = 1e-4
SHARE = 0.3


def jacobian(tip: Tip, q: Array, reach: float) -> Array:
    """Body Jacobian (N, 6, n) by central differences: lengths over `reach`, then angles, for joint rates [rad or m].

    Entry errors are about STEP^2. Dividing by the reach makes lengths and angles of one size (Angeles, "Fundamentals of
    Robotic Mechanical Systems", characteristic length).
    """
    columns = []
    for k in range(q.shape[1]):
        step = np.zeros(q.shape[1])
        step[k] = STEP
        T_a, T_b = tip(q - step), tip(q + step)
        R = np.swapaxes(T_a[:, :3, :3], 1, 2)
        moved = np.einsum("nij,nj->ni", R, T_b[:, :3, 3] - T_a[:, :3, 3]) / reach
        D = R @ T_b[:, :3, :3]
        rotated = 0.5 * np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], axis=1)
        columns.append(np.concatenate([moved, rotated], axis=1) / (2.0 * STEP))
    return np.stack(columns, axis=2)


def smallest(tip: Tip, q: Array, reach: float) -> Array:
    """Smallest singular value of the Jacobian (N,) at q (N, n)."""
    return np.asarray(np.linalg.svd(jacobian(tip, q, reach), compute_uv=False)[:, -1])


def singular(tip: Tip, starts: Array, lower: Array, upper: Array, reach: float, most: int = 3) -> list[tuple[Array, float]]:
    """Singular configurations within limits, of different kinds, and their smallest singular values.

    From the starts nearest to a singularity a compass search goes down. Two configurations are of one kind if the same joints
    cancel each other: those with a share above SHARE in the direction that moves nothing.
    tip: from q (N, n) to placements of the tip, (N, 4, 4).
    starts: configurations (N, n) [rad or m].
    lower, upper: joint limits (n,) [rad or m].
    reach: by which lengths are divided [m].
    most: how many are returned at most.
    """
    values = smallest(tip, starts, reach)
    by_kind: dict[tuple[bool, ...], tuple[Array, float]] = {}
    for index in np.argsort(values)[:STARTS]:
        q, value = _down(tip, starts[index], lower, upper, reach)
        if value > SINGULAR:
            continue
        null = np.linalg.svd(jacobian(tip, q[None, :], reach))[2][0, -1]
        kind = tuple(bool(x) for x in np.abs(null) > SHARE)
        if kind not in by_kind or value < by_kind[kind][1]:
            by_kind[kind] = (q, value)
    return sorted(by_kind.values(), key=lambda pair: pair[1])[:most]


def _down(tip: Tip, q: Array, lower: Array, upper: Array, reach: float) -> tuple[Array, float]:
    """Compass search: the best of one step of each joint either way, else half the step."""
    step, value = 0.2, float(smallest(tip, q[None, :], reach)[0])
    sides = np.concatenate([np.eye(len(q)), -np.eye(len(q))])
    for _ in range(ROUNDS):
        tried = np.clip(q + step * sides, lower, upper)
        values = smallest(tip, tried, reach)
        best = int(values.argmin())
        if values[best] < value:
            q, value = tried[best], float(values[best])
        else:
            step /= 2.0
    return q, value
