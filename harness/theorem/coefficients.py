"""The coefficients of a difference as float64 with a bound on what that leaves out, and the bound that their sizes give.

    D(q) = C_0 + 2 Re sum_k C_k exp(i k.q)  =>  |D(q)| <= |C_0| + 2 sum_k sigma_k,
sigma_k the largest singular value of [Re C_k, Im C_k], since Re(C e^(ix)) = Re C cos x - Im C sin x. A term that is linear in a
joint counts times the largest value of that joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import flint
import numpy as np
from numpy.typing import NDArray

from harness.se3 import Array
from harness.theorem.balls import Ball
from harness.theorem.polynomial import Terms

# Sums of K positive terms, each of a few rounded operations, are right to (K + 50) u; this is far above it.
ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Coefficients:
    """A vector function of the joints, of dimension d.

    Attributes:
        frequencies: of each term (K, n), in units of 1 / scale; the first row is zero.
        linear: the joint that a term is linear in, (K,); -1 for none.
        real, imaginary: parts of each coefficient, (K, d).
        error: what all terms together may be off by, in norm: the radii of the balls and the rounding to float64.
        scales: common denominators of each joint's frequencies, (n,).
        ranges: lower and upper end of each joint that slides, (n, 2) [m]; whole turns have none.
    """

    frequencies: NDArray[np.int64]
    linear: NDArray[np.int64]
    real: Array
    imaginary: Array
    error: float
    scales: tuple[int, ...]
    ranges: Array

    def values(self, q: Array) -> Array:
        """The function at configurations (N, n) [rad or m]: (N, d). In plain float64."""
        phase = q @ (self.frequencies / np.array(self.scales)).T
        weight = np.where(self.frequencies.any(axis=1), 2.0, 1.0) * self._slides(q)
        return np.asarray((weight * np.cos(phase)) @ self.real - (weight * np.sin(phase)) @ self.imaginary)

    def along(self, q: Array, joint: int, values: Array) -> Array:
        """The function where one joint takes other values (V,) and all others stay at q (n,): (V, d)."""
        own = self.frequencies[:, joint]
        phase = np.exp(1j * ((self.frequencies / np.array(self.scales)) @ q - own / self.scales[joint] * q[joint]))
        slides = np.where(self.linear == joint, 1.0, self._slides(q[None])[0])
        weight = np.where(self.frequencies.any(axis=1), 2.0, 1.0) * slides
        terms = (weight * phase)[:, None] * (self.real + 1j * self.imaginary)
        out = np.zeros((len(values), terms.shape[1]))
        for linear in (False, True):
            for f in np.unique(own):
                chosen = (own == f) & ((self.linear == joint) == linear)
                if chosen.any():
                    wave = np.exp(1j * (f / self.scales[joint]) * values) * (values if linear else 1.0)
                    out += (wave[:, None] * terms[chosen].sum(axis=0)).real
        return out

    def _slides(self, q: Array) -> Array:
        joint = np.where(self.linear < 0, 0, self.linear)
        return np.asarray(np.where(self.linear < 0, 1.0, q[:, joint]))

    def sizes(self) -> Array:
        """Upper bound on each term, (K,)."""
        reach = np.abs(self.ranges).max(axis=1)
        return self._per_unit() * np.where(self.linear < 0, 1.0, reach[np.where(self.linear < 0, 0, self.linear)])

    def _per_unit(self) -> Array:
        """Upper bound on each term, of one that is linear in a joint for one metre or radian of it, (K,)."""
        # Squares of numbers below 1e-154 vanish in float64: a power of two is taken out before, and put back.
        top = max(np.abs(self.real).max(initial=0.0), np.abs(self.imaginary).max(initial=0.0))
        unit = 2.0 ** (math.frexp(float(top))[1]) if top > 0.0 else 1.0
        x, y = self.real / unit, self.imaginary / unit
        a, b, c = (x**2).sum(axis=1), (y**2).sum(axis=1), (x * y).sum(axis=1)
        sigma = unit * np.sqrt((a + b) / 2.0 + np.sqrt(((a - b) / 2.0) ** 2 + c**2))
        return np.asarray(np.where(self.frequencies.any(axis=1), 2.0, 1.0) * sigma)

    def bound(self) -> float:
        """Upper bound on the norm over every configuration."""
        sizes = self.sizes()
        # Terms a million million million times smaller than the largest may have vanished in the squares.
        vanished = 1e-150 * float(sizes.max()) * len(sizes)
        return float(sizes.sum()) * (1.0 + ROUNDING) + vanished + self.error

    def slope(self) -> float:
        """Upper bound on how fast the function changes with its slides, all together, per metre or radian."""
        return float(self._per_unit()[self.linear >= 0].sum()) * (1.0 + ROUNDING)

    def without(self, terms: NDArray[np.bool_]) -> Coefficients:
        """The function without some terms, whose sizes are added to the error."""
        left_out = float(self.sizes()[terms].sum()) * (1.0 + ROUNDING)
        keep = ~terms
        return Coefficients(
            frequencies=self.frequencies[keep],
            linear=self.linear[keep],
            real=self.real[keep],
            imaginary=self.imaginary[keep],
            error=self.error + left_out,
            scales=self.scales,
            ranges=self.ranges,
        )


def of_terms(terms: Terms, scales: Sequence[int], ranges: Array) -> Coefficients:
    """Ball coefficients as float64; what that loses goes into `error`.

    Args:
        terms: for each key the numbers of its coefficient: blocks of six, three real parts and three imaginary parts.
        scales: see `Coefficients`.
        ranges: see `Coefficients`.
    """
    terms = terms or {(0,) * len(scales) + (-1,): [flint.arb(0)] * 6}
    keys = sorted(terms, key=lambda k: (any(k[:-1]), k[-1] >= 0, k))
    entries = [x for key in keys for x in terms[key]]
    middle = np.array([float(x) for x in entries], dtype=np.float64).reshape(len(keys), -1, 2, 3)
    radius = np.array([_radius(x) for x in entries]).reshape(len(keys), -1)
    frequencies = np.array([key[:-1] for key in keys], dtype=np.int64).reshape(len(keys), len(scales))
    linear = np.array([key[-1] for key in keys], dtype=np.int64)
    reach = np.abs(ranges).max(axis=1)
    weight = np.where(linear < 0, 1.0, reach[np.where(linear < 0, 0, linear)])
    # The midpoint's own rounding is within 2^-52 of it, or below the smallest float64; what is exactly zero has none.
    size = np.abs(middle).reshape(len(keys), -1)
    lost = radius + size * 2.0**-52 + np.where(size + radius > 0.0, 1e-300, 0.0)
    error = 2.0 * float((weight * lost.sum(axis=1)).sum()) * (1.0 + ROUNDING)
    return Coefficients(
        frequencies=frequencies,
        linear=linear,
        real=middle[:, :, 0].reshape(len(keys), -1),
        imaginary=middle[:, :, 1].reshape(len(keys), -1),
        error=error,
        scales=tuple(scales),
        ranges=ranges,
    )


def _radius(x: Ball) -> float:
    """The radius of a ball, rounded up."""
    radius = float(x.rad())
    return math.nextafter(radius * (1.0 + 2.0**-50), math.inf) if radius or not x.is_exact() else 0.0
