"""The order of search: documented as it is, and each strategy finds what it is for."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness import se3
from harness.cause.problem import Problem, State
from harness.cause.strategies import STRATEGIES, aligned_chains, search
from harness.description.model import RobotModel
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.mutation.mutant import with_row
from tests.cause.test_explain import bound_problem, mutant

DOCUMENT = Path(__file__).parents[2] / "docs" / "causes.md"


def against_the_urdf(model: RobotModel, *changes: tuple[int, str, float]) -> Problem:
    """The model's URDF against its table with numbers changed: (row, number, by how much)."""
    for index, name, size in changes:
        model = with_row(model, index, **{name: getattr(model.table.rows[index], name) + size})
    assert model.urdf is not None
    return bound_problem(model, UrdfPinocchio(model.urdf))  # type: ignore[no-any-return]


def test_the_document_lists_the_strategies_in_their_order() -> None:
    unwrapped = re.sub(r"\n   (?=\S)", " ", DOCUMENT.read_text())
    listed = re.findall(r"^(\d+)\. \*\*(.+?)\*\*: (.+)\.$", unwrapped, flags=re.MULTILINE)
    assert listed == [(str(i), s.name, s.purpose) for i, s in enumerate(STRATEGIES, start=1)]


def test_names_tell_strategies_apart() -> None:
    assert len({s.name for s in STRATEGIES}) == len({s.find for s in STRATEGIES}) == len(STRATEGIES)


@pytest.mark.parametrize(
    ("robot", "fault", "changes", "expected"),
    [
        ("ur5", None, ((0, "d", 0.001),), "one change"),
        ("ur5", None, ((1, "a", 0.002), (4, "d", -0.003)), "two numbers"),
        ("ur5", "base and base_link: links exchanged", ((0, "d", 0.0003),), "one change then another"),
        ("stanford", None, ((0, "d", 0.5), (2, "d", -0.5), (3, "theta", 0.2)), "one change and two numbers"),
    ],
)
def test_which_strategy_finds_what(
    models: dict[str, RobotModel], robot: str, fault: str | None, changes: tuple[tuple[int, str, float], ...], expected: str
) -> None:
    model = models[robot] if fault is None else mutant(models[robot], fault).model
    start = State.start(against_the_urdf(model, *changes))
    for strategy in STRATEGIES:
        repaired = strategy.find(start)
        assert (repaired is not None) == (strategy.name == expected), strategy.name
        if repaired is not None:
            assert repaired.agrees()
            break
    again = search(start)
    assert again is not None
    assert again.changes() == repaired.changes()  # type: ignore[union-attr]


def test_aligned_chains_finds_tool_and_zero_offsets_at_once(models: dict[str, RobotModel]) -> None:
    model = models["sixr"]
    moved = replace(model, table=replace(model.table, tool=model.table.tool @ se3.translation((0.0, 0.05, 0.1))))
    start = State.start(against_the_urdf(moved, (1, "theta", 0.5), (2, "theta", -0.5), (3, "theta", 0.2), (4, "theta", 1.0)))
    assert not start.agrees()
    repaired = aligned_chains(start)
    assert repaired is not None
    assert repaired.agrees()
    assert {knob.parameter.owner for knob in repaired.shifts} == {"tool", *model.table.joints[1:5]}


def test_what_an_engine_adds_to_its_description_is_kept(models: dict[str, RobotModel]) -> None:
    """Asked for by name; KeyError for a side without a model."""
    problem = against_the_urdf(models["ur5"], (0, "d", 0.001))
    assert problem.a is not None
    for part, observed in problem.observed.items():
        modelled = problem.a.mechanism.placements(observed.q, problem.names)
        assert np.array_equal(problem.unmodelled["a", part], observed.a - modelled)
        assert problem.unmodelled["a", part] is problem.unmodelled["a", part]
    with pytest.raises(KeyError):
        replace(problem, b=None).unmodelled["b", "fit"]


def test_nothing_is_found_where_neither_side_has_a_model(models: dict[str, RobotModel]) -> None:
    """As with a tolerance so small that no description reproduces its own engine."""
    problem = replace(against_the_urdf(models["stanford"], (0, "d", 0.001)), a=None, b=None)
    assert [strategy.name for strategy in STRATEGIES if strategy.find(State.start(problem)) is not None] == []
