"""In which order repairs are searched: from one change to as many numbers as it takes. docs/causes.md shows the same list.

Each strategy returns a repair that was tried and works, or None. The first that has one ends the search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from harness.cause.align import aligned
from harness.cause.catalogue import fine_repairs
from harness.cause.problem import ENDS, State
from harness.cause.refine import combined, polish
from harness.cause.states import accepted, best, fewer, numbers, polished, promising, refined, singles

FEW, NARROW, WIDE = 3, 5, 8  # how many starts a search takes; the longer each start takes, the fewer
MANY = 14
PROGRESS = 0.9  # a number more must bring the residual below this part of what it was


@dataclass(frozen=True)
class Strategy:
    """One way to search for a repair.

    name: what it searches for.
    purpose: what it is for, in one sentence.
    find: from the state that nothing was changed in to a repair that works, or None.
    """

    name: str
    purpose: str
    find: Callable[[State], State | None]


def search(start: State) -> State | None:
    """The repair of the first strategy that has one; None if none has."""
    repairs = (strategy.find(start) for strategy in STRATEGIES)
    return next((repair for repair in repairs if repair is not None), None)


def one_change(start: State) -> State | None:
    """The plainest single change that works."""
    return best(accepted(singles(start)))


def two_numbers(start: State) -> State | None:
    """Two numbers that explain the difference to first order, fitted together."""
    return _first_polished(combined(start, 2, NARROW))


def one_change_then_another(start: State) -> State | None:
    """One change after another: the first stays as it is."""
    for state in promising(start, FEW):
        if (repair := best(accepted(singles(state)))) is not None:
            return repair
    return None


def one_change_and_two_numbers(start: State) -> State | None:
    """One change, then two numbers to first order, all numbers fitted together."""
    for state in promising(start, WIDE):
        if (repair := _first_polished(combined(state, 2, NARROW))) is not None:
            return fewer(repair)
    return None


def three_numbers(start: State) -> State | None:
    """Three numbers that explain the difference to first order, fitted together."""
    return _first_polished(combined(start, 3, NARROW))


def aligned_chains(start: State) -> State | None:
    """Base, tool, joint signs and zero offsets together, if they are all it takes."""
    state = aligned(start)
    return None if state is None or not state.agrees() else fewer(state)


def two_changes(start: State) -> State | None:
    """One change after another, all numbers fitted together."""
    return _refined_from(promising(start, WIDE))


def three_changes(start: State) -> State | None:
    """One change after another after another, all numbers fitted together."""
    for first in promising(start, NARROW):
        if (repair := _refined_from(promising(first, NARROW))) is not None:
            return repair
    return None


def many_numbers(start: State) -> State | None:
    """Numbers added one after the other, each the one that leaves least; then those that are not needed are taken out."""
    for first in _starts(start):
        state = first
        while state.size < first.size + MANY:
            ranked = sorted((s for s in numbers(state) if s.size > state.size), key=lambda s: s.residual)
            fitted = [p for s in ranked[:FEW] if (p := polish(s)) is not None]
            better = [p for p in fitted if p.residual < PROGRESS * state.residual]
            if not better:
                break
            state = min(better, key=lambda s: s.residual)
            if state.agrees():
                return fewer(state)
    return None


def _first_polished(states: list[State]) -> State | None:
    """The first that agrees once all its numbers are fitted together."""
    repairs = (polished(state) for state in states)
    return next((repair for repair in repairs if repair is not None), None)


def _refined_from(states: list[State]) -> State | None:
    """The best repair of one change more, of the first state that has one; all numbers fitted together."""
    for state in states:
        if (repair := best(accepted(refined(singles(state))))) is not None:
            return repair
    return None


def _starts(start: State) -> Iterator[State]:
    """Where the search for many numbers begins: from the aligned chains, with every pi written out; then as the files are."""
    exact = start
    for end in ENDS:
        written_out = [s for s in fine_repairs(exact) if s.edits[-1].key == ("truncated pi", end, "", "", 0.0)]
        exact = written_out[0] if written_out else exact
    both = (aligned(exact), aligned(start) if exact is not start else None)
    yield from (state for state in both if state is not None)
    yield from (start, *promising(start, FEW))


STRATEGIES: tuple[Strategy, ...] = (
    Strategy("one change", "a mistake of the catalogue, another frame, or one wrong number in either file", one_change),
    Strategy("two numbers", "two wrong numbers that explain the difference to first order", two_numbers),
    Strategy(
        "one change then another",
        "two unrelated mistakes, where repairing the first alone brings both sides much nearer",
        one_change_then_another,
    ),
    Strategy(
        "one change and two numbers",
        "a mistake such as a wrong frame, and two wrong numbers besides",
        one_change_and_two_numbers,
    ),
    Strategy("three numbers", "three wrong numbers that explain the difference to first order", three_numbers),
    Strategy("aligned chains", "the same arm with other base, tool, joint signs and zero offsets, all at once", aligned_chains),
    Strategy("two changes", "two mistakes that the quick searches miss: more starts, all numbers fitted together", two_changes),
    Strategy("three changes", "three mistakes, by the same long search", three_changes),
    Strategy(
        "many numbers",
        "as many numbers as it takes, each the one that leaves least, without those that turn out not to be needed",
        many_numbers,
    ),
)
