"""Canonical DH tables of two mechanisms, made comparable row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from harness.description.dh import Convention, DHRow
from harness.kinematics.canonical import canonical
from harness.kinematics.mechanism import Mechanism
from harness.kinematics.screws import chain_screws, finite_steps
from harness.se3 import Array

Unit = Literal["m", "rad"]
COLUMNS: tuple[tuple[str, Unit], ...] = (("a", "m"), ("alpha", "rad"), ("d", "m"), ("theta", "rad"))


def less(b: float, a: float, unit: Unit) -> float:
    """b - a; an angle within half a turn."""
    return b - a if unit == "m" else math.remainder(b - a, 2.0 * math.pi)


@dataclass(frozen=True)
class Side:
    """One canonical table: rows, and base and tool transforms; empty if the chain has none, with the reason."""

    rows: tuple[DHRow, ...]
    base: Array
    tool: Array
    problem: str = ""


def canonical_side(mechanism: Mechanism, convention: Convention, tip: str) -> Side:
    """The canonical table of a mechanism up to the frame `tip`, from n + 1 placements."""
    n, prismatic = len(mechanism.joints), list(mechanism.prismatic)
    q = np.concatenate([np.zeros((1, n)), np.diag(finite_steps(prismatic))])
    screws = chain_screws(mechanism.placements(q, (tip,))[:, 0], prismatic)
    try:
        form = canonical(screws, prismatic, convention, list(mechanism.joints))
    except ValueError as error:
        return Side((), np.eye(4), np.eye(4), str(error))
    return Side(form.rows, form.base, form.tool)


def turned(a: Sequence[DHRow], b: Sequence[DHRow], convention: Convention) -> list[DHRow]:
    """b's rows with each common normal turned as a's, where that is nearer: another table of the same mechanism.

    Turning x_i negates a and alpha along it, and shifts theta before and after it by half a turn.
    """
    rows = list(b)
    for i in range(len(rows) - 1):
        along = i if convention == "standard" else i + 1
        one, other = a[along], rows[along]
        turns = [abs(one.a - other.a * s) + abs(math.remainder(one.alpha - other.alpha * s, 2.0 * math.pi)) for s in (1, -1)]
        if abs(turns[0] - turns[1]) < 1e-7:
            gaps = [abs(math.remainder(a[i].theta - rows[i].theta - half, 2.0 * math.pi)) for half in (0.0, math.pi)]
            turns = gaps if a[i].kind == "revolute" else [0.0, 1.0]
        if turns[1] < turns[0] - 1e-7:
            rows[along] = replace(other, a=-other.a, alpha=-other.alpha)
            rows[i] = replace(rows[i], theta=rows[i].theta + math.pi)
            rows[i + 1] = replace(rows[i + 1], theta=rows[i + 1].theta - math.pi)
    return rows
