"""Two chains side by side, joint by joint, by constants alone: how far they part at each joint.

If A = ... E M(q) C ... and B = ... M(q) D ..., and the constant E commutes with M, then A = ... M(q) E C ...: the deviation E
moves past the joint and becomes D^-1 E C. What does not commute is left behind as a residual. So
    |A - B| <= sum of the residuals, each carried by the reach of what follows, + the deviation at the end.
No polynomial is multiplied out: n joints cost n products, and a deviation that never stops commuting is a constant, exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import flint

from harness.se3 import Array
from harness.theorem.balls import Ball, Matrix, identity, inverse, rigid
from harness.theorem.normal import Line, Motion


@dataclass(frozen=True)
class Residual:
    """What did not commute with one joint: position [m], and the rotation's Frobenius norm. Upper bounds.

    entries: the twelve numbers behind them.
    """

    position: float
    chord: float
    entries: tuple[Ball, ...]


@dataclass(frozen=True)
class Deviation:
    """Two chains up to a joint, or up to the end.

    Attributes:
        residuals: one for each joint that the deviation has moved past.
        E: what is left, (4, 4): A = B E, but for the residuals.
    """

    residuals: tuple[Residual, ...]
    E: Matrix


class Gauge:
    """Deviations of two descriptions; what frames share is computed once."""

    def __init__(self) -> None:
        self._known: dict[tuple[Motion, Motion], Deviation] = {}

    def before(self, a: Motion, b: Motion) -> Deviation | None:
        """The deviation just before a joint of both chains; None if the joints before it are not the same, in this order."""
        trail = [(a, b)]
        while trail[-1] not in self._known and trail[-1][0].parent is not None and trail[-1][1].parent is not None:
            trail.append((trail[-1][0].parent, trail[-1][1].parent))
        for one, other in reversed(trail):
            if (one, other) not in self._known:
                known = self._one(one, other)
                if known is None:
                    return None
                self._known[one, other] = known
        return self._known[a, b]

    def _one(self, a: Motion, b: Motion) -> Deviation | None:
        if a.parent is None or b.parent is None:
            return None if a.parent is not b.parent else Deviation((), inverse(b.before) * a.before)
        past = passed(self._known[a.parent, b.parent], a.parent, b.parent)
        return past and Deviation(past.residuals, inverse(b.before) * past.E * a.before)

    def at_end(self, a: Line, b: Line) -> Deviation | None:
        """The deviation at the end of two lines; None if their joints are not the same, in the same order."""
        if len(a.motions) != len(b.motions):
            return None
        past: Deviation | None = Deviation((), identity())
        if a.motions:
            last = self.before(a.motions[-1], b.motions[-1])
            past = last and passed(last, a.motions[-1], b.motions[-1])
        return past and Deviation(past.residuals, inverse(b.tail) * past.E * a.tail)


def passed(at: Deviation, a: Motion, b: Motion) -> Deviation | None:
    """The deviation moved past a joint. None if the joint is not the same in both, or nothing near commutes with it."""
    if (a.turns, a.row) != (b.turns, b.row):
        return None
    E = at.E
    c, s = E[0, 0] + E[1, 1], E[1, 0] - E[0, 1]
    size = (c * c + s * s).sqrt()
    if not size > 1:  # about as far from a turn about z as can be
        return None
    c, s = c / size, s / size
    R = [[c, -s, flint.arb(0)], [s, c, flint.arb(0)], [flint.arb(0), flint.arb(0), flint.arb(1)]]
    p = [flint.arb(0), flint.arb(0), E[2, 3]] if a.turns else [E[i, 3] for i in range(3)]
    turn = [E[i, j] - R[i][j] for i in range(3) for j in range(3)]
    shift = [E[i, 3] - p[i] for i in range(3)]
    return Deviation((*at.residuals, Residual(norm(shift), norm(turn), (*shift, *turn))), rigid(R, p))


def norm(values: Sequence[Ball]) -> float:
    """Euclidean norm, rounded up."""
    if all(x == 0 for x in values):
        return 0.0
    tops = [x.abs_upper() for x in values]  # the square of a ball around zero has a negative part
    top = sum((x * x for x in tops), flint.arb(0)).sqrt().abs_upper()
    return math.nextafter(float(top) * (1.0 + 2.0**-50), math.inf)


def size_of(E: Matrix) -> tuple[float, float]:
    """How far a constant deviation is from none: position [m], Frobenius norm of the rotation. Upper bounds."""
    position = norm([E[i, 3] for i in range(3)])
    chord = norm([E[i, j] - int(i == j) for i in range(3) for j in range(3)])
    return position, chord


def reaches(line: Line, ranges: Array) -> list[float]:
    """For each joint of a line the longest distance from it to the line's end, at any configuration [m]. Upper bounds."""
    lengths = [norm([m.before[i, 3] for i in range(3)]) for m in line.motions[1:]]
    lengths.append(norm([line.tail[i, 3] for i in range(3)]))
    if not line.motions:
        return []
    out, total = [], 0.0
    for motion, length in zip(reversed(line.motions), reversed(lengths), strict=True):
        total += length
        if not motion.turns:
            total += sum(abs(float(x)) * float(abs(ranges[j]).max()) for j, x in enumerate(motion.row) if x) * (1 + 1e-15)
        total = math.nextafter(total, math.inf)
        out.append(total)
    return out[::-1]


def carried(deviation: Deviation, reach: Sequence[float]) -> tuple[float, float]:
    """What all residuals together move the end by: position [m], chord.

    A rotation's difference moves a point at distance r by its spectral norm times r, which is the Frobenius norm over sqrt 2.
    """
    position = sum(r.position + r.chord / math.sqrt(2.0) * length for r, length in zip(deviation.residuals, reach, strict=False))
    chord = sum(r.chord for r in deviation.residuals)
    return position * (1.0 + 1e-12), chord * (1.0 + 1e-12)
