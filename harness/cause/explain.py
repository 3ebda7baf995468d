"""Why two models disagree: the fewest changes that, made to one side, were tried and make both agree.

Nothing is named that was not applied, compared again and found within tolerance. Other changes that do the same are named
beside each: one mechanism has many wordings, and the files alone cannot tell which was meant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.cause import fit
from harness.cause.budget import SearchEndedError
from harness.cause.changes import Change
from harness.cause.problem import Problem, State
from harness.cause.states import accepted, nearly_as_near, singles, without
from harness.cause.strategies import search


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """A repair that works.

    changes: what it changes, the plainest first.
    equivalents: for each change, others that do the same in its place.
    before, after: largest discrepancy without and with the repair, [m] and [rad].
    ended: after how many evaluations the search for `equivalents` was ended; 0 if it was not.
    """

    changes: tuple[Change, ...]
    equivalents: tuple[tuple[Change, ...], ...]
    before: tuple[float, float]
    after: tuple[float, float]
    ended: int = 0


def explain(problem: Problem) -> Explanation | None:
    """The plainest repair of the fewest changes. None if none works, if nothing disagrees, or if the budget is used up."""
    start = State.start(problem)
    if not all(np.isfinite(T).all() for T in start.now) or start.agrees():
        return None
    try:
        repaired = search(start)
    except SearchEndedError:
        return None
    return None if repaired is None else _reported(start, repaired)


def discrepancy(start: State) -> tuple[float, float]:
    """Largest discrepancy [m], [rad] of the frames whose offset is known: a measured offset would spread it over all q."""
    T_a, T_b = (T[:, start.problem.fitted_frames] for T in start.now)
    return fit.errors(T_a, T_b)


def _reported(start: State, repaired: State) -> Explanation:
    """The repair with what could stand in the place of each of its changes, the plainest wording first."""
    budget = start.problem.budget
    budget.begin_again()
    before, after = discrepancy(start), repaired.errors()
    slots = sorted((_alternatives(start, repaired, own) for own in repaired.changes()), key=lambda slot: slot[0].rank)
    return Explanation(
        changes=tuple(slot[0] for slot in slots),
        equivalents=tuple(slot[1:] for slot in slots),
        before=before,
        after=after,
        ended=budget.evaluations if budget.ended else 0,
    )


def _alternatives(start: State, repaired: State, own: Change) -> tuple[Change, ...]:
    """One change of a repair and those that do the same in its place, the plainest first."""
    same = {own.key: own}
    try:
        rest = without(start, repaired, own)
        # The others stay as they are: else it would be another repair.
        tried = [] if rest is None else accepted(singles(rest))
    except SearchEndedError:  # the repair stands; what else would do the same was not all looked for
        return (own,)
    if rest is not None:
        kept = {change.key for change in rest.changes()}
        least = max(min((s.residual for s in tried), default=0.0), repaired.residual)
        alike = nearly_as_near(tried, least)
        same.update({c.key: c for s in alike for c in s.changes() if c.key not in kept and c.key != own.key})
    return tuple(sorted(same.values(), key=lambda change: change.rank))
