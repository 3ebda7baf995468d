"""Several numbers at once: Gauss-Newton on exact derivatives, and which pairs and triples would explain the difference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from harness.cause import fit
from harness.cause.problem import ENDS, Knob, State
from harness.se3 import Array

STEPS = 12
RANK = 1e-9  # relative size of singular values below which a direction counts as undetermined
MOST_SETS = 1_000_000  # of so many sets of numbers the best is looked for
ALIKE = 1e-10  # two numbers move everything alike if the cosine between their effects is this near to 1


def knobs(state: State) -> list[Knob]:
    """Every number of both descriptions."""
    mechanisms = [(end, state.mechanism(end)) for end in ENDS]
    return [Knob(end, parameter) for end, mechanism in mechanisms if mechanism is not None for parameter in mechanism.parameters]


def derivatives(state: State, wanted: Sequence[Knob]) -> Array:
    """How each wanted number moves a relative to b: (K, M), velocities and angular velocities of the fitted frames, stacked."""
    problem = state.problem
    q, names = problem.observed["fit"].q, problem.fitted_names
    rows: dict[Knob, Array] = {}
    for end in ENDS:
        own = [k for k in wanted if k.end == end]
        mechanism = state.mechanism(end)
        if not own or mechanism is None:
            continue
        problem.budget.spend(len(mechanism.factors) + len(own), len(q) * len(names))
        T, xi, moves = mechanism.twists(q, names)
        slots = [mechanism.parameters.index(k.parameter) for k in own]
        J = fit.derivatives(T, xi[slots], moves[slots]).reshape(len(own), -1)
        rows.update(zip(own, J if end == "a" else -J, strict=True))
    return np.array([rows[k] for k in wanted]).reshape(len(wanted), 6 * len(q) * len(names))


def gap(state: State) -> Array:
    """What leads from a to b: (M,), in the order of `derivatives`."""
    T_a, T_b = (T[:, state.problem.fitted_frames] for T in state.now)
    return fit.residuals(T_a, T_b).ravel()


def polish(state: State) -> State | None:
    """The state with its shifts fitted together; None if they do not converge.

    Where several changes of the numbers do equally well, the smallest is taken.
    """
    if not set(state.shifts) <= set(knobs(state)):  # an edit has taken the number out
        return None
    last, best = np.inf, state
    for _ in range(STEPS):
        r = gap(state)
        size = float(r @ r)
        if not np.isfinite(size) or (size > 4.0 * last + 1e-30):
            return None
        if size < last:
            best = state
        if size > 0.9 * last:
            break
        last = size
        chosen = list(state.shifts)
        J = derivatives(state, chosen)
        step = np.linalg.lstsq(J.T, r, rcond=RANK)[0]
        state = state.shifted({k: state.shifts[k] + float(d) for k, d in zip(chosen, step, strict=True)})
        if np.abs(step).max(initial=0.0) < 1e-15:
            return state
    return best


def combined(state: State, count: int, most: int) -> list[State]:
    """States with `count` numbers more that explain the difference to first order, best first: starts for `polish`.

    Each set of numbers is solved by linear least squares.
    count: how many numbers are changed together, 2 or 3.
    most: how many states are returned. None are, if there are more than MOST_SETS sets.
    """
    every = knobs(state)
    J, r = derivatives(state, every), gap(state)
    sizes = np.sqrt((J * J).sum(axis=1))
    useful = [i for i in range(len(every)) if sizes[i] > 1e-9]
    J = J[useful] / sizes[useful, None]
    useful, J = _distinct(useful, J)
    if math.comb(len(useful), count) > MOST_SETS:
        return []
    state.problem.budget.spend(math.comb(len(useful), count), 0)
    G, h = J @ J.T, J @ r
    sets = np.array(list(combinations(range(len(useful)), count)))
    if not len(sets):
        return []
    A = G[sets[:, :, None], sets[:, None, :]]
    b = h[sets]
    solvable = np.linalg.det(A) > 1e-8
    sets, A, b = sets[solvable], A[solvable], b[solvable]
    x = np.linalg.solve(A, b[..., None])[..., 0]
    gain = (x * b).sum(axis=1)
    states = []
    for i in np.argsort(-gain)[:most]:
        chosen = [every[useful[j]] for j in sets[i]]
        values = x[i] / sizes[[useful[j] for j in sets[i]]]
        shifts = {**state.shifts, **{k: state.shifts.get(k, 0.0) + float(v) for k, v in zip(chosen, values, strict=True)}}
        states.append(state.shifted(shifts))
    return states


def _distinct(useful: list[int], J: Array) -> tuple[list[int], Array]:
    """One number of each group that moves everything alike: the others come back as its equivalents."""
    kept: list[int] = []
    for i in range(len(useful)):
        if not kept or (1.0 - np.abs(J[kept] @ J[i])).min() > ALIKE:
            kept.append(i)
    return [useful[i] for i in kept], J[kept]
