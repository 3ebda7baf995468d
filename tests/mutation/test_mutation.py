"""The score of the gate: what is caught, what must not be, and that the score itself can fail."""

from __future__ import annotations

import io
import json
import math
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rich.console import Console

from harness.description.model import RobotModel
from harness.mutation import trial as trials
from harness.mutation.controller import FaultyWorkers
from harness.mutation.mutant import Cause, Mutant
from harness.mutation.numbers import of_urdf
from harness.mutation.score import MutationScore, Outcome, Trial, score, show
from harness.mutation.trial import mutants_of, try_out
from harness.report.document import Report
from harness.report.explanation import OneChange
from harness.verdict.crosscheck import crosscheck
from tests.conftest import WITHOUT
from tests.helpers import remade

PINOCCHIO, FLOAT32 = "urdf:pinocchio", "urdf:pytorch-kinematics"


@pytest.fixture(scope="module")
def workers() -> Iterator[FaultyWorkers]:
    made = FaultyWorkers()
    with made:
        yield made


def tried(model: RobotModel, mutant: Mutant, workers: FaultyWorkers, *sources: str) -> list[Trial]:
    return try_out(mutant, model, sources or (PINOCCHIO,), workers, ())


def named(model: RobotModel, name: str) -> Mutant:
    return next(m for m in mutants_of(model) if m.name == name)


def test_every_operator_of_the_catalogue_is_there(models: dict[str, RobotModel]) -> None:
    operators = {m.operator for robot in ("ur5", "stanford", "sixr") for m in mutants_of(models[robot])}
    assert operators >= {
        "10 %", "1 mm, 1 mrad", "10 um, 10 urad", "1 nm, 1 nrad", "sign", "joint sign", "order", "convention", "degrees",
        "millimetres", "base/base_link", "flange/tool0", "tool missing", "inverse", "reversed", "float32", "3.1416", "offset",
        "axis left out", "axis unnormalised", "mimic ignored", "mimic", "coupling", "theta + 2 pi", "slide", "base into d1",
        "as modified",
    }  # fmt: skip
    names = [m.name for m in mutants_of(models["ur5"])]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("robot", ["stanford", "panda", "ur5e"])
def test_a_sample_of_mutants_is_caught_and_named(models: dict[str, RobotModel], workers: FaultyWorkers, robot: str) -> None:
    model = models[robot]
    for mutant in list(mutants_of(model))[3::29]:
        if "1 nm" in mutant.operator and robot == "ur5e":
            continue  # the URDF's own rounding of pi is a fifth of that
        for one in tried(model, mutant, workers):
            assert one.outcome in ("caught", "left alone", "below the floor"), one
            assert one.cause_named is not False, one


@pytest.mark.parametrize("robot", ["ur5", "humanoid_arm", "stanford", "iiwa14"])
def test_equivalent_mutants_are_left_alone(models: dict[str, RobotModel], workers: FaultyWorkers, robot: str) -> None:
    model = models[robot]
    equivalent = [m for m in mutants_of(model) if m.equivalent]
    assert {m.operator for m in equivalent} >= {"theta + 2 pi", "base into d1"}
    for mutant in equivalent:
        if robot == "iiwa14" and mutant.operator == "theta + 2 pi" and "joint_a1" not in mutant.name:
            continue  # seconds each, for its accepted deviation is explained each time
        for one in tried(model, mutant, workers):
            assert one.outcome == "left alone", one


@pytest.mark.skipif(FLOAT32 in WITHOUT, reason="declared absent")
def test_a_nanometre_is_below_the_floor_of_a_float32_source(models: dict[str, RobotModel], workers: FaultyWorkers) -> None:
    fine, coarse = tried(models["ur5"], named(models["ur5"], "d of elbow_joint + 1 nm"), workers, PINOCCHIO, FLOAT32)
    assert (fine.outcome, coarse.outcome) == ("caught", "below the floor")
    assert "tolerance 1e-06 m" in coarse.note


def test_a_follower_that_is_ignored(models: dict[str, RobotModel], workers: FaultyWorkers) -> None:
    model = models["ur5"]
    split = next(m for m in mutants_of(model) if m.operator == "mimic")
    assert [t.outcome for t in tried(model, split, workers)] == ["left alone"]
    ignored = next(m for m in mutants_of(model) if m.operator == "mimic ignored")
    (one,) = tried(model, ignored, workers)
    assert (one.outcome, one.cause_named, one.source) == ("caught", True, "urdf:controller")


def test_an_axis_of_length_two_is_caught_where_it_stretches_the_travel(
    models: dict[str, RobotModel], workers: FaultyWorkers
) -> None:
    mutant = next(m for m in mutants_of(models["stanford"]) if m.operator == "axis unnormalised" and m.extra)
    fine, stretched = tried(models["stanford"], mutant, workers)
    assert fine.outcome == "left alone"
    assert (stretched.source, stretched.outcome, stretched.cause_named) == ("urdf:yourdfpy", "caught", True)


# The score can fail ------------------------------------------------------------------------------------


def test_a_gate_that_sees_nothing_misses(
    models: dict[str, RobotModel], workers: FaultyWorkers, monkeypatch: pytest.MonkeyPatch
) -> None:
    def blind(model: RobotModel, *rest: object) -> Report:
        return crosscheck(models["ur5"], *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(trials, "crosscheck", blind)
    (one,) = tried(models["ur5"], named(models["ur5"], "d of elbow_joint + 1 mm"), workers)
    assert one.outcome == "missed"
    assert score([one], 1, 0.0, []).exit_code == 1


def test_the_tables_show_every_outcome() -> None:
    outcomes: tuple[Outcome, ...] = ("caught", "missed", "below the floor", "left alone", "false alarm", "refused")
    trials = [
        Trial(robot="arm", source="s", mutant=f"m{i}", side="table", operator="o", outcome=outcome, note="a note")
        for i, outcome in enumerate(outcomes)
        for _ in range(i + 1)
    ]
    console = Console(file=io.StringIO(), width=200)
    show(score(trials, 1, 0.0, []), console)
    assert isinstance(console.file, io.StringIO)
    head, row, *rest = console.file.getvalue().splitlines()
    assert re.split(r"\s{2,}", head.strip()) == [
        "robot", "caught", "missed", "below the floor", "equivalent, not flagged", "false alarms", "refused", "cause named",
    ]  # fmt: skip
    assert re.split(r"\s{2,}", row.strip()) == ["arm", "1", "2", "3", "4", "5", "6", "0 of 1, 0.0 %"]
    assert "missed: arm, s: m1: a note" in rest


def test_a_number_of_an_origin_is_named_as_explanations_name_it(models: dict[str, RobotModel]) -> None:
    causes = {c.parameter for m in of_urdf(models["ur5"]) for c in m.causes}
    assert causes == {"origin x", "origin y", "origin z", "roll", "pitch", "yaw"}


def test_a_gate_that_flags_everything_raises_false_alarms(
    models: dict[str, RobotModel], workers: FaultyWorkers, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = named(models["ur5"], "d of elbow_joint + 1 mm").model
    monkeypatch.setattr(trials, "crosscheck", lambda model, *rest: crosscheck(wrong, *rest))
    (one,) = tried(models["ur5"], named(models["ur5"], "theta of elbow_joint + 2 pi"), workers)
    assert one.outcome == "false alarm"


CHANGE = OneChange(text="", kind="parameter", side="a", subject="elbow", parameter="d", size=-1.005e-3, unit="m")


@pytest.mark.parametrize(
    ("cause", "hit"),
    [
        (Cause("parameter", "elbow", "d", -1e-3), True),
        (Cause("parameter", "elbow", "d", -0.99e-3), False),
        (Cause("parameter", "elbow", "a", -1e-3), False),
        (Cause("parameter", "wrist", "d", -1e-3), False),
        (Cause("sign", "elbow", "d"), False),
    ],
)
def test_a_cause_is_named_by_joint_number_and_size(cause: Cause, hit: bool) -> None:
    assert cause.named_by(CHANGE) is hit


def test_an_angle_is_the_same_a_turn_away() -> None:
    turned = remade(CHANGE, unit="rad", parameter="theta", size=0.1 - 2 * math.pi)
    assert Cause("parameter", "elbow", "theta", 0.1).named_by(turned)


def test_the_command_writes_what_it_tells(cli: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path) -> None:
    done = cli("mutate", "humanoid_arm", "--source", PINOCCHIO, "--every", "40", "--jobs", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    result = MutationScore.model_validate(json.loads((tmp_path / "reports" / "mutation.json").read_text()))
    assert result.total.caught > 0
    assert result.total.missed == result.total.false_alarms == 0
    assert f"{result.total.caught} caught, 0 missed, 0 false alarms" in done.stdout
    bad = cli("mutate", "humanoid_arm", "--source", "dh:numpy")
    assert bad.returncode == 2
    assert "expected a source that reads a URDF" in bad.stderr
