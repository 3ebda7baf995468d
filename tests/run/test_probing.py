"""The test of each engine against its own description: which configurations, what rounding may be, what counts."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.description.configurations import ConfigurationSet
from harness.description.model import RobotModel, load_model
from harness.description.urdf import UrdfText
from harness.engines import registry
from harness.engines.base import Engine, Misreading
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import Registered
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.engines.urdf_yourdfpy import UrdfYourdfpy
from harness.errors import InputError
from harness.report import tested_parts as parts
from harness.report.document import Report, Source
from harness.report.json_file import to_json
from harness.run.described import described
from harness.run.options import Options
from harness.run.probes import FAR, FULL, GRID, KINDS, STEPS, TURN, Box, Draws, draw
from harness.se3 import Array
from harness.verdict.accepted import accepted_from
from harness.workers.protocol import MAX_BLOCK
from tests.helpers import compared, crosscheck

ROBOTS = ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"]
FAST = ("dh:pinocchio", "urdf:pinocchio")


def named(report: Report, name: str) -> Source:
    return next(s for s in report.sources if s.name == name)


def own_test(report: Report, name: str) -> parts.Tested:
    tested = named(report, name).tested
    assert tested is not None
    return tested


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Callable[[type[Engine]], None]:
    """Register an engine under its own name, to run in this process."""

    def register(adapter: type[Engine]) -> None:
        known = {**registry.registered(), adapter.source: Registered(adapter.source, adapter)}
        monkeypatch.setattr(registry, "registered", lambda: known)

    return register


# What is asked ----------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_kind_is_there(models: dict[str, RobotModel], robot: str) -> None:
    model = models[robot]
    law = model.configurations
    probes = draw(model, law.block(0, 0, 50), 0)
    asked, full, *_ = probes.blocks
    assert len(asked.q) == 50
    assert (full.q.shape, len(full.kinds)) == ((MAX_BLOCK, len(model.table.joints)), MAX_BLOCK)
    counts = Counter(kind for block in (*probes.blocks, probes.singles) for kind in block.kinds)
    assert set(counts) == set(KINDS)
    assert counts[FULL] > 1000
    assert counts[GRID] == math.prod(3 if turns else 2 for turns in law.revolute)
    slides = ~np.array(law.revolute)
    every = np.concatenate([full.q, probes.singles.q])
    assert (every[:, slides] >= law.lower[slides]).all()
    assert (every[:, slides] <= law.upper[slides]).all()
    kinds = np.array([*full.kinds, *probes.singles.kinds])
    turns = np.abs(every[:, ~slides]) / TURN
    assert turns[kinds == FAR].max() == pytest.approx(25.0)
    assert (turns[kinds == FAR].max(axis=1) > 0.9).mean() > 0.8
    assert probes.box.near(every[kinds != FAR]).all()
    # Each small step is a call and a row of the block.
    rows = {q.tobytes() for q in full.q}
    walk = probes.singles.q[np.array(probes.singles.kinds) == STEPS]
    assert {q.tobytes() for q in walk} <= rows
    sizes = np.abs(np.diff(walk, axis=0)).max(axis=1)
    assert sizes[sizes > 0].min() == pytest.approx(1e-9, rel=1e-3)


def test_a_seed_is_a_seed(models: dict[str, RobotModel]) -> None:
    """The same numbers for ever: these come from Philox's raw stream, which NumPy never changes."""
    model, some = models["ur5"], models["ur5"].configurations.block(0, 0, 5)
    one, same, other = draw(model, some, 7), draw(model, some, 7), draw(model, some, 8)
    assert np.array_equal(one.singles.q, same.singles.q)
    assert np.array_equal(one.blocks[1].q, same.blocks[1].q)
    assert not np.array_equal(one.blocks[1].q, other.blocks[1].q)
    assert Draws(0).unit(3).tolist() == [0.28154573909350056, 0.8892856953607198, 0.18900856732613736]
    # The random configurations of a run with the same seed are others.
    drawn = {float(x) for x in model.configurations.random(7, 0, 2000).ravel()}
    assert not drawn & {float(x) for x in one.blocks[1].q.ravel()}


def law_of(lower: Sequence[float], upper: Sequence[float], revolute: Sequence[bool]) -> ConfigurationSet:
    law = ConfigurationSet((), np.array(lower), np.array(upper), tuple(revolute))
    law.__dict__["fixed_q"] = np.zeros((1, len(lower)))
    return law


def test_where_joints_may_be() -> None:
    """A turn each way, wider limits as they are, a slide without a sane range 10 m each way from what is nearest to zero."""
    box = Box.of(law_of([-3.0, -9.0, -999_999.0, 50.0], [3.0, 20.0, 999_999.0, 90.0], [True, True, False, False]))
    assert box.lower.tolist() == [-TURN, -9.0, -10.0, 50.0]
    assert box.upper.tolist() == [TURN, 20.0, 10.0, 60.0]
    q = np.array([[6.28, 19.0, 0.0, 55.0], [6.29, 0.0, 0.0, 55.0], [0.0, -9.1, 0.0, 55.0]])
    assert box.near(q).tolist() == [True, False, False]
    assert box.inside(np.array([[2.9, 0.0, 5000.0, 50.0], [3.1, 0.0, 0.0, 50.0]])).tolist() == [True, False]


def long_arm(joints: int) -> str:
    rows = "\n".join(f"j{i},revolute,0.1,{'pi/2' if i % 2 else '-pi/2'},0.05,0" for i in range(joints))
    return f"joint,type,a,alpha,d,theta\n{rows}\n"


def test_a_long_chain(tmp_path: Path) -> None:
    """Thirty joints: the grid goes over neighbours, 16 joints are looked at one by one, and the engine passes."""
    folder = tmp_path / "long"
    folder.mkdir()
    (folder / "dh.csv").write_text(long_arm(30))
    (folder / "model.toml").write_text(
        'name = "long"\ndescription = "a long arm"\nconvention = "standard"\n[provenance]\ndocument = "none"\n'
        '[tolerance]\nposition = 1e-12\nrotation = 1e-12\n[[source]]\nname = "dh:pinocchio"\n'
    )
    (folder / "frames.toml").write_text(
        '[[frame]]\nname = "base"\ndh = 0\n' + "".join(f'[[frame]]\nname = "f{i}"\ndh = {i}\n' for i in range(1, 31))
    )
    (folder / "configurations.toml").write_text("")
    model = load_model(folder)
    probes = draw(model, model.configurations.block(0, 0, 5), 0)
    assert sum(kind == GRID for block in probes.blocks for kind in block.kinds) <= 2048
    report = crosscheck(model, Options(samples=20, sources=("dh:pinocchio",), explain=False))
    tested = own_test(report, "dh:pinocchio")
    assert (tested.problem, report.verdict.exit_code) == ("", 0)
    assert max(tested.position, tested.rotation) <= tested.limit


# What rounding may be ----------------------------------------------------------------------------


def test_the_allowance_grows_with_turns_and_lengths(models: dict[str, RobotModel]) -> None:
    own = described(models["ur5"], "dh", {})
    near, far = own.allowance(np.full((1, 6), TURN))[0], own.allowance(np.full((1, 6), 25 * TURN))[0]
    assert near == pytest.approx((16 * 8 + 8 * 6 * TURN) * 2.0**-53 * (1 + 1.192509), rel=0.1)
    assert 15 < far / near < 25
    slide = described(models["stanford"], "dh", {})
    assert slide.allowance(np.array([[0, 0, 9.0, 0, 0, 0]]))[0] > 1.5 * slide.allowance(np.zeros((1, 6)))[0]


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot_to_rounding(models: dict[str, RobotModel], robot: str) -> None:
    report = crosscheck(models[robot], Options(samples=50, sources=FAST, explain=False))
    assert report.verdict.exit_code == 0
    for name, description in (("dh:numpy", "dh"), ("dh:pinocchio", "dh"), ("urdf:pinocchio", "urdf")):
        tested = own_test(report, name)
        assert (tested.description, tested.problem, tested.refused, tested.beyond) == (description, "", "", None)
        assert max(tested.position, tested.rotation) <= tested.limit < 1e-12
        assert tested.turns == pytest.approx(25.0)
        assert 4000 < tested.configurations < 4500
        assert 330 < tested.calls < 370
        assert sum(kind.count for kind in tested.kinds) == tested.answers
        assert sum(kind.calls for kind in tested.kinds) == tested.calls


def test_an_engine_that_computes_in_float32(models: dict[str, RobotModel]) -> None:
    """Its own tolerance holds; what it is off is shown."""
    report = crosscheck(models["ur5"], Options(samples=20, sources=("urdf:pytorch-kinematics",), explain=False))
    tested = own_test(report, "urdf:pytorch-kinematics")
    assert (tested.problem, report.verdict.exit_code) == ("", 0)
    assert 1e-9 < tested.position < 1e-6


# What counts -------------------------------------------------------------------------------------


def test_yourdfpy_ignores_small_steps(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    """A trait says so. Without it the engine would not pass: it keeps state."""
    options = Options(samples=10, sources=("urdf:yourdfpy",), explain=False, in_process=True)
    report = crosscheck(models["humanoid_arm"], options)
    tested = own_test(report, "urdf:yourdfpy")
    assert (tested.problem, report.verdict.exit_code, tested.ignored_step) == ("", 0, 1e-8)
    assert 2000 < tested.configurations < 2500  # and it is slow
    assert 1e-9 < max(tested.position, tested.rotation) < 1e-7
    monkeypatch.setattr(UrdfYourdfpy, "ignored_step", 0.0)
    bare = crosscheck(models["humanoid_arm"], options)
    assert (str(named(bare, "urdf:yourdfpy").verdict), bare.verdict.exit_code) == ("keeps state", 1)


class Clamped(DHNumpy):
    source = "dh:fake"

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.clip(q, -math.pi, math.pi), frames)


def test_within_a_turn_it_counts_beyond_the_limits_too(copy_model: Callable[..., Path], fake: Callable[..., None]) -> None:
    """Its joints end at half a turn. The comparison sees no configuration beyond, and all frames agree."""
    fake(Clamped)
    folder = copy_model("sixr")
    (folder / "configurations.toml").write_text("")
    report = crosscheck(load_model(folder), Options(samples=100, sources=("dh:fake",), explain=False))
    source = named(report, "dh:fake")
    assert all(frame.passes for frame in source.frames)
    assert str(source.verdict) == "disagrees"
    caught = own_test(report, "dh:fake").caught
    assert caught is not None
    assert 0.5 < caught.turns <= 1.0


class ReadsZ(UrdfPinocchio):
    """Takes z for an axis that is not written, as some engines do."""

    source = "urdf:fake"
    isolated = False
    traits = (Misreading("missing-axis-z", "a joint without <axis> turns about z", "fake 1.0", lint="missing-axis"),)

    def __init__(self, description: UrdfText) -> None:
        joints = re.split("(?=<joint)", description.text)
        written = [j if "<axis" in j or '"fixed"' in j else j.replace("<child", '<axis xyz="0 0 1"/><child', 1) for j in joints]
        super().__init__(UrdfText("".join(written)))


@pytest.mark.parametrize("declared", [True, False])
def test_a_trait_leaves_the_verdict_to_the_comparison(
    copy_model: Callable[..., Path], fake: Callable[..., None], monkeypatch: pytest.MonkeyPatch, declared: bool
) -> None:
    """The table agrees with what the engine makes of a missing axis. Declared, that passes as before; if not, it is told."""
    folder = copy_model("humanoid_arm")
    path = folder.parents[1] / "urdf" / "humanoid_arm.urdf"
    text = path.read_text()
    assert '<axis xyz="0 0 1"/>' in text
    path.write_text(text.replace('<axis xyz="0 0 1"/>', "", 1))
    if not declared:
        monkeypatch.setattr(ReadsZ, "traits", ())
    fake(ReadsZ)
    report = crosscheck(load_model(folder), Options(samples=50, sources=("urdf:fake",), explain=False))
    source = named(report, "urdf:fake")
    assert all(frame.passes for frame in source.frames)
    assert report.verdict.exit_code == (0 if declared else 1)
    if not declared:
        assert "from where the URDF has it" in report.verdict.sentence


# Options and the report --------------------------------------------------------------------------


def test_the_seed_changes_nothing_that_is_accepted(models: dict[str, RobotModel]) -> None:
    options = {"samples": 50, "sources": ("urdf:pinocchio",), "explain": False}
    one, other = (crosscheck(models["sixr"], Options(**options, probe_seed=seed)) for seed in (0, 12345))  # type: ignore[arg-type]
    assert (one.settings.probe_seed, other.settings.probe_seed) == (0, 12345)
    assert own_test(one, "urdf:pinocchio").configurations != own_test(other, "urdf:pinocchio").configurations
    regression = compared(other, accepted_from(one), strict=True).regression
    assert regression is not None
    assert (regression.problem, regression.moved, regression.changed) == ("", [], [])


def test_equal_runs_give_equal_reports(models: dict[str, RobotModel]) -> None:
    def body(report: Report) -> dict[str, object]:
        return {key: value for key, value in json.loads(to_json(report)).items() if key != "environment"}

    options = Options(samples=50, sources=FAST, explain=False, probe_seed=3)
    assert body(crosscheck(models["stanford"], options)) == body(crosscheck(models["stanford"], options))


@pytest.mark.parametrize("without", [{"certify": False}, {"probe": False}])
def test_without(models: dict[str, RobotModel], without: dict[str, bool]) -> None:
    report = crosscheck(models["ur3"], Options(samples=5, sources=FAST, **without))  # type: ignore[arg-type]
    assert all(source.tested is None for source in report.sources)


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, True])
def test_wrong_seeds(seed: object) -> None:
    with pytest.raises(InputError):
        Options(probe_seed=seed)  # type: ignore[arg-type]


def test_a_packaged_robot_has_no_description(models: dict[str, RobotModel]) -> None:
    source = "dh:roboticstoolbox-packaged"
    report = crosscheck(models["ur5"], Options(samples=10, sources=(source,), explain=False))
    tested = own_test(report, source)
    assert (tested.description, tested.position, tested.problem) == ("", 0.0, "")
    assert "which no file of this model describes" in tested.reason
    assert tested.again is not None
    assert tested.again.change <= tested.again.allowed
