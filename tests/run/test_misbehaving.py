"""Engines that are right almost everywhere: which are caught, how it is told, and what is said of those that cannot be."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from harness.description.model import RobotModel
from harness.engines import registry
from harness.engines.registry import Registered
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.rendering.files import write_report
from harness.rendering.html import render_html
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report import tested_parts as parts
from harness.report.document import Report, Source
from harness.report.json_file import read_report
from harness.run.options import Options
from harness.se3 import Array
from tests.helpers import crosscheck
from tests.run.misbehaving import FAULTS, engine

WORKER = str(Path(__file__).with_name("misbehaving.py"))


class Expected(NamedTuple):
    """What an engine must get.

    verdict, code: of the source, and of the gate.
    told: a part of the verdict sentence.
    turns: from about how many turns on it must be told to differ, if only there.
    """

    verdict: str
    code: int
    told: str = ""
    turns: float | None = None


DEPENDS = "its answers depend on what is asked before or beside them"
ALONE = "the same configuration alone: 1.000 mm off: " + DEPENDS
STATE = Expected("keeps state", 1, DEPENDS)
PASSES = Expected("agrees", 0)

TABLE = {
    # Seen before, or told to be
    "first_call": Expected("keeps state", 1, "changed by 0.001 when asked again"),
    "single_calls": Expected("keeps state", 1, "changed by 0.001 when asked again"),
    "cache 0.01": STATE,
    "cache 0.001": STATE,
    "cache 1e-05": STATE,
    "dead_band": Expected("disagrees", 1, "asked in small steps, it has wrist_1_link "),
    "high_rows": Expected("keeps state", 1, "asked in a block of 4096, it has shoulder_link 1.000 mm off"),
    "after_forty_calls": Expected("keeps state", 1, ALONE),
    "clamps": PASSES._replace(turns=3.0),
    "wraps_wrongly": PASSES._replace(turns=2.5),
    # Not to be excluded by any test: the report says how far it was tested
    "narrow": PASSES,
    "after_twenty_thousand": PASSES,
    # Blocks
    "reversed_rows": STATE,
    "sorted_rows": STATE,
    "previous_row_first": STATE,
    "last_row_of_a_block": Expected("keeps state", 1, "asked in a block of 4096, it has shoulder_link 1.000 mm off"),
    "rows_for_columns": Expected("keeps state", 1, "in a block of 6: 171 deg off"),
    "shared_buffer": Expected("keeps state", 1, "looked at later, after others were asked for: "),
    "changes_q": PASSES,  # harmless: every call gets an array of its own
    # Calls
    "every_seventh_call": Expected("keeps state", 1, "its answers depend on what is asked before or beside them"),
    "drifts": Expected("keeps state", 1, "when asked again"),
    "backlash": Expected("keeps state", 1, "when asked again"),
    "rounded_keys": STATE,
    "one_joint_unchanged": STATE,
    "raises_alone": Expected("failed", 3, "ValueError: expected a batch (tested against its own description: single calls)"),
    # Angles
    "clamps_at_half_a_turn": Expected("disagrees", 1, "wrist_3_link off by"),
    "float32_beyond_a_turn": PASSES._replace(turns=1.0),
    "degrees_beyond_a_turn": PASSES._replace(turns=1.0),
    "table_lookup": Expected("disagrees", 1, "wrist_3_link off by 3.9e-06 m"),
    "small_angles": Expected("disagrees", 1, "it has wrist_3_link 1.8e-08 m"),
    "nan_at_zero": Expected("invalid placements", 1, "first 1 at zero"),
    "nan_at_two_right_angles": Expected("invalid placements", 1, "asked at right angles and beside them, at q = [1.5708, 1.5708"),
    # Refusals beyond the limits are told, and no more
    "raises_beyond_limits": PASSES,
    "nan_beyond_limits": PASSES,
}
REFUSED = {"raises_beyond_limits": "ValueError: joint limits exceeded", "nan_beyond_limits": "nothing finite came back"}


def test_the_table_is_complete() -> None:
    assert set(TABLE) == set(FAULTS)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Register an engine with a fault as `dh:fake`."""

    def register(fault: str) -> None:
        known = {**registry.registered(), "dh:fake": Registered("dh:fake", engine(fault))}
        monkeypatch.setattr(registry, "registered", lambda: known)

    return register


def named(report: Report, name: str) -> Source:
    return next(s for s in report.sources if s.name == name)


def own_test(source: Source) -> parts.Tested:
    assert source.tested is not None
    return source.tested


@pytest.mark.parametrize("fault", TABLE)
def test_each_gets_what_it_must(models: dict[str, RobotModel], fake: Callable[[str], None], fault: str) -> None:
    expected = TABLE[fault]
    fake(fault)
    report = crosscheck(models["ur5"], Options(samples=200, sources=("dh:fake",), explain=False))
    source = named(report, "dh:fake")
    assert (str(source.verdict), report.verdict.exit_code) == (expected.verdict, expected.code)
    assert expected.told in report.verdict.sentence
    if expected.verdict == "failed":
        assert source.tested is None
        return
    tested = own_test(source)
    assert tested.configurations > 2000
    assert tested.calls > 340
    assert tested.refused == REFUSED.get(fault, "")
    assert (tested.beyond is not None) == (expected.turns is not None) or not source.passes
    if expected.turns is not None and tested.beyond is not None:
        assert expected.turns < tested.beyond.turns < expected.turns + 0.5
    # What shows that an engine is not what a bound takes it for leaves no bound.
    proven = source.certificate is not None and source.certificate.status == "certified"
    assert not proven or source.passes
    if source.passes:
        assert tested.problem == ""
        assert max(tested.position, tested.rotation) <= tested.limit < 2e-13


@pytest.mark.parametrize("fault", ["first_call", "single_calls", "cache 0.001", "high_rows", "after_forty_calls"])
def test_the_same_as_programs(models: dict[str, RobotModel], fault: str) -> None:
    """A program gets the verdict of an engine in this process; the other source is none the worse for it."""
    options = Options(
        samples=200, sources=("dh:pinocchio",), workers=(("controller", (sys.executable, WORKER, fault)),), explain=False
    )
    report = crosscheck(models["ur5"], options)
    controller = named(report, "controller")
    assert (str(controller.verdict), report.verdict.exit_code) == (TABLE[fault].verdict, 1)
    assert TABLE[fault].told in report.verdict.sentence
    assert named(report, "dh:pinocchio").passes
    assert own_test(named(report, "dh:pinocchio")).problem == ""


def test_a_program_that_dies_far_away_has_failed(models: dict[str, RobotModel]) -> None:
    command = (sys.executable, str(Path(__file__).parents[1] / "workers" / "faulty_worker.py"), "dies beyond the limits")
    report = crosscheck(models["ur5"], Options(samples=50, sources=("dh:pinocchio",), workers=(("controller", command),)))
    controller = named(report, "controller")
    assert (str(controller.verdict), report.verdict.exit_code) == ("failed", 3)
    assert "exited with code 9" in controller.reason
    assert named(report, "dh:pinocchio").passes


@pytest.mark.parametrize("fault", ["dead_band", "high_rows", "nan_at_two_right_angles"])
def test_every_format_tells_it(models: dict[str, RobotModel], fake: Callable[[str], None], tmp_path: Path, fault: str) -> None:
    """What the comparison has not seen stands in the HTML, the Markdown and JUnit, and the document can be read back."""
    fake(fault)
    report = crosscheck(models["ur5"], Options(samples=50, sources=("dh:fake",), explain=False))
    problem = own_test(named(report, "dh:fake")).problem
    start = problem.split(",")[0]
    assert start
    page = render_html(report)
    assert start in page
    assert "is off at" not in page
    assert start in render_markdown(report)
    assert start in render_junit(report)
    assert "<failure" in render_junit(report)
    write_report(report, tmp_path)
    assert read_report(tmp_path / "ur5.json") == report


@pytest.mark.parametrize(("fault", "verdict"), [("dead_band", "disagrees"), ("high_rows", "keeps state")])
def test_the_reference_is_tested_too(
    models: dict[str, RobotModel], fake: Callable[[str], None], fault: str, verdict: str
) -> None:
    fake(fault)
    report = crosscheck(models["ur5"], Options(samples=50, sources=("dh:pinocchio",), reference="dh:fake", explain=False))
    reference = named(report, "dh:fake")
    assert reference.reference
    assert str(reference.verdict) == verdict
    assert report.verdict.exit_code == 1
    assert report.verdict.sentence.startswith("ur5 DISAGREES: dh:fake: asked in ")
    assert "dh:fake" in render_junit(report)


class WithDeadBand(UrdfPinocchio):
    source = "urdf:fake"
    isolated = False

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.where(np.abs(q) < 1e-5, 0.0, q), frames)


def test_an_accepted_deviation_hides_nothing_else(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    """The URDF is off the table at six frames, as accepted. A fault of the engine, which the comparison has not seen, counts."""
    known = {**registry.registered(), "urdf:fake": Registered("urdf:fake", WithDeadBand)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    report = crosscheck(models["iiwa14"], Options(samples=50, sources=("urdf:fake", "urdf:pinocchio"), explain=False))
    assert str(named(report, "urdf:pinocchio").verdict) == "agrees as accepted"
    source = named(report, "urdf:fake")
    assert {str(f.verdict) for f in source.frames} == {"agrees", "accepted"}
    assert str(source.verdict) == "disagrees"
    assert own_test(source).problem.endswith("from where the URDF has it")
    caught = own_test(source).caught
    assert caught is not None
    assert next(str(f.verdict) for f in source.frames if f.frame == caught.frame) == "accepted"
