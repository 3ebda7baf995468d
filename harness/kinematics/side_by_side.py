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
from harness.kinematics.screws import chain_screws, step_configurations
from harness.se3 import Array

Unit = Literal["m", "rad"]
COLUMNS: tuple[tuple[str, Unit], ...] = (("a", "m"), ("alpha", "rad"), ("d", "m"), ("theta", "rad"))


def difference_of(b: float, a: float, unit: Unit) -> float:
    """b - a, in that unit; an angle within half a turn."""
    return b - a if unit == "m" else math.remainder(b - a, 2.0 * math.pi)


@dataclass(frozen=True)
class Side:
    """One canonical table.

    rows: its rows; empty if the chain has no such table.
    base, tool: transforms (4, 4) [m].
    problem: why there is no table.
    """

    rows: tuple[DHRow, ...]
    base: Array
    tool: Array
    problem: str = ""


def canonical_side(mechanism: Mechanism, convention: Convention, tip: str) -> Side:
    """The canonical table of a mechanism up to the frame `tip`, from n + 1 placements."""
    prismatic = list(mechanism.prismatic)
    screws = chain_screws(mechanism.placements(step_configurations(prismatic), (tip,))[:, 0], prismatic)
    try:
        form = canonical(screws, prismatic, convention, list(mechanism.joints))
    except ValueError as error:
        return Side((), np.eye(4), np.eye(4), str(error))
    return Side(form.rows, form.base, form.tool)


def with_matching_normals(a: Sequence[DHRow], b: Sequence[DHRow], convention: Convention) -> list[DHRow]:
    """b's rows with each common normal turned round where that is nearer to a's rows: another table of the same mechanism.

    Turning x_i round negates a and alpha along it, and shifts theta before and after it by half a turn.
    a, b: canonical rows of the same kinds of joints.
    convention: of both.
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
