"""A search for a cause ends, says so, and ends at the same place on every machine."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from harness.cause import budget as budgets
from harness.cause.budget import Budget, SearchEndedError
from harness.cause.changes import Change
from harness.cause.explain import explain
from harness.cause.problem import Problem, State
from harness.cause.refine import MOST_SETS, combined, knobs
from harness.cause.states import singles
from harness.description.dh import DHRow, DHTable
from harness.difference.differences import _problem, diff
from harness.difference.operands import Operand, of_table
from harness.difference.remarks import remarks


def chain(joints: int, seed: int = 0, row: int = -1, by: float = 0.0) -> Operand:
    """A table of random numbers; in one row, `a` is longer by so many metres."""
    numbers = np.random.default_rng(seed).uniform(-0.3, 0.3, (joints, 4)).round(3)
    if row >= 0:
        numbers[row, 0] += by
    return of_table(DHTable(tuple(DHRow.of(f"j{i}", "revolute", x) for i, x in enumerate(numbers))), f"chain {seed}")


def problem(a: Operand, b: Operand) -> Problem:
    return _problem(a, b, {j: j for j in a.joints}, (1e-6, 1e-6))


def test_a_budget_counts_factors_and_configurations() -> None:
    budget = Budget(6)
    budget.spend(100, 16)
    assert (budget.work, budget.evaluations, budget.ended, budget.remark()) == (8000, 1, False, "")
    with pytest.raises(SearchEndedError):
        budget.spend(budgets.LIMIT, 16)
    assert (budget.work, budget.remark()) == (8000, "the search was ended after 1 evaluations")


def test_a_search_that_ran_out_says_so_every_time_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budgets, "LIMIT", 2_000_000)
    texts = [str(diff(chain(6), chain(6, seed=1), (1e-6, 1e-6))) for _ in range(2)]
    assert texts[0] == texts[1]
    assert re.search(r"unexplained: the search was ended after \d{3,4} evaluations: the joint screws first differ", texts[0])


def test_a_search_that_did_not_run_out_says_nothing() -> None:
    one = problem(chain(3), chain(3, row=1, by=0.01))
    assert explain(one) is not None
    assert one.budget.remark() == ""


def test_a_repair_stands_when_the_search_for_its_equivalents_ran_out(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = explain(problem(chain(4), chain(4, row=1, by=0.01)))
    monkeypatch.setattr(Budget, "begin_again", lambda budget: setattr(budget, "work", budgets.LIMIT))
    cut = explain(problem(chain(4), chain(4, row=1, by=0.01)))
    assert whole is not None
    assert cut is not None
    assert (whole.ended, cut.after) == (0, whole.after)
    assert cut.ended > 0
    assert not any(cut.equivalents)
    assert remarks(cut)[0].startswith("the search for changes that do the same was ended after ")
    assert "ended" not in " ".join(remarks(whole))


def test_a_long_chain_is_searched_without_pairs_of_joints() -> None:
    def kinds(joints: int) -> set[str]:
        start = State.start(problem(chain(joints), chain(joints, seed=1)))
        return {change.kind for state in singles(start) for change in state.edits}

    assert {"order", "coupling"} <= kinds(3)
    assert not {"coupling"} & kinds(budgets.LONG + 1)


def test_a_wrong_number_of_sixty_joints_is_found() -> None:
    explanation = explain(problem(chain(60), chain(60, row=30, by=0.01)))
    assert explanation is not None
    changes: tuple[Change, ...] = explanation.changes
    assert [(c.subject, c.parameter, round(c.size, 9)) for c in changes] == [("j30", "a", 0.01)]


def test_two_chains_of_sixty_joints_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budgets, "LIMIT_LONG", budgets.LIMIT_LONG // 10)
    text = str(diff(chain(60), chain(60, seed=1), (1e-6, 1e-6)))
    assert "unexplained: the search was ended after " in text
    assert " evaluations; exchanged or coupled joints are not searched for in chains of more than 20 joints: " in text


def test_of_a_hundred_joints_and_more_no_cause_is_searched_for() -> None:
    text = str(diff(chain(101), chain(101, seed=1), (1e-6, 1e-6)))
    assert "unexplained: no cause is searched for in chains of more than 100 joints, these have 101: the joint screws" in text


def test_more_sets_of_numbers_than_memory_holds_are_not_tried() -> None:
    start = State.start(problem(chain(40), chain(40, seed=1)))
    assert len(knobs(start)) ** 3 / 6 > MOST_SETS
    assert combined(start, 3, 5) == []
    assert len(combined(start, 2, 5)) == 5


def test_the_limits_are_above_what_an_arm_takes() -> None:
    arm = chain(5)
    calibrated = np.random.default_rng(2).normal(0.0, 1e-3, (5, 4))
    assert arm.table is not None
    rows = tuple(
        replace(r, a=r.a + x[0], alpha=r.alpha + x[1], d=r.d + x[2], theta=r.theta + x[3])
        for r, x in zip(arm.table.rows, calibrated, strict=True)
    )
    one = problem(arm, of_table(replace(arm.table, rows=rows), "calibrated"))
    explain(one)
    assert not one.budget.ended
    assert one.budget.work < budgets.LIMIT / 10
