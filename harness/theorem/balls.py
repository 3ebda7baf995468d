"""Exact numbers as balls, midpoint and radius, which enclose every rounding (F. Johansson, "Arb", IEEE Trans. Comput. 2017)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import TypeAlias

import flint
import numpy as np

from harness.description.written import Exact, length_of
from harness.se3 import Array

Ball: TypeAlias = "flint.arb"
Matrix: TypeAlias = "flint.arb_mat"
Axis: TypeAlias = tuple[Fraction, Fraction, Fraction]

PRECISION = 128  # bits: a chain of kilometres is enclosed to 1e-30 m

X: Axis = (Fraction(1), Fraction(0), Fraction(0))
Y: Axis = (Fraction(0), Fraction(1), Fraction(0))
Z: Axis = (Fraction(0), Fraction(0), Fraction(1))
_ONTO = {0: ((0, 0, 1), (1, 0, 0), (0, 1, 0)), 1: ((0, 1, 0), (0, 0, 1), (1, 0, 0)), 2: ((1, 0, 0), (0, 1, 0), (0, 0, 1))}


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Compute with so many bits inside the block."""
    before = flint.ctx.prec
    flint.ctx.prec = bits
    try:
        yield
    finally:
        flint.ctx.prec = before


def ball(x: Fraction | int) -> Ball:
    """A rational number as a ball."""
    return flint.arb(flint.fmpq(x.numerator, x.denominator))


def number(x: Exact) -> Ball:
    """A number as a ball."""
    return ball(x.rational) + ball(x.of_pi) * flint.arb.pi() if x.of_pi else ball(x.rational)


def sincos(angle: Exact) -> tuple[Ball, Ball]:
    """Sine and cosine; exact at right angles that are written as multiples of pi."""
    if not angle.rational:
        sine, cosine = flint.arb.sin_cos_pi_fmpq(flint.fmpq(angle.of_pi.numerator, angle.of_pi.denominator))
        return sine, cosine
    sine, cosine = number(angle).sin_cos()
    return sine, cosine


def rigid(R: list[list[Ball]], p: list[Ball]) -> Matrix:
    """The transform (4, 4) of a rotation (3, 3) and an origin (3,)."""
    return flint.arb_mat([[*row, x] for row, x in zip(R, p, strict=True)] + [[0, 0, 0, 1]])


def identity() -> Matrix:
    """The transform that changes nothing."""
    return flint.arb_mat(4, 4, [int(i % 5 == 0) for i in range(16)])


def inverse(T: Matrix) -> Matrix:
    """Of a rigid transform: R', -R' p."""
    R = [[T[j, i] for j in range(3)] for i in range(3)]
    return rigid(R, [-sum((R[i][k] * T[k, 3] for k in range(3)), flint.arb(0)) for i in range(3)])


def direction(axis: Axis) -> tuple[int, int]:
    """Which of x, y, z an axis is along, 0 to 2, and its sign; (-1, 1) if it is oblique, or zero."""
    along = [k for k in range(3) if axis[k]]
    return (along[0], 1 if axis[along[0]] > 0 else -1) if len(along) == 1 else (-1, 1)


def unit(axis: Axis) -> list[Ball]:
    """The axis with length one; z if it is zero, as a joint that has no direction cannot be told."""
    squared = sum(x * x for x in axis)
    if not squared:
        return [flint.arb(0), flint.arb(0), flint.arb(1)]
    length = ball(Fraction(squared)).sqrt()
    return [ball(x) / length for x in axis]


def onto(axis: Axis) -> list[list[Ball]]:
    """A rotation (3, 3) that takes z onto an axis, whatever its length; exact along +x, +y, +z."""
    along, sign = direction(axis)
    if along >= 0 and sign > 0:
        return [[flint.arb(x) for x in row] for row in _ONTO[along]]
    z = unit(axis)
    k = min(range(3), key=lambda i: abs(axis[i]))
    e = [flint.arb(int(i == k)) for i in range(3)]
    y = _cross(e, z)
    size = sum((v * v for v in y), flint.arb(0)).sqrt()
    y = [v / size for v in y]
    x = _cross(y, z)
    return [[x[i], y[i], z[i]] for i in range(3)]


def aligned(axis: Axis) -> Matrix:
    """The same as a transform (4, 4) that moves nothing."""
    return rigid(onto(axis), [flint.arb(0)] * 3)


def turned(axis: Axis, angle: Exact) -> Matrix:
    """The rotation (4, 4) by an angle about an axis of any length."""
    s, c = sincos(angle)
    zero, one = flint.arb(0), flint.arb(1)
    about_z = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    A = flint.arb_mat(onto(axis))
    turned = A * flint.arb_mat(about_z) * A.transpose()
    return rigid(turned.table(), [flint.arb(0)] * 3)


def moved(axis: Axis, distance: Exact) -> Matrix:
    """The translation (4, 4) by a distance along an axis of any length."""
    d = number(distance)
    return rigid([[flint.arb(int(i == j)) for j in range(3)] for i in range(3)], [d * u for u in unit(axis)])


def of_array(T: Array) -> Matrix:
    """A constant transform (4, 4) in float64.

    A matrix of zeros and ones is itself. Any other rotation is the exact one of its quaternion, 1e-16 away: no matrix of
    float64 is a rotation. Lengths are their shortest decimals.
    """
    R = T[:3, :3]
    rotation = [[flint.arb(float(x)) for x in row] for row in R]
    if not np.isin(R, (-1.0, 0.0, 1.0)).all():
        rotation = _of_quaternion(_quaternion(R))
    return rigid(rotation, [number(length_of(float(x))) for x in T[:3, 3]])


def _quaternion(R: Array) -> list[Ball]:
    """w, x, y, z of a rotation, up to a factor: the eigenvector of the largest eigenvalue, from the symmetric form."""
    K = np.array(
        [
            [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [0, R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
            [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
            [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    _, vectors = np.linalg.eigh(K, UPLO="U")
    return [flint.arb(float(x)) for x in vectors[:, -1]]


def _of_quaternion(q: list[Ball]) -> list[list[Ball]]:
    w, x, y, z = q
    n = w * w + x * x + y * y + z * z
    return [
        [1 - 2 * (y * y + z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n],
        [2 * (x * y + w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - w * x) / n],
        [2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, 1 - 2 * (x * x + y * y) / n],
    ]


def _cross(a: list[Ball], b: list[Ball]) -> list[Ball]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
