"""Long runs that are interrupted: started again they continue, and end with the numbers of one that was not."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.api import Session
from harness.description.locate import default_models_dir
from harness.description.model import RobotModel, load_model
from harness.errors import EngineFailed
from harness.rendering.index import to_stderr
from harness.report.document import Report
from harness.report.json_file import to_json
from harness.run import checkpoint as module
from harness.run import inputs
from harness.run.binding import Bound
from harness.run.checkpoint import Checkpoints
from harness.run.options import Options
from harness.run.outcome import Run
from harness.run.robot import load, run_robot
from harness.se3 import Array
from harness.workers.pool import Workers
from tests.helpers import copied, remade

SOURCES = ("dh:pinocchio", "urdf:pinocchio")
OPTIONS = Options(samples=20_000, sources=SOURCES, certify=False, in_process=True, command="crosscheck run ur5")
BLOCKS = [4096, 8192, 12288, 16384, 20018]


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A checkpoint after every block, with a key that is the test's own."""
    monkeypatch.setattr(module, "EVERY", 0.0)
    monkeypatch.setattr(module, "SHARE", 1e9)
    monkeypatch.setenv("FK_CROSSCHECK_CACHE", str(tmp_path / "cache"))


@pytest.fixture(scope="module")
def ur5() -> RobotModel:
    return load_model(default_models_dir() / "ur5")


@pytest.fixture(scope="module")
def whole(ur5: RobotModel) -> Report:
    """The report of a run that was not interrupted."""
    with Session(OPTIONS) as session:
        return session.crosscheck(ur5)


class Interrupter:
    """Ends the run by Ctrl-C after so many configurations, and notes what the progress bar is told."""

    def __init__(self, after: int | None) -> None:
        self.after = after
        self.shown: list[int] = []

    def __call__(self, done: int, total: int) -> None:
        self.shown.append(done)
        if self.after is not None and done >= self.after:
            raise KeyboardInterrupt


def run(model: RobotModel, folder: Path, after: int | None = None, options: Options = OPTIONS) -> tuple[Report | None, list[int]]:
    """One start of a run: its report, None if it was interrupted, and what was shown."""
    progress, report = Interrupter(after), None
    try:
        with Session(options, checkpoints=folder) as session:
            report = session.crosscheck(model, progress=progress)
    except KeyboardInterrupt:
        assert after is not None
    return report, progress.shown


def numbers(report: Report | None, like: Report) -> str:
    """The document outside the environment."""
    assert report is not None
    return to_json(remade(report, environment=like.environment))


def kept(folder: Path) -> Path:
    return folder / ".ur5.checkpoint"


@pytest.mark.parametrize("after", [4096, 12288, 20018])
def test_started_again_it_continues_and_ends_with_the_same_numbers(
    ur5: RobotModel, whole: Report, tmp_path: Path, after: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(ur5, tmp_path, after)[0] is None
    assert kept(tmp_path).exists()
    report, shown = run(ur5, tmp_path)
    assert shown == BLOCKS[BLOCKS.index(after) :]
    assert numbers(report, whole) == numbers(whole, whole)
    assert capsys.readouterr().err == f"note: ur5 continues an interrupted run, with {after} of 20018 configurations done\n"
    assert [p.name for p in tmp_path.iterdir() if p.name != "cache"] == []


def test_many_times_interrupted(ur5: RobotModel, tmp_path: Path) -> None:
    """A hundred thousand configurations, ended at random moments until they are done."""
    options = Options(samples=100_000, sources=SOURCES, certify=False, in_process=True, seed=3)
    with Session(options) as session:
        once = session.crosscheck(ur5)
    chance, report, starts = random.Random(5), None, 0
    total, done = 100_018, 0
    while report is None:
        report, shown = run(ur5, tmp_path, min(total, done + chance.randrange(4096, 60_000)) if starts < 3 else None, options)
        assert shown[0] == (done or 4096)
        done, starts = shown[-1], starts + 1
    assert starts == 4
    assert numbers(report, once) == numbers(once, once)


def test_a_source_that_failed_before_has_failed(ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = Bound.raw

    def failing(self: Bound, q: Array) -> Array:
        if self.engine.source == "urdf:pinocchio" and len(q) == 4096 and (q == ur5.configurations.one(0, 5000)).all(axis=1).any():
            raise EngineFailed(self.engine.source, "too hot")
        return real(self, q)

    monkeypatch.setattr(Bound, "raw", failing)
    with Session(OPTIONS) as session:
        once = session.crosscheck(ur5)
    run(ur5, tmp_path, 12288)
    report, shown = run(ur5, tmp_path)
    assert shown == BLOCKS[2:]
    assert numbers(report, once) == numbers(once, once)
    assert report is not None
    failed = next(s for s in report.sources if s.name == "urdf:pinocchio")
    assert (failed.status, failed.reason) == ("failed", "too hot (configurations 4096 to 8191)")


@pytest.mark.parametrize("after", [8192, 20018])
def test_an_engine_that_keeps_state_is_still_found(
    ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    real = Bound.raw

    def stateful(self: Bound, q: Array) -> Array:
        T = real(self, q)
        if self.engine.source == "urdf:pinocchio" and len(q) == 1:
            T[:, 1:, 0, 3] += 1e-3
        return T

    monkeypatch.setattr(Bound, "raw", stateful)
    run(ur5, tmp_path, after)
    report, _ = run(ur5, tmp_path)
    assert report is not None
    assert [str(s.verdict) for s in report.sources] == ["reference", "agrees", "keeps state"]


def test_an_engine_that_answers_otherwise_is_asked_from_the_start(
    ur5: RobotModel, whole: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = Bound.raw

    def wrong(self: Bound, q: Array) -> Array:
        T = real(self, q)
        return T + 1e-12 if self.engine.source == "urdf:pinocchio" and len(q) == 4096 else T

    with monkeypatch.context() as patch:
        patch.setattr(Bound, "raw", wrong)
        run(ur5, tmp_path, 12288)
    loads: list[str] = []

    def loading(model: RobotModel, options: Options, workers: Workers) -> Run:
        loads.append(model.name)
        return load(model, options, workers)

    monkeypatch.setattr("harness.run.robot.load", loading)
    report, shown = run(ur5, tmp_path)
    assert shown == BLOCKS
    assert numbers(report, whole) == numbers(whole, whole)
    assert len(loads) == 2  # what was asked to find out must not be what a new run starts with
    assert "does not fit: urdf:pinocchio answers otherwise than before" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"samples": 20_001}, "number of samples"),
        ({"seed": 1}, "seed"),
        ({"sources": ("urdf:pinocchio",)}, "choice of sources"),
        ({"reference": "dh:pinocchio"}, "reference"),
    ],
)
def test_one_of_other_options_is_left_alone(
    ur5: RobotModel, tmp_path: Path, change: dict[str, Any], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run(ur5, tmp_path, 12288)
    before = kept(tmp_path).read_bytes()
    fields = {name: getattr(OPTIONS, name) for name in ("samples", "sources", "certify", "in_process")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "EVERY", 1e9)  # this run is short
        report, shown = run(ur5, tmp_path, None, Options(**{**fields, **change}))
    assert report is not None
    assert shown[0] == 4096
    assert kept(tmp_path).read_bytes() == before
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith(f"note: ur5 begins from the start, {kept(tmp_path)} does not fit: it was made with another {word}")


def test_one_of_other_inputs_goes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = load_model(copied(tmp_path, "ur5"))
    run(model, tmp_path, 12288)
    path = model.folder / "dh.csv"
    path.write_text(path.read_text() + "\n")
    report, shown = run(load_model(model.folder), tmp_path)
    assert report is not None
    assert shown == BLOCKS
    assert "does not fit: the file dh.csv is not what it was\n" in capsys.readouterr().err


@pytest.mark.parametrize("what", ["_code", "_adapter_code"])
def test_the_code_is_an_input(ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    run(ur5, tmp_path, 12288)
    monkeypatch.setattr(inputs, what, lambda *_: "edited")
    assert run(ur5, tmp_path)[1] == BLOCKS


def test_a_program_that_was_built_anew_is_another(ur5: RobotModel, tmp_path: Path) -> None:
    (tmp_path / "program").write_text("1")

    def of(folder: Path) -> list[str]:
        return inputs._files(["sh", "program", "{model}/dh.csv"], folder, ur5.folder)

    before = of(tmp_path)
    assert all(before)
    (tmp_path / "program").write_text("2")
    after = of(tmp_path)
    assert [a == b for a, b in zip(before, after, strict=True)] == [True, True, True, True, False, True]


SPOILT: dict[str, Callable[[bytes], bytes]] = {
    "cut off": lambda data: data[:-100],
    "a digit changed": lambda data: data.replace(b'"next":12288', b'"next":16384'),
    "empty": lambda data: b"",
    "not ours": lambda data: b"0" * 64 + b"\n{}",
    "no line": lambda data: b"x" * 1000,
}


@pytest.mark.parametrize("kind", SPOILT)
def test_a_spoilt_one_is_dropped(
    ur5: RobotModel, whole: Report, tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run(ur5, tmp_path, 12288)
    kept(tmp_path).write_bytes(SPOILT[kind](kept(tmp_path).read_bytes()))
    report, shown = run(ur5, tmp_path)
    assert shown == BLOCKS
    assert numbers(report, whole) == numbers(whole, whole)
    assert capsys.readouterr().err.endswith("does not fit: it is damaged, or was not written here\n")


@pytest.mark.parametrize("has_a_key", [False, True])
def test_one_that_came_from_elsewhere_is_dropped(
    ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_a_key: bool
) -> None:
    """A file in a repository could else say that a table agrees."""
    run(ur5, tmp_path, 20018)
    monkeypatch.setenv("FK_CROSSCHECK_CACHE", str(tmp_path / "another user"))
    if has_a_key:
        module._key(make=True)
    assert run(ur5, tmp_path)[1] == BLOCKS


def test_one_that_a_link_leads_to_is_not_read(ur5: RobotModel, tmp_path: Path) -> None:
    run(ur5, tmp_path, 12288)
    kept(tmp_path).rename(tmp_path / "cache" / "elsewhere")
    kept(tmp_path).symlink_to("cache/elsewhere")
    assert run(ur5, tmp_path)[1] == BLOCKS
    assert (tmp_path / "cache" / "elsewhere").exists()


@pytest.mark.parametrize("kind", ["folder", "pipe", "link"])
def test_something_else_of_that_name(ur5: RobotModel, tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    if kind == "folder":
        kept(tmp_path).mkdir()
    elif kind == "pipe":
        os.mkfifo(kept(tmp_path))
    else:
        kept(tmp_path).symlink_to("/dev/zero")
    report, shown = run(ur5, tmp_path)
    assert report is not None
    assert shown == BLOCKS
    err = capsys.readouterr().err
    assert "note: ur5 begins from the start" in err
    assert ("could not be continued if interrupted" in err) == (kind == "folder")
    assert err.count("\n") == (2 if kind == "folder" else 1)


def test_it_can_be_switched_off(ur5: RobotModel, tmp_path: Path) -> None:
    run(ur5, tmp_path, 12288)
    before = kept(tmp_path).read_bytes()
    fields = {name: getattr(OPTIONS, name) for name in ("samples", "sources", "certify", "in_process")}
    off = Options(**fields, resume=False)
    assert run(ur5, tmp_path, None, off)[1] == BLOCKS
    assert kept(tmp_path).read_bytes() == before
    kept(tmp_path).unlink()
    run(ur5, tmp_path, 12288, off)
    assert not kept(tmp_path).exists()


def test_a_short_run_keeps_nothing(ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "EVERY", 60.0)
    run(ur5, tmp_path, 20018)
    assert not kept(tmp_path).exists()


def test_nothing_is_kept_unless_asked(ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KeyboardInterrupt), Session(OPTIONS) as session:
        session.crosscheck(ur5, progress=Interrupter(12288))
    assert list(tmp_path.iterdir()) == []


def test_the_file_is_the_users_own(ur5: RobotModel, tmp_path: Path) -> None:
    run(ur5, tmp_path, 4096)
    assert kept(tmp_path).stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "cache" / "checkpoint.key").stat().st_mode & 0o777 == 0o600


def test_writing_costs_little(ur5: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow the disk is: at most one part in SHARE of the time goes into checkpoints."""
    monkeypatch.setattr(module, "SHARE", 0.02)
    clock = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: clock[0])

    def slow(*_: object) -> None:
        clock[0] += 1.0

    monkeypatch.setattr(module, "replace_file", slow)
    monkeypatch.setattr(module, "_key", lambda make: b"key")
    with Workers(in_process=True) as workers:
        finished = run_robot(ur5, OPTIONS, None, workers)
        checkpoint = Checkpoints(tmp_path, to_stderr).of(finished)
        assert checkpoint.due
        assert finished.comparison is not None
        checkpoint.write(20018, finished.comparison, {"dh:numpy": np.eye(4)[None, None]})
    due = []
    for clock[0] in (50.0, 52.0):
        due.append(checkpoint.due)
    assert due == [False, True]
