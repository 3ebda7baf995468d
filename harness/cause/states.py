"""The moves of a search: states with one change more, those that work, the best of them, and with fewer changes again."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence

from harness.cause import fit
from harness.cause.catalogue import fine_repairs, structural_repairs
from harness.cause.changes import Change
from harness.cause.frame_names import mapping_repairs
from harness.cause.problem import End, Knob, State
from harness.cause.refine import polish
from harness.se3 import Array

REFINED = 8  # how many of the most promising states are fitted again with all their numbers
FIT = 20  # a number is fitted by so many placements of its frames
GROSS = 1e-3  # of the reach: below it no wrong joint, unit or frame is looked for
SAME_MECHANISM = 5.0  # two repairs whose residuals differ by no more than this factor are one mechanism


def singles(state: State) -> Iterator[State]:
    """Every state with one change more: numbers always, the catalogue if enough is left for it to matter."""
    if state.residual > GROSS * state.problem.reach:
        yield from mapping_repairs(state)
        yield from structural_repairs(state)
    else:
        yield from fine_repairs(state)
        yield from mapping_repairs(state)
    yield from numbers(state)


def numbers(state: State) -> Iterator[State]:
    """Every number of both sides, each at its best value."""
    problem = state.problem
    T_a, T_b = (T[:, problem.fitted_frames] for T in state.now)
    ends: tuple[tuple[End, Array], ...] = (("a", T_b),) if state.inverse else (("a", T_b), ("b", T_a))
    for end, T in ends:
        mechanism = state.mechanism(end)
        if mechanism is None:
            continue
        wanted = T - problem.unmodelled[end, "fit"][:, problem.fitted_frames]
        problem.budget.spend(len(mechanism.factors) + FIT * len(mechanism.parameters), wanted.shape[0] * wanted.shape[1])
        target = fit.Target(problem.observed["fit"].q, problem.fitted_names, wanted)
        for residual, parameter, delta in fit.each_alone(mechanism, target):
            knob = Knob(end, parameter)
            yield state.shifted({**state.shifts, knob: state.shifts.get(knob, 0.0) + delta}, residual)


def accepted(states: Iterable[State]) -> list[State]:
    """Those that work."""
    return [s for s in states if s.residual <= 2.0 * max(s.problem.tolerance) and s.agrees()]


def nearly_as_near(states: Iterable[State], least: float) -> list[State]:
    """Those that leave about as little as `least`: others within tolerance, but not as near, are other mechanisms."""
    return [s for s in states if s.residual <= SAME_MECHANISM * least + 1e-15]


def best(states: Sequence[State]) -> State | None:
    """The plainest of those that leave least; None if there are none."""
    if not states:
        return None
    return min(nearly_as_near(states, min(s.residual for s in states)), key=_plainness)


def _plainness(state: State) -> tuple[int, list[tuple[float, str, str]]]:
    return state.size, sorted(change.rank for change in state.changes())


def promising(state: State, count: int) -> list[State]:
    """The `count` states with one change more that leave least."""
    return heapq.nsmallest(count, singles(state), key=lambda s: s.residual)


def refined(states: Iterable[State]) -> Iterator[State]:
    """The most promising, each fitted again with all its numbers if that may help."""
    for state in heapq.nsmallest(REFINED, states, key=lambda s: s.residual):
        better = polish(state) if len(state.shifts) > 1 else state
        yield state if better is None else better


def polished(state: State) -> State | None:
    """The state with all its numbers fitted together, if both sides then agree."""
    better = polish(state)
    return better if better is not None and better.agrees() else None


def fewer(state: State) -> State:
    """Without the numbers, and without the digits of pi, that it agrees without."""
    for change in state.edits:
        if change.kind == "truncated pi":
            rest = without(State.start(state.problem), state, change)
            if rest is not None and (smaller := polished(rest)) is not None:
                state = smaller
    for knob in sorted(state.shifts, key=lambda k: abs(state.shifts[k])):
        rest = state.shifted({k: x for k, x in state.shifts.items() if k != knob})
        if rest.shifts and (smaller := polished(rest)) is not None:
            state = smaller
    return state


def without(start: State, repaired: State, change: Change) -> State | None:
    """A repair without one of its changes. None if a structural one cannot be made again without it.

    start: the state that nothing was changed in.
    repaired: the repair.
    change: the one to leave out; the other structural ones are made again, one after the other.
    """
    state = start
    for edit in repaired.edits:
        if edit.key != change.key:
            every = (*mapping_repairs(state), *structural_repairs(state))
            again = next((s for s in every if s.edits[-1].key == edit.key), None)
            if again is None:
                return None
            state = again
    if change.kind != "parameter":
        return state.shifted(repaired.shifts)
    own = (change.side, change.subject, change.parameter)
    return state.shifted({k: x for k, x in repaired.shifts.items() if (k.end, *k.parameter[:2]) != own})
