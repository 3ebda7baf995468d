"""A sharper bound: the function's largest value on a fine grid, divided by what it can lose between two nodes.

A trigonometric polynomial of degree m that reaches 1 at x is at least cos(m (y - x)) at every y within pi / m of x (M. Riesz
1914). Of N equally spaced nodes one is within pi / N of x. So, joint by joint,
    sup |D| <= max over the grid |D| / prod_j cos(pi m_j / N_j)          for N_j > 2 m_j,
also for vectors: take the direction of the largest value. A term that is linear in a slide is largest at an end of its range.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.digits import first_of_largest
from harness.se3 import Array
from harness.theorem.coefficients import ROUNDING, Coefficients

NEGLIGIBLE = 0.005  # share of the largest value found that joints may have which are left out of the grid
TARGET = 1.085  # growth between the nodes that is aimed at
FINEST = 64  # nodes a degree
STARTS = 32
POINTS = 129
WIDTHS = (1.0, 0.5, 0.02, 0.02, 0.002, 0.0005)  # of a period, each way

Complex: TypeAlias = NDArray[np.complex128]


@dataclass(frozen=True)
class Top:
    """A large value of a function: its norm as float64 computes it, and the configuration (n,) [rad or m]."""

    value: float
    q: Array


def highest(function: Coefficients, starts: Array) -> Top:
    """Climb from the best of some configurations to a local maximum, joint by joint.

    Along one joint the function is known from a few vectors, so each step looks at the whole circle, the last ones closely.

    Args:
        function: the function.
        starts: configurations (S, n) [rad or m].
    """
    norms = np.linalg.norm(function.values(starts), axis=1)
    q, best = starts[first_of_largest(norms)].copy(), float(norms.max())
    moving = [j for j in range(starts.shape[1]) if function.frequencies[:, j].any() or (function.linear == j).any()]
    for width in WIDTHS:
        for j in moving:
            tries = _tries(function, q, j, width)
            norms = np.linalg.norm(function.along(q, j, tries), axis=1)
            if norms.max() > best * (1.0 + 1e-9):  # less is a matter of rounding
                q[j], best = tries[first_of_largest(norms)], float(norms.max())
    return Top(best, q)


def _tries(function: Coefficients, q: Array, joint: int, width: float) -> Array:
    """Values of one joint to look at: around the one it has, by up to so much of a period or of its range."""
    low, high = function.ranges[joint]
    if (function.linear == joint).any():
        return np.clip(np.linspace(q[joint] - width * (high - low), q[joint] + width * (high - low), POINTS), low, high)
    turn = 2.0 * math.pi * function.scales[joint]
    return np.asarray(q[joint] + np.linspace(-width * turn, width * turn, POINTS))


def random_starts(function: Coefficients) -> Array:
    """Configurations to climb from, (S, n), the same for the same function. What is no turn stays within its range."""
    rng = np.random.default_rng(0)
    turns = np.asarray(function.frequencies.any(axis=0))
    low = np.where(turns, 0.0, function.ranges[:, 0])
    high = np.where(turns, 2.0 * math.pi * np.array(function.scales), function.ranges[:, 1])
    return np.asarray(rng.uniform(low, high, (STARTS, len(turns))))


def sharpened(function: Coefficients, top: Top, most: int) -> tuple[float, Top]:
    """A bound on the norm over every configuration, and the largest value that was met.

    Args:
        function: the function.
        top: a large value of it, known before.
        most: largest number of nodes.

    Returns:
        The smaller of the new bound and the sum of the sizes, and the larger of `top` and what was found.
    """
    plain = function.bound()
    reduced = _without_small(function, NEGLIGIBLE * top.value)
    axes = _axes(reduced, most)
    if axes is None or plain <= TARGET * top.value:
        return plain, top
    growth = math.prod(1.0 / math.cos(math.pi * a.degree / a.count) for a in axes if not a.slides)
    size, nodes = _largest_on(reduced, axes)
    starts = function.ranges.mean(axis=1)[None].copy()
    for axis, index in zip(axes, nodes, strict=True):
        starts[0, axis.joint] = axis.nodes[index]
    climbed = highest(function, starts)
    bound = (size * growth + ROUNDING * plain) * (1.0 + ROUNDING) + reduced.error
    return min(plain, bound), max(top, climbed, key=lambda t: t.value)


@dataclass(frozen=True)
class _Axis:
    """One joint of the grid.

    joint: its index.
    degree: largest frequency, in units of 1 / scale.
    nodes: its values there [rad or m].
    slides: whether it is one that slides; its nodes are the two ends.
    """

    joint: int
    degree: int
    nodes: Array
    slides: bool

    @property
    def count(self) -> int:
        return len(self.nodes)

    def basis(self, scale: int) -> Complex:
        """Value of each basis function at each node: exp(ikq) for k = -m ... m, or 1 and q. (count, functions)."""
        if self.slides:
            return np.stack([np.ones(2), self.nodes], axis=1).astype(np.complex128)
        return np.asarray(np.exp(1j * np.outer(self.nodes / scale, np.arange(-self.degree, self.degree + 1))))


def _without_small(function: Coefficients, allowed: float) -> Coefficients:
    """The function without the joints that change it least, as long as they change it by no more than is allowed."""
    n = len(function.scales)
    while True:
        involved = [(function.frequencies[:, j] != 0) | (function.linear == j) for j in range(n)]
        sizes = function.sizes()
        weights = [float(sizes[mask].sum()) if mask.any() else math.inf for mask in involved]
        least = int(np.argmin(weights)) if n else -1
        if least < 0 or weights[least] > allowed:
            return function
        allowed -= weights[least]
        function = function.without(involved[least])


def _axes(function: Coefficients, most: int) -> list[_Axis] | None:
    """The joints of the grid, with so many nodes that the growth is the target, or as many as there may be.

    None if a joint both turns and slides, or if there are too many joints.
    """
    n = len(function.scales)
    degrees = [int(np.abs(function.frequencies[:, j]).max(initial=0)) for j in range(n)]
    slides = [bool((function.linear == j).any()) for j in range(n)]
    if any(d and s for d, s in zip(degrees, slides, strict=True)):
        return None
    turning = sum(d > 0 for d in degrees)

    def count(fineness: int) -> int:
        return math.prod(d * fineness for d in degrees if d) * int(2 ** sum(slides))

    fineness = 5
    while fineness < FINEST and math.cos(math.pi / fineness) ** -turning > TARGET and count(fineness + 1) <= most:
        fineness += 1
    if count(fineness) > most:
        return None
    axes = []
    for j in range(n):
        if degrees[j]:
            N = degrees[j] * fineness
            nodes = 2.0 * math.pi * function.scales[j] * np.arange(N) / N
            axes.append(_Axis(j, degrees[j], nodes, slides=False))
        elif slides[j]:
            axes.append(_Axis(j, 0, function.ranges[j], slides=True))
    return axes


def _largest_on(function: Coefficients, axes: list[_Axis]) -> tuple[float, tuple[int, ...]]:
    """The largest norm on the grid, and at which node of each axis it is. One axis is walked, to bound the memory."""
    if not axes:
        return float(np.linalg.norm(function.real.sum(axis=0))), ()
    top, best, where = 0.0, 0.0, (0,) * len(axes)
    for first, values in _slices(function, axes):
        squares = np.einsum("d...,d...->...", values, values)
        index = first_of_largest(squares.ravel())
        size, top = float(squares.flat[index]), max(top, float(squares.max()))
        if size > best * (1.0 + 1e-9):
            best, where = size, (first, *(int(i) for i in np.unravel_index(index, squares.shape)))
    return math.sqrt(top), where


def _slices(function: Coefficients, axes: list[_Axis]) -> Iterator[tuple[int, Array]]:
    """For each node of the first axis the values at all nodes of the others, (d, count of each)."""
    tensor = _dense(function, axes)
    first, *others = axes
    for i, row in enumerate(first.basis(function.scales[first.joint])):
        part = np.tensordot(tensor, row, axes=(1, 0))
        for k, axis in enumerate(others):
            E = axis.basis(function.scales[axis.joint])
            if k < len(others) - 1:
                part = np.tensordot(part, E, axes=(1, 1))  # the axis done goes to the end, the next one comes to the front
                continue
            # The result is real: only the real part of the last product is formed.
            moved = np.moveaxis(part, 1, -1)
            flat = moved.reshape(-1, moved.shape[-1])
            real = flat.real @ E.real.T - flat.imag @ E.imag.T
            part = real.reshape(*moved.shape[:-1], E.shape[0])
        yield i, part.real if np.iscomplexobj(part) else part


def _dense(function: Coefficients, axes: list[_Axis]) -> Complex:
    """All coefficients, those of negative frequencies too: (d, functions of each axis)."""
    shape = [2 if a.slides else 2 * a.degree + 1 for a in axes]
    tensor = np.zeros((function.real.shape[1], *shape), dtype=np.complex128)
    values = (function.real + 1j * function.imaginary).T
    for sign in (1, -1):
        index = tuple(
            (function.linear == a.joint).astype(int) if a.slides else sign * function.frequencies[:, a.joint] + a.degree
            for a in axes
        )
        paired = np.asarray(function.frequencies.any(axis=1))
        chosen = paired | (sign > 0)
        part = values[:, chosen] if sign > 0 else values[:, chosen].conj()
        for column, *where in zip(part.T, *(i[chosen] for i in index), strict=True):
            tensor[(slice(None), *where)] += column
    return tensor
