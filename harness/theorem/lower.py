"""Discrepancies at one configuration in ball arithmetic: what is found there is there, without any rounding to allow for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import flint

from harness.se3 import Array
from harness.theorem.balls import Ball, Matrix, ball, identity
from harness.theorem.normal import Line, Motion


class Seen(NamedTuple):
    """A discrepancy at one configuration: position [m], Frobenius norm of the rotation's difference. Lower bounds."""

    position: float
    chord: float


class At:
    """Placements at one configuration q (n,) [rad or m], read as the exact numbers that its float64 are."""

    def __init__(self, q: Array) -> None:
        self.q = q
        self._exact = [flint.arb(float(x)) for x in q]
        self._known: dict[Motion, Matrix] = {}

    def placement(self, line: Line) -> Matrix:
        """The placement (4, 4) at the end of a line."""
        T = identity()
        for motion in line.motions:
            if motion not in self._known:
                self._known[motion] = T * motion.before * self._motion(motion)
            T = self._known[motion]
        return T * line.tail

    def _motion(self, motion: Motion) -> Matrix:
        terms = [ball(x) * q for x, q in zip(motion.row, self._exact, strict=True) if x]
        amount = sum(terms, flint.arb(0))
        T = identity()
        if motion.turns:
            s, c = amount.sin_cos()
            T[0, 0], T[0, 1], T[1, 0], T[1, 1] = c, -s, s, c
        else:
            T[2, 3] = amount
        return T

    def seen(self, a: Line, b: Line) -> Seen:
        """The discrepancy of two lines."""
        D = self.placement(a) - self.placement(b)
        return Seen(_least([D[i, 3] for i in range(3)]), _least([D[i, j] for i in range(3) for j in range(3)]))


def _least(values: Sequence[Ball]) -> float:
    """Euclidean norm, rounded down."""
    lows = [x.abs_lower() for x in values]
    low = float(sum((x * x for x in lows), flint.arb(0)).abs_lower())
    return max(0.0, math.sqrt(low) * (1.0 - 2.0**-50))
