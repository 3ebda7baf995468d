"""What describes a mechanism when base, tool, joint signs and zero offsets are free: the numbers between neighbouring axes.

From canonical DH parameters: a and alpha of each pair of axes, d of each axis between two others. Turning axis i round adds pi
to the twists beside it and negates d_i; turning a common normal round negates its a and alpha. Of two mechanisms the axes and
normals are turned so that the largest difference is smallest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from harness.description.dh import DHRow

STRAIGHT = 1e-6


@dataclass(frozen=True, kw_only=True)
class ParameterDifference:
    """One number of two mechanisms.

    joint: the joint it belongs to, or `one to other` for a number between two joints.
    name: which number, `a`, `alpha` or `d`.
    unit: `m` or `rad`.
    a, b: both values, in that unit.
    """

    joint: str
    name: str
    unit: str
    a: float
    b: float

    @property
    def size(self) -> float:
        """How far apart they are, angles modulo a turn."""
        return abs(_wrapped(self.a - self.b)) if self.unit == "rad" else abs(self.a - self.b)


@dataclass(frozen=True)
class Matching:
    """How two mechanisms are brought to differ least.

    signs: +1 or -1 for each joint: whether its axis is turned round.
    normals: +1 or -1 for each pair of neighbours: whether their common normal is turned round.
    differences: of every number that base, tool, signs and zero offsets do not change.
    """

    signs: tuple[int, ...]
    normals: tuple[int, ...]
    differences: tuple[ParameterDifference, ...]

    @property
    def largest(self) -> ParameterDifference | None:
        """The largest difference, a metre counted as a radian. None if there is no number to compare (one joint)."""
        return max(self.differences, key=lambda d: d.size, default=None)


def match(a: Sequence[DHRow], b: Sequence[DHRow]) -> Matching:
    """Choose joint signs and normals of b so that its largest difference from a is smallest.

    a, b: standard canonical rows. Both have the same kinds of joints in the same order.
    """
    best: dict[int, tuple[tuple[float, float, int], tuple[int, ...], tuple[int, ...], tuple[ParameterDifference, ...]]] = {
        1: ((0.0, 0.0, 0), (1,), (), ()),
        -1: ((0.0, 0.0, 1), (-1,), (), ()),
    }
    free = _free(a)
    for i in range(len(a) - 1):
        following = {}
        for sign in (1, -1):
            options = []
            for previous, (cost, signs, normals, differences) in best.items():
                normal, link = _link(a[i], b[i], previous != sign, f"{a[i].name} to {a[i + 1].name}")
                added = (
                    link
                    if i + 1 in free
                    else (*link, ParameterDifference(joint=a[i + 1].name, name="d", unit="m", a=a[i + 1].d, b=sign * b[i + 1].d))
                )
                worst = max(cost[0], *(d.size for d in added))
                total = (worst, cost[1] + sum(d.size for d in added), cost[2] + (sign < 0))
                options.append((_rounded(total), (*signs, sign), (*normals, normal), (*differences, *added)))
            following[sign] = min(options, key=lambda option: option[0])
        best = following
    _, signs, normals, differences = min(best.values(), key=lambda option: option[0])
    return Matching(signs, normals, differences)


def _rounded(cost: tuple[float, float, int]) -> tuple[float, float, int]:
    """Costs that differ by rounding alone are equal, so that fewer signs decide."""
    return round(cost[0], 9), round(cost[1], 9), cost[2]


def _link(a: DHRow, b: DHRow, opposite: bool, between: str) -> tuple[int, tuple[ParameterDifference, ...]]:
    """The sign of one common normal, and the differences of a and alpha that it leaves.

    a, b: the rows that end at the normal.
    opposite: whether just one of the two neighbouring axes of b is turned round.
    between: names of both joints.
    """
    twist = b.alpha + (math.pi if opposite else 0.0)
    options = []
    for normal in (1, -1):
        differences = (
            ParameterDifference(joint=between, name="a", unit="m", a=a.a, b=normal * b.a),
            ParameterDifference(joint=between, name="alpha", unit="rad", a=a.alpha, b=_near(normal * twist, a.alpha)),
        )
        options.append((round(max(d.size for d in differences), 9), -normal, normal, differences))
    _, _, normal, differences = min(options, key=lambda option: option[:2])
    return normal, differences


def _free(rows: Sequence[DHRow]) -> set[int]:
    """Indices of rows whose d is no property of the mechanism: the last, a prismatic one, and the end of parallel axes from the
    first on, which only the base fixes."""
    free = {0, len(rows) - 1} | {i for i, row in enumerate(rows) if row.kind == "prismatic"}
    end = 0
    while end < len(rows) - 1 and abs(math.sin(rows[end].alpha)) < STRAIGHT:
        end += 1
    return free | {end}


def zero_offsets(a: Sequence[DHRow], b: Sequence[DHRow], matching: Matching) -> list[float]:
    """What to add to theta of each row of a (to d of a prismatic one) so that q_a = sign q_b, (n,) [rad or m].

    a, b: standard canonical rows.
    matching: of b to a.
    The first and the last are 0: base and tool take them.
    """
    offsets = [0.0] * len(a)
    for i in range(1, len(a) - 1):
        sign = matching.signs[i]
        if a[i].kind == "prismatic":
            offsets[i] = sign * b[i].d - a[i].d
            continue
        turn = math.pi if matching.normals[i - 1] != matching.normals[i] else 0.0
        offsets[i] = _wrapped(sign * b[i].theta + turn - a[i].theta)
    return offsets


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _near(angle: float, other: float) -> float:
    """The same angle, within half a turn of another."""
    return other + _wrapped(angle - other)
