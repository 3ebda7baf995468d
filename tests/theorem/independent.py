"""Forward kinematics by mpmath, which shares no line with the harness: numbers of 50 digits, and intervals."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.se3 import Array

mpmath.mp.dps = 50
mpmath.iv.dps = 50

Number = Any


def placement(table: DHTable, q: Array, context: Any) -> Any:
    """T_0_n (4, 4) of a table without base and tool. `context`: mpmath.mp or mpmath.iv. Decimals are read as decimals."""
    T, joint = context.eye(4), 0
    for row in table.rows:
        moved = context.mpf(0)
        if row.kind != "fixed":
            moved, joint = context.mpf(repr(float(q[joint]))), joint + 1
        theta = context.mpf(repr(row.theta)) + (moved if row.kind == "revolute" else 0)
        d = context.mpf(repr(row.d)) + (moved if row.kind == "prismatic" else 0)
        T = T * _row(row, theta, d, table.convention, context)
    return T


def _row(row: DHRow, theta: Number, d: Number, convention: str, context: Any) -> Any:
    alpha, a = context.mpf(repr(row.alpha)), context.mpf(repr(row.a))
    ct, st, ca, sa = context.cos(theta), context.sin(theta), context.cos(alpha), context.sin(alpha)
    if convention == "standard":
        rows = [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    else:
        rows = [[ct, -st, 0, a], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
    return context.matrix(rows)


def position_at_least(a: DHTable, b: DHTable, q: Array) -> float:
    """A lower bound on the distance [m] of both origins at q (n,), q read as decimals, by interval arithmetic."""
    D = placement(a, q, mpmath.iv) - placement(b, q, mpmath.iv)
    return float(_low([D[i, 3] for i in range(3)]))


def chord_at_least(a: DHTable, b: DHTable, q: Array) -> float:
    """A lower bound on the Frobenius norm of both rotations' difference at q (n,), by interval arithmetic."""
    D = placement(a, q, mpmath.iv) - placement(b, q, mpmath.iv)
    return float(_low([D[i, j] for i in range(3) for j in range(3)]))


def found(a: DHTable, b: DHTable, q: Array) -> tuple[float, float]:
    """Distance [m] and chord at q (n,), computed with 50 digits."""
    D = placement(a, q, mpmath.mp) - placement(b, q, mpmath.mp)
    position = mpmath.sqrt(sum(D[i, 3] ** 2 for i in range(3)))
    chord = mpmath.sqrt(sum(D[i, j] ** 2 for i in range(3) for j in range(3)))
    return float(position), float(chord)


def _low(values: list[Any]) -> Any:
    """The lower end of an interval vector's norm."""
    lows = [max(v.a, -v.b, 0) for v in values]
    return mpmath.sqrt(sum(mpmath.mpf(v) ** 2 for v in lows)) * (1 - mpmath.mpf(10) ** -40)


def random_table(rng: np.random.Generator, joints: int) -> DHTable:
    """A random chain, a quarter of its joints sliding, in either convention."""
    kinds = np.where(rng.random(joints) < 0.25, "prismatic", "revolute")
    rows = tuple(
        DHRow.of(f"j{i}", str(kind), rng.normal(size=4) * [0.4, 1.5, 0.4, 1.5])  # type: ignore[arg-type]
        for i, kind in enumerate(kinds)
    )
    return DHTable(rows, "standard" if rng.random() < 0.5 else "modified")


def perturbed(table: DHTable, rng: np.random.Generator, size: float) -> DHTable:
    """The table with about a third of its numbers changed by about `size`."""
    change = rng.normal(size=(len(table.rows), 4)) * (rng.random((len(table.rows), 4)) < 0.3) * size
    rows = tuple(
        DHRow.of(r.name, r.kind, np.array([r.a, r.alpha, r.d, r.theta]) + c) for r, c in zip(table.rows, change, strict=True)
    )
    return DHTable(rows, table.convention)
