"""Exact interpolation of FK on a grid: what a placement is, as a function of the joints, is fixed by a few values of it.

In a serial chain every entry of a placement is, in each revolute joint, a combination of 1, cos q and sin q, and affine in
each prismatic joint (each joint enters one factor of the product once). A trigonometric polynomial of degree n is fixed by
2n + 1 equally spaced nodes, a polynomial of degree p by p + 1; docs/theory.md has the derivation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.se3 import Array

Complex: TypeAlias = NDArray[np.complex128]

GRID_LIMIT = 4096  # nodes of the largest grid on which an engine is evaluated


@dataclass(frozen=True)
class Axis:
    """How placements depend on one joint.

    Attributes:
        periodic: as a trigonometric polynomial with period `upper - lower`; if not, as a polynomial on [lower, upper].
        degree: degree of that polynomial.
        lower: lower end [rad or m].
        upper: upper end [rad or m].
    """

    periodic: bool
    degree: int
    lower: float
    upper: float

    @property
    def count(self) -> int:
        """Number of nodes."""
        return 2 * self.degree + 1 if self.periodic else self.degree + 1

    @cached_property
    def nodes(self) -> Array:
        """Equally spaced over the period, or Chebyshev-Lobatto points (the ends, for an affine dependence). (count,)."""
        if self.periodic:
            return self.lower + (self.upper - self.lower) * np.arange(self.count) / self.count
        if self.degree == 0:
            return np.array([self.lower])
        x = -np.cos(math.pi * np.arange(self.count) / self.degree)
        return self.lower + (self.upper - self.lower) * (x + 1.0) / 2.0

    def _basis(self, q: Array) -> Complex:
        """Basis functions, each at most 1 in modulus: e^{imx} for |m| <= degree, or T_0 ... T_degree. (..., count)."""
        if self.periodic:
            phase = 2.0 * math.pi * (q - self.lower) / (self.upper - self.lower)
            return np.asarray(np.exp(1j * phase[..., None] * np.arange(-self.degree, self.degree + 1)))
        x = np.clip(2.0 * (q - self.lower) / (self.upper - self.lower) - 1.0, -1.0, 1.0)
        return np.cos(np.arccos(x)[..., None] * np.arange(self.count)).astype(np.complex128)

    @cached_property
    def analysis(self) -> Complex:
        """Matrix from node values to coefficients in the basis, (count, count)."""
        if self.periodic:
            return self._basis(self.nodes).conj().T / self.count
        return np.asarray(np.linalg.inv(self._basis(self.nodes)))

    def weights(self, q: Array) -> Array:
        """Cardinal functions: value(q) = weights(q) @ values at the nodes.

        Args:
            q: values of the joint (...,) [rad or m].

        Returns:
            Weights of the nodes (..., count).
        """
        return np.asarray((self._basis(q) @ self.analysis).real)

    @property
    def lebesgue(self) -> float:
        """Bound on the sum of |weights| over all q: an interpolant is at most this times its largest node value.

        Equally spaced trigonometric nodes: the maximum is midway between two nodes, 1/N sum 1/|sin((2k+1) pi / 2N)|
        (Ehlich & Zeller 1966), 5/3 for N = 3. Affine: 1. Chebyshev-Lobatto: 1 + 2/pi log(p + 1) (Trefethen,
        "Approximation Theory and Approximation Practice", theorem 15.2).
        """
        if self.periodic:
            k = np.arange(self.count)
            return float((1.0 / np.abs(np.sin((2 * k + 1) * math.pi / (2 * self.count)))).sum() / self.count)
        return 1.0 if self.degree <= 1 else 1.0 + 2.0 / math.pi * math.log(self.degree + 1)


def grid(axes: list[Axis]) -> Array:
    """All combinations of the nodes of all axes, (product of counts, len(axes)), the last axis fastest."""
    mesh = np.meshgrid(*(axis.nodes for axis in axes), indexing="ij")
    return np.stack([m.ravel() for m in mesh], axis=1)


def weights(axes: list[Axis], q: Array) -> Array:
    """Tensor-product cardinal functions: value(q) = weights(q) @ values on the grid.

    Args:
        axes: how the values depend on each joint.
        q: configurations (K, n) [rad or m].

    Returns:
        Weights of the nodes (K, product of counts), in the order of `grid`.
    """
    out = np.ones((q.shape[0], 1))
    for i, axis in enumerate(axes):
        out = (out[:, :, None] * axis.weights(q[:, i])[:, None, :]).reshape(q.shape[0], -1)
    return out


def coefficient_sum(axes: list[Axis], values: Array) -> Array:
    """Bound on the sup norm of an interpolant over every configuration, from the sizes of its coefficients.

    Values are real, so coefficients come in conjugate pairs, and c e^(ix) + conj = 2 (Re c cos x - Im c sin x) is at most
    twice the largest singular value of [Re c, Im c] (the ellipse's half axis; |c| itself would be up to sqrt 2 more). Every
    T_k is at most 1.

    Args:
        axes: how the values depend on each joint.
        values: a real d-vector for each grid point, (product of counts, ..., d).

    Returns:
        The bounds (...).
    """
    shape = tuple(axis.count for axis in axes)
    c: Complex = values.reshape(*shape, *values.shape[1:]).astype(np.complex128)
    for i, axis in enumerate(axes):
        c = np.moveaxis(np.tensordot(axis.analysis, c, axes=(1, i)), 0, i)
    re, im = (c.real**2).sum(axis=-1), (c.imag**2).sum(axis=-1)
    mixed = (c.real * c.imag).sum(axis=-1)
    largest = np.sqrt((re + im) / 2.0 + np.sqrt(((re - im) / 2.0) ** 2 + mixed**2))
    return np.asarray(largest.reshape(-1, *values.shape[1:-1]).sum(axis=0))
