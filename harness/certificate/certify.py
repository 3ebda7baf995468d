"""Agreement for every configuration: a proven upper bound on the discrepancy of two sources, and the largest one found.

The difference of two placements is, like each of them, a polynomial in (1, cos q, sin q) of known degree, so its values on
a small grid fix it everywhere. Two bounds on its largest value follow: the interpolation kernel's Lebesgue constant times
the largest grid value, and the sum of its coefficients' norms; the smaller counts. The premise, that an engine's output *is*
such a polynomial, is tested for each engine at random configurations. docs/theory.md has the derivations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.certificate.interpolation import Axis, coefficient_sum, grid, weights
from harness.digits import steps
from harness.se3 import Array, chord_angle

# q (N, n) to placements (N, F, 4, 3): columns x, y, z axis and origin [m] of each frame.
Evaluate: TypeAlias = Callable[[Array], Array]

Indices: TypeAlias = NDArray[np.intp]

TESTS = 64
SWEEPS = 2
SCAN = 96
UNIT_ROUNDOFF = 2.0**-53


@dataclass(frozen=True)
class Sampled:
    """One engine on the grid of M nodes.

    Attributes:
        values: placements (M, F, 4, 3), as `Evaluate` gives them.
        residual: the largest entry by which the engine differs from its own interpolant at random configurations [m or 1].
        limit: what rounding explains of it: (1 + Lebesgue constant) times the rounding of one value.
    """

    values: Array
    residual: float
    limit: float

    @property
    def holds(self) -> bool:
        """Whether the premise holds; never for what is not finite."""
        return within(self.residual, self.limit)


@dataclass(frozen=True)
class Bounds:
    """Proven upper bounds on the discrepancies of two sources.

    Attributes:
        position: for each frame, (F,) [m].
        rotation: for each frame, (F,) [rad].
        method: for each frame, which bound the position's is: `kernel`, `coefficients` or `links`.
    """

    position: Array
    rotation: Array
    method: tuple[str, ...]


def rounding_of(joints: int, reach: float) -> float:
    """Error allowed to one entry of a float64 placement: 16 (n + 2) u (1 + reach).

    A product of n + 2 rigid factors commits at most gamma_4 = 4u per multiplication on entries bounded by 1 and the reach
    (Higham, "Accuracy and Stability", section 3.5); the factor 4 above that covers sines, node positions and offsets.

    Args:
        joints: number of joints n.
        reach: the largest distance of a frame from the base [m].
    """
    return 16.0 * (joints + 2) * UNIT_ROUNDOFF * (1.0 + reach)


def lebesgue(axes: list[Axis]) -> float:
    """Lebesgue constant of the tensor-product grid: the product over the joints."""
    return math.prod(axis.lebesgue for axis in axes)


def probes(axes: list[Axis], rng: np.random.Generator) -> Array:
    """Random configurations to test the premise at, (64, n): four whole turns around the grid, or the prismatic range.

    Outside every joint limit on purpose: an engine that clamps or wraps there is no longer such a polynomial.
    """
    lower, upper = (np.array([getattr(axis, end) for axis in axes]) for end in ("lower", "upper"))
    beyond = 1.5 * (upper - lower) * np.array([axis.periodic for axis in axes])
    return np.asarray(rng.uniform(lower - beyond, upper + beyond, (TESTS, len(axes))))


def largest(entries: Array) -> float:
    """Largest modulus, infinity if any entry is not a number."""
    worst = float(np.abs(entries).max(initial=0.0))
    return worst if math.isfinite(worst) else math.inf


def within(residual: float, limit: float) -> bool:
    """Whether a premise holds: a finite limit, and a residual that is not above it."""
    return math.isfinite(limit) and residual <= limit


def sample(evaluate: Evaluate, axes: list[Axis], rng: np.random.Generator) -> Sampled:
    """Evaluate an engine on the grid, and test the premise at random configurations.

    Args:
        evaluate: the engine.
        axes: how its placements depend on each joint.
        rng: draws the random configurations.
    """
    values = evaluate(grid(axes))
    q = probes(axes, rng)
    with np.errstate(invalid="ignore", over="ignore"):
        predicted = np.tensordot(weights(axes, q), values, axes=1)
        residual = largest(evaluate(q) - predicted)
        reach = largest(np.linalg.norm(values[:, :, 3], axis=-1))
    return Sampled(values, residual, (1.0 + lebesgue(axes)) * rounding_of(len(axes), reach))


def certify(a: Sampled, b: Sampled, axes: list[Axis]) -> Bounds:
    """Upper bounds on |D(q)| over every q, D = a - b, from the grid values of two sources whose premise holds.

    Rounding: interpolating values that are off by r misses by (1 + Lebesgue constant) r at most, and is added.

    Args:
        a: one source on the grid, at F frames.
        b: the other, on the same grid, at the same frames.
        axes: how placements depend on each joint.
    """
    D, allowance = a.values - b.values, a.limit + b.limit
    position, method = sup_bound(axes, D[:, :, 3], allowance)
    chord, _ = sup_bound(axes, D[:, :, :3].reshape(*D.shape[:2], 9), allowance)
    return Bounds(position, chord_angle(chord), tuple(str(m) for m in method))


def sup_bound(axes: list[Axis], values: Array, allowance: float) -> tuple[Array, NDArray[np.str_]]:
    """The smaller of both bounds on an interpolant's norm over every q.

    Args:
        axes: how the values depend on each joint.
        values: d-vectors on the grid, (M, ..., d).
        allowance: rounding of each of the d entries, which is added.

    Returns:
        The bounds (...), and which one each is (...): `kernel` or `coefficients`.
    """
    kernel = lebesgue(axes) * _norm(values).max(axis=0)
    coefficients = coefficient_sum(axes, values)
    method = np.where(coefficients <= kernel, "coefficients", "kernel")
    return np.minimum(kernel, coefficients) + math.sqrt(values.shape[-1]) * allowance, method


def tighter(a: Bounds, b: Bounds) -> Bounds:
    """The smaller of two bounds, frame by frame: both hold."""
    method = tuple(m if x <= y else n for x, y, m, n in zip(a.position, b.position, a.method, b.method, strict=True))
    return Bounds(np.minimum(a.position, b.position), np.minimum(a.rotation, b.rotation), method)


def ascend(difference: Evaluate, axes: list[Axis], starts: Array, frames: Indices, parts: Indices) -> Array:
    """Climb from each start to a local maximum of its discrepancy, joint by joint.

    Along one joint D is known exactly from as many values as it has nodes, so each step looks at the whole circle.

    Args:
        difference: q (K, n) to D (K, F, 4, 3).
        axes: how D depends on each joint.
        starts: configurations (S, n) [rad or m].
        frames: index of the frame that each start is to maximise, (S,).
        parts: 0 to maximise its position, 1 its rotation, (S,).

    Returns:
        The configurations reached, (S, n) [rad or m].
    """
    q = starts.copy()
    each = np.arange(len(q))
    for _ in range(SWEEPS if len(q) else 0):
        for j, axis in enumerate(axes):
            at_nodes = np.repeat(q, axis.count, axis=0)
            at_nodes[:, j] = np.tile(axis.nodes, len(q))
            D = difference(at_nodes)
            values = D.reshape(len(q), axis.count, D.shape[1], 12)[each, :, frames]
            candidates = np.linspace(axis.lower, axis.upper, SCAN + 1)
            along = np.einsum("ck,skd->scd", axis.weights(candidates), values)
            size = np.where((parts == 0)[:, None], _norm(along[..., 9:]), _norm(along[..., :9]))
            q[:, j] = candidates[steps(size).argmax(axis=1)]  # of equal ones the first, not what rounding chooses
    return q


def found_from(difference: Evaluate, interpolant: Evaluate, axes: list[Axis], starts: Array, floor: float) -> tuple[Array, Array]:
    """Largest discrepancies found by climbing from the best of some configurations, checked on the engines themselves.

    Args:
        difference: q (K, n) to D (K, F, 4, 3), by the engines.
        interpolant: the same, by their interpolants, which are faster.
        axes: how D depends on each joint.
        starts: configurations to begin at, (S, n) [rad or m].
        floor: rounding; frames with a discrepancy below it are not climbed.

    Returns:
        For each frame position [m] and rotation [rad], (F,) each.
    """
    D = difference(starts)
    F = D.shape[1]
    sizes = np.stack([_norm(D[:, :, 3]), _norm(D[:, :, :3].reshape(len(D), F, 9))])
    best, index = sizes.max(axis=1), steps(sizes).argmax(axis=1)
    parts, frames = np.nonzero(best > floor)
    q = ascend(interpolant, axes, starts[index[parts, frames]], frames, parts)
    if len(q):
        top = difference(q)[np.arange(len(q)), frames]
        reached = np.where(parts == 0, _norm(top[:, 3]), _norm(top[:, :3].reshape(len(q), 9)))
        np.maximum.at(best, (parts, frames), reached)
    return best[0], chord_angle(best[1])


def _norm(v: Array) -> Array:
    return np.asarray(np.linalg.norm(v, axis=-1))
