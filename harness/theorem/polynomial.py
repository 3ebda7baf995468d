"""A placement as a trigonometric polynomial with ball coefficients, multiplied out step by step.

    T(q) = C_0 + 2 Re sum_k C_k exp(i k.q),   k over half of all frequencies: T is real, so C_-k is the conjugate of C_k
A turn about z by k.q multiplies by P_0 + exp(ik.q) P + exp(-ik.q) conj(P). A slide by s q_j adds to the origin a term that is
linear in q_j; such terms never multiply each other. docs/theory.md has the derivation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import flint

from harness.theorem.balls import Ball, Matrix, aligned, ball, identity
from harness.theorem.chain import Step

# Frequencies of the joints as whole numbers of `1 / scale`, then the joint that the term is linear in, or -1.
Key: TypeAlias = tuple[int, ...]
Terms: TypeAlias = "dict[Key, list[Ball]]"

_HALF = flint.arb(1) / 2
# [Re C | Im C] times these gives the coefficients at k, k + f and k - f: columns x, y, z of C.
#   at k: (0, 0, z);   at k + f: ((x - iy)/2, i(x - iy)/2, 0);   at k - f: ((x + iy)/2, -i(x + iy)/2, 0)
_STEP = flint.arb_mat(6, 18)
for _row, _column, _value in (
    (2, 2, 1), (5, 5, 1),
    (0, 6, _HALF), (4, 6, _HALF), (3, 9, _HALF), (1, 9, -_HALF), (3, 7, -_HALF), (1, 7, _HALF), (0, 10, _HALF), (4, 10, _HALF),
    (0, 12, _HALF), (4, 12, -_HALF), (3, 15, _HALF), (1, 15, _HALF), (3, 13, _HALF), (1, 13, _HALF), (0, 16, -_HALF),
    (4, 16, _HALF),
):  # fmt: skip
    _STEP[_row, _column] = _value


@dataclass(kw_only=True)
class Polynomial:
    """A placement, as far as it has been multiplied out.

    Attributes:
        scales: for each joint the common denominator of its frequencies.
        keys: frequencies of the rotation's terms; the first one that is not zero is positive.
        R: their coefficients, three rows each: (3 K, 6), real parts of three columns, then imaginary parts.
        p: the origin's terms, six numbers each: real parts, imaginary parts.
        pending: a constant transform that is still to be multiplied.
    """

    scales: tuple[int, ...]
    keys: list[Key]
    R: Matrix
    p: Terms = field(default_factory=dict)
    pending: Matrix = field(default_factory=identity)

    @classmethod
    def one(cls, scales: tuple[int, ...]) -> Polynomial:
        """The identity."""
        R = flint.arb_mat(3, 6, [int(r == c) for r in range(3) for c in range(6)])
        return cls(scales=scales, keys=[(0,) * len(scales)], R=R)

    def copy(self) -> Polynomial:
        """Another one, to go on with along another branch."""
        p = {key: list(values) for key, values in self.p.items()}
        pending = flint.arb_mat(self.pending)
        return Polynomial(scales=self.scales, keys=list(self.keys), R=self.R, p=p, pending=pending)

    def then(self, step: Step) -> None:
        """Multiply by one more step from the right."""
        if not step.moves:
            self.pending = self.pending * step.constant
            return
        step = step.upright()
        A = aligned(step.axis)
        self.pending = self.pending * step.constant * A
        if step.turns:
            self._turn(tuple(int(x * s) for x, s in zip(step.row, self.scales, strict=True)))
        else:
            self._move()
            for j, factor in enumerate(step.row):
                if factor:
                    self._slide(j, ball(factor))
        self.pending = self.pending * A.transpose()

    def _rotation(self) -> Matrix:
        """The pending rotation for real and imaginary parts alike, (6, 6)."""
        W = flint.arb_mat(6, 6)
        for i in range(3):
            for j in range(3):
                W[i, j] = W[i + 3, j + 3] = self.pending[i, j]
        return W

    def _add(self, column: list[Ball], slide: int) -> None:
        """Add R times a column to the origin: its six numbers a term are rows of (3 K, 2)."""
        for i, key in enumerate(self.keys):
            block = column[6 * i : 6 * i + 6]
            values = [block[0], block[2], block[4], block[1], block[3], block[5]]
            full = (*key, slide)
            mine = self.p.get(full)
            self.p[full] = values if mine is None else [a + b for a, b in zip(mine, values, strict=True)]

    def _times(self, vector: list[Ball]) -> list[Ball]:
        """R times a vector, a term after the other: real and imaginary part of x, y, z."""
        W = flint.arb_mat(6, 2)
        for i in range(3):
            W[i, 0] = W[i + 3, 1] = vector[i]
        return list((self.R * W).entries())

    def _move(self) -> None:
        """Add the pending translation to the origin, and take it out of what is pending."""
        t = [self.pending[i, 3] for i in range(3)]
        if not all(x == 0 for x in t):  # a ball around zero is not zero
            self._add(self._times(t), -1)
        for i in range(3):
            self.pending[i, 3] = 0

    def _slide(self, joint: int, factor: Ball) -> None:
        """Add a move along the pending z axis, by factor times the joint's value."""
        self._add(self._times([self.pending[i, 2] * factor for i in range(3)]), joint)

    def _turn(self, f: Key) -> None:
        """Multiply by the pending transform, then by a turn about z with these frequencies."""
        self._move()
        entries = (self.R * (self._rotation() * _STEP)).entries()
        zero, groups = (0,) * len(f), {}  # type: tuple[Key, dict[Key, list[Ball]]]
        for i, key in enumerate(self.keys):
            rows = [entries[18 * (3 * i + r) : 18 * (3 * i + r) + 18] for r in range(3)]
            for part, sign in ((0, 0), (6, 1), (12, -1)):
                if key == zero and sign < 0:
                    continue  # the conjugate of the one before
                new = tuple(a + sign * b for a, b in zip(key, f, strict=True)) if sign else key
                values = [x for row in rows for x in row[part : part + 6]]
                _collect(groups, new, values, both=key != zero)
        self.keys = list(groups)
        self.R = flint.arb_mat(3 * len(self.keys), 6, [x for values in groups.values() for x in values])
        self.pending = identity()

    def finished(self) -> tuple[Terms, Terms]:
        """The terms of the rotation, eighteen numbers each (rows x, y, z: real parts, imaginary parts), and of the origin."""
        self._move()
        entries = (self.R * self._rotation()).entries()
        return {(*key, -1): entries[18 * i : 18 * i + 18] for i, key in enumerate(self.keys)}, self.p


def _collect(groups: dict[Key, list[Ball]], key: Key, values: list[Ball], both: bool) -> None:
    """Add a coefficient to its group; to that of its conjugate if the first frequency is negative.

    both: whether the term comes with its conjugate, so that two of them meet at frequency zero.
    """
    leading = next((x for x in key if x), 0)
    if leading < 0:
        key = tuple(-x for x in key)
        values = [-x if i % 6 > 2 else x for i, x in enumerate(values)]
    elif leading == 0 and both:
        values = [2 * x if i % 6 < 3 else flint.arb(0) for i, x in enumerate(values)]
    mine = groups.get(key)
    groups[key] = values if mine is None else [a + b for a, b in zip(mine, values, strict=True)]


def subtract(a: Mapping[Key, list[Ball]], b: Mapping[Key, list[Ball]]) -> Terms:
    """The difference of two sets of terms."""
    out = dict(a)
    for key, values in b.items():
        mine = out.get(key)
        out[key] = [-x for x in values] if mine is None else [x - y for x, y in zip(mine, values, strict=True)]
    return out
