"""Accepted numbers: what goes on file, what counts as moved, and what a strict run fails for."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.description.model import RobotModel
from harness.errors import InputError
from harness.rendering.html import render_html, render_index
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report.document import Report
from harness.report.json_file import read_report
from harness.run.options import Options
from harness.verdict.accepted import accepted_from, accepted_text, read_accepted, since
from tests.helpers import compared, crosscheck, remade

FAST = ("dh:pinocchio", "urdf:pinocchio")
Cli = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def report(models: dict[str, RobotModel]) -> Report:
    return crosscheck(models["sixr"], Options(samples=50, seed=0, sources=FAST, command="crosscheck run sixr"))


def changed(report: Report, name: str, **update: object) -> Report:
    sources = [remade(s, **update) if s.name == name else s for s in report.sources]
    return remade(report, sources=sources)


def grown(report: Report, name: str, by: float) -> Report:
    """The report with the position error of a source's last frame `by` larger [m]."""
    source = next(s for s in report.sources if s.name == name)
    last = source.frames[-1]
    position = remade(last.position, max=last.position.max + by)
    return changed(report, name, frames=[*source.frames[:-1], remade(last, position=position)])


def test_a_report_is_itself(report: Report, tmp_path: Path) -> None:
    path = tmp_path / "sixr.json"
    path.write_text(accepted_text(accepted_from(report)))
    found = since(read_accepted(path), report, True)
    assert not found.moved
    assert not found.changed
    assert not found.worse
    assert compared(report, read_accepted(path), True).verdict == report.verdict


def test_the_file_is_small_and_has_a_line_a_frame(report: Report) -> None:
    text = accepted_text(accepted_from(report))
    assert len(text) < 6000
    assert json.loads(text)["sources"]["urdf:pinocchio"]["frames"].keys() == {f.name for f in report.frames}
    lines = [line for line in text.splitlines() if '"tool": [' in line]
    assert len(lines) == 4  # two sources, largest seen and proven
    assert all(line.rstrip(",").endswith("]") for line in lines)


@pytest.mark.parametrize(("by", "moves"), [(0.0, False), (0.5, False), (2.0, True), (1e6, True)])
def test_only_more_than_the_noise_floor_counts(report: Report, by: float, moves: bool) -> None:
    floor = report.sources[2].floor
    assert 1e-13 <= floor < 1e-12
    later = compared(grown(report, "urdf:pinocchio", by * floor), accepted_from(report), True)
    assert later.regression is not None
    assert bool(later.regression.moved) == moves
    assert later.verdict.exit_code == int(moves)
    if moves:
        assert later.verdict.sentence.startswith("sixr MOVED since it was accepted: urdf:pinocchio at tool: position")
        assert compared(grown(report, "urdf:pinocchio", by * floor), accepted_from(report), False).verdict.exit_code == 0


def test_the_floor_of_a_float32_source_is_its_own(models: dict[str, RobotModel]) -> None:
    report = crosscheck(
        models["sixr"], Options(samples=20, seed=0, sources=("urdf:pinocchio", "urdf:pytorch-kinematics"), certify=False)
    )
    floors = {s.name: s.floor for s in report.sources}
    assert floors["urdf:pytorch-kinematics"] == 1e-6
    assert floors["urdf:pinocchio"] < 1e-12


def test_what_shrinks_is_told_and_does_not_fail(report: Report) -> None:
    later = compared(report, accepted_from(grown(report, "urdf:pinocchio", 1e-3)), True)
    assert later.verdict.exit_code == 0
    assert later.regression is not None
    assert [m.after < m.before for m in later.regression.moved] == [True]


@pytest.mark.parametrize(
    ("update", "what", "worse"),
    [
        ({"verdict": "disagrees"}, "urdf:pinocchio: agrees, now disagrees", True),
        ({"verdict": "not run", "status": "not run", "frames": []}, "urdf:pinocchio: agrees, now not run", True),
        ({"verdict": "agrees as accepted"}, "urdf:pinocchio: agrees, now agrees as accepted", False),
        ({"certificate": None}, "certificate of urdf:pinocchio: certified, now none", True),
    ],
)
def test_what_is_no_number(report: Report, update: dict[str, object], what: str, worse: bool) -> None:
    found = since(accepted_from(report), changed(report, "urdf:pinocchio", **update), True)
    assert what in [f"{c.what}: {c.before}, now {c.after}" for c in found.changed]
    assert found.worse == worse


def test_a_frame_or_a_source_that_is_gone_fails(report: Report) -> None:
    source = report.sources[2]
    kept = [f for f in source.frames if f.frame != next(g.frame for g in source.frames if g.frame != source.worst_frame)]
    assert since(accepted_from(report), changed(report, source.name, frames=kept), True).worse
    pairs = [pair for pair in report.pairs if "urdf:pinocchio" not in (pair.a, pair.b)]
    without = remade(report, sources=report.sources[:2], pairs=pairs)
    gone = since(accepted_from(report), without, True)
    assert [(c.what, c.after) for c in gone.changed] == [("urdf:pinocchio", "not there")]
    assert gone.worse
    new = since(accepted_from(without), report, True)
    assert [(c.what, c.before) for c in new.changed] == [("urdf:pinocchio", "not there")]
    assert not new.worse


def test_other_settings_cannot_be_compared(report: Report) -> None:
    numbers = accepted_from(report)
    other = remade(report, settings=remade(report.settings, samples=51))
    later = compared(other, numbers, True)
    assert later.verdict.exit_code == 1
    assert "accepted with other settings (samples: 50, now 51)" in later.verdict.sentence
    assert compared(other, numbers, False).verdict.exit_code == 0


def test_fewer_configurations_are_a_part_of_those_accepted(report: Report, models: dict[str, RobotModel]) -> None:
    numbers = accepted_from(report)
    fewer = crosscheck(models["sixr"], Options(samples=20, seed=0, sources=FAST, command="crosscheck run sixr"))
    found = since(numbers, fewer, True)
    assert not found.worse
    assert found.note == "looked at 20 of the 50 random configurations accepted"
    assert since(numbers, grown(fewer, "urdf:pinocchio", 1e-3), True).worse
    shrunk = since(accepted_from(grown(report, "urdf:pinocchio", 1e-3)), fewer, True)
    assert not shrunk.moved


def test_an_exit_code_of_1_stays(report: Report) -> None:
    failed = remade(report, verdict=remade(report.verdict, exit_code=3, sentence="sixr IS NOT"))
    assert compared(grown(failed, "urdf:pinocchio", 1.0), accepted_from(report), True).verdict.exit_code == 1


@pytest.mark.parametrize("render", [render_html, render_markdown, render_junit, lambda r: render_index([r])])
def test_every_format_tells_what_moved(report: Report, render: Callable[[Report], str]) -> None:
    later = compared(grown(report, "urdf:pinocchio", 3e-4), accepted_from(report), True)
    text = render(later)
    assert "urdf:pinocchio at tool: position" in text.replace("\\", "") or "▲ grew" in text
    assert "0.300 mm" in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON: Expecting property name"),
        ('{"format": "fk-crosscheck report"}', "no accepted numbers: Input should be 'fk-crosscheck accepted'"),
        (None, "nothing was accepted yet; crosscheck accept sixr"),
    ],
)
def test_a_wrong_file(tmp_path: Path, text: str | None, message: str) -> None:
    path = tmp_path / "sixr.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_accepted(path)


def test_accept_then_strict_then_a_change(cli: Cli, copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur5")
    run = ("run", str(folder), "--samples", "50", *(word for s in FAST for word in ("--source", s)))
    early = cli(*run, "--strict")
    assert early.returncode == 2
    assert "nothing was accepted yet; crosscheck accept ur5" in early.stderr
    assert cli("accept", str(folder)).returncode == 2  # no report yet
    assert cli(*run).returncode == 0
    accepted = cli("accept", str(folder))
    assert accepted.returncode == 0, accepted.stderr
    assert accepted.stdout.strip() == "reports/accepted/ur5.json"
    same = cli(*run, "--strict")
    assert same.returncode == 0, same.stdout
    assert "nothing moved by more than the noise floor" in same.stdout
    # A hundredth of a nanometre: the gate's tolerance allows it, the numbers on file do not.
    table = folder / "dh.csv"
    table.write_text(table.read_text().replace("0.089159", "0.08915900001"))
    older = cli("accept", str(folder))
    assert older.returncode == 2
    assert "the report is older than dh.csv" in older.stderr
    moved = cli(*run, "--strict")
    assert moved.returncode == 1, moved.stdout
    assert "MOVED since it was accepted" in moved.stdout
    # What is told to reproduce it fails as well.
    assert read_report(folder.parent.parent / "reports" / "ur5.json").settings.command.endswith(" --strict")
    assert cli(*run).returncode == 0


def test_the_robots_that_come_with_it_have_their_numbers_on_file(models: dict[str, RobotModel]) -> None:
    folder = Path(__file__).parents[2] / "reports" / "accepted"
    for name, model in models.items():
        numbers = read_accepted(folder / f"{name}.json")
        assert numbers.robot == name
        ours = {k: v for k, v in model.hashes.items() if k.endswith((".toml", ".csv")) or k.startswith("urdf:")}
        assert ours.items() <= numbers.inputs.items(), f"nox -s crosscheck, then crosscheck accept {name}"
