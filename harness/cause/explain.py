"""Why two models disagree: the fewest changes that, made to one side, were tried and make both agree.

First one change, of the catalogue or of one number; then two, then three, from the most promising starts; then as many numbers
as it takes. Nothing is named that was not applied, compared again and found within tolerance. Other changes that do the same
are named beside each: one mechanism has many wordings, and the files alone cannot tell which was meant.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.cause import fit
from harness.cause.align import aligned
from harness.cause.catalogue import fine, structural
from harness.cause.changes import Change
from harness.cause.frame_names import renamed
from harness.cause.problem import End, Knob, Problem, State
from harness.cause.refine import combined, polish
from harness.se3 import Array

BEAM = 8
FEW = 3
NARROW = 5
GROSS = 1e-3  # of the reach: below it no wrong joint, unit or frame is looked for
SAME_MECHANISM = 5.0
MANY = 14


@dataclass(frozen=True)
class Explanation:
    """A repair that works: its changes, and for each the others that do the same in its place; errors [m], [rad]."""

    changes: tuple[Change, ...]
    equivalents: tuple[tuple[Change, ...], ...]
    before: tuple[float, float]
    after: tuple[float, float]


def explain(problem: Problem) -> Explanation | None:
    """The plainest repair of the fewest changes; None if none was found, or nothing disagrees."""
    start = State.start(problem)
    if not all(np.isfinite(T).all() for T in start.now) or start.agrees():
        return None
    for find in (_one, _two_at_once, _two_and_two, _laid_on, _two, _three, _many):
        if (found := find(start)) is not None:
            return _told(start, found)
    return None


def _one(start: State) -> State | None:
    return _best(_accepted(_singles(start)))


def _two_at_once(start: State) -> State | None:
    """Two numbers to first order; or one change, then another where the first has left least."""
    for state in combined(start, 2, NARROW):
        if (found := _polished(state)) is not None:
            return found
    for state in _promising(start, FEW):
        if (found := _best(_accepted(_singles(state)))) is not None:
            return found
    return None


def _two_and_two(start: State) -> State | None:
    """One change, then two numbers to first order; three numbers to first order. Cheap, so before the long searches."""
    for state in _promising(start, BEAM):
        for pair in combined(state, 2, NARROW):
            if (found := _polished(pair)) is not None:
                return _fewer(found)
    for state in combined(start, 3, NARROW):
        if (found := _polished(state)) is not None:
            return found
    return None


def _laid_on(start: State) -> State | None:
    """Base, tool, signs and zero offsets together, if they are all it takes."""
    state = aligned(start)
    return None if state is None or not state.agrees() else _fewer(state)


def _two(start: State) -> State | None:
    """One change, then another, all numbers fitted together."""
    for state in _promising(start, BEAM):
        if (found := _best(_accepted(_refined(_singles(state))))) is not None:
            return found
    return None


def _three(start: State) -> State | None:
    for first in _promising(start, NARROW):
        for second in _promising(first, NARROW):
            if (found := _best(_accepted(_refined(_singles(second))))) is not None:
                return found
    return None


def _many(start: State) -> State | None:
    """As many numbers as it takes, one after the other, each the one that leaves least; then those that are not needed out.

    From where the chains lie on each other as well as they can, then from where they are.
    """
    for first in _starts(start):
        state = first
        while state.size < first.size + MANY:
            ranked = sorted((s for s in _numbers(state) if s.size > state.size), key=lambda s: s.left)
            better = [p for s in ranked[:FEW] if (p := polish(s)) is not None and p.left < 0.9 * state.left]
            if not better:
                break
            state = min(better, key=lambda s: s.left)
            if state.agrees():
                return _fewer(state)
    return None


def _starts(start: State) -> Iterator[State]:
    """Where a search for many numbers begins: with every pi written out, laid on each other; then as they are."""
    exact = start
    for end in ("a", "b"):
        cut = [s for s in fine(exact) if s.edits[-1].key == ("truncated pi", end, "", "", 0.0)]
        exact = cut[0] if cut else exact
    laid = [state for state in (aligned(exact), aligned(start) if exact is not start else None) if state is not None]
    yield from (*laid, start, *_promising(start, FEW))


def _singles(state: State) -> Iterator[State]:
    """Every state with one change more: numbers always, the catalogue if enough is left for it to matter."""
    if state.left > GROSS * state.problem.reach:
        yield from renamed(state)
        yield from structural(state)
    else:
        yield from fine(state)
        yield from renamed(state)
    yield from _numbers(state)


def _numbers(state: State) -> Iterator[State]:
    """Every number of both sides, each at its best value."""
    problem = state.problem
    T_a, T_b = (T[:, problem.fitted] for T in state.now)
    ends: tuple[tuple[End, Array], ...] = (("a", T_b),) if state.inverse else (("a", T_b), ("b", T_a))
    for end, T in ends:
        mechanism = state.mechanism(end)
        if mechanism is None:
            continue
        wanted = T - problem.added(end, problem.seen)[:, problem.fitted]
        for left, parameter, delta in fit.each_alone(mechanism, fit.Seen(problem.seen.q, problem.fitted_names, wanted)):
            knob = Knob(end, parameter)
            yield state.shifted({**state.shifts, knob: state.shifts.get(knob, 0.0) + delta}, left)


def _accepted(states: Iterable[State]) -> list[State]:
    """Those that work."""
    return [s for s in states if s.left <= 2.0 * max(s.problem.tolerance) and s.agrees()]


def _best(states: Sequence[State]) -> State | None:
    """The plainest of those that leave least: others within tolerance, but not as near, are other mechanisms."""
    if not states:
        return None
    least = min(s.left for s in states)
    alike = [s for s in states if s.left <= SAME_MECHANISM * least + 1e-15]
    return min(alike, key=_plainness)


def _plainness(state: State) -> tuple[int, list[tuple[float, str, str]]]:
    return state.size, sorted(change.rank for change in state.changes())


def _promising(state: State, count: int) -> list[State]:
    """The states with one change more that leave least."""
    return sorted(_singles(state), key=lambda s: s.left)[:count]


def _refined(states: Iterable[State]) -> Iterator[State]:
    """Each fitted again with all its numbers, if that may help."""
    ranked = sorted(states, key=lambda s: s.left)[:BEAM]
    for state in ranked:
        better = polish(state) if len(state.shifts) > 1 else state
        yield state if better is None else better


def _polished(state: State) -> State | None:
    better = polish(state)
    return better if better is not None and better.agrees() else None


def _fewer(state: State) -> State:
    """Without the numbers, and the digits, that it agrees without."""
    for change in state.edits:
        if change.kind == "truncated pi":
            rest = _without(State.start(state.problem), state, change)
            if rest is not None and (found := _polished(rest)) is not None:
                state = found
    for knob in sorted(state.shifts, key=lambda k: abs(state.shifts[k])):
        rest = state.shifted({k: x for k, x in state.shifts.items() if k != knob})
        if rest.shifts and (found := _polished(rest)) is not None:
            state = found
    return state


def _told(start: State, found: State) -> Explanation:
    """With what could stand in the place of each change; the plainest wording first."""
    slots: list[tuple[Change, ...]] = []
    for own in found.changes():
        said = {own.key: own}
        rest = _without(start, found, own)
        if rest is not None:
            kept = {change.key for change in rest.changes()}
            tried = _accepted(_singles(rest))  # the others stay as they are: else it would be another repair
            least = max(min((s.left for s in tried), default=0.0), found.left)
            alike = [s for s in tried if s.left <= SAME_MECHANISM * least + 1e-15]
            said.update({c.key: c for s in alike for c in s.changes() if c.key not in kept and c.key != own.key})
        slots.append(tuple(sorted(said.values(), key=lambda c: c.rank)))
    slots.sort(key=lambda slot: slot[0].rank)
    return Explanation(tuple(s[0] for s in slots), tuple(s[1:] for s in slots), shown(start), found.errors())


def shown(start: State) -> tuple[float, float]:
    """Largest discrepancy [m], [rad] of the frames whose offset is known: a measured one would spread it over all q."""
    T_a, T_b = (T[:, start.problem.fitted] for T in start.now)
    return fit.errors(T_a, T_b)


def _without(start: State, found: State, change: Change) -> State | None:
    """The repair without one of its changes: the structural ones made again, one after the other."""
    state = start
    for edit in found.edits:
        if edit.key != change.key:
            again = next((s for s in (*renamed(state), *structural(state)) if s.edits[-1].key == edit.key), None)
            if again is None:
                return None
            state = again
    kept = {k: x for k, x in found.shifts.items() if (k.end, *k.parameter[:2]) != (change.side, change.subject, change.parameter)}
    return state.shifted(kept if change.kind == "parameter" else found.shifts)
