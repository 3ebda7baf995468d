"""Engines in processes of their own: every way one can fail is its result, the run goes on, and nothing is left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import psutil
import pytest

from harness.description.model import RobotModel, load_model
from harness.engines.dh_numpy import DHNumpy
from harness.engines.dh_pinocchio import DHPinocchio
from harness.errors import InputError
from harness.rendering.files import write_report
from harness.report.document import Report, Source
from harness.report.json_file import read_report
from harness.report.verdicts import Verdict
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck
from harness.workers.pool import Workers
from harness.workers.process import Limits
from tests.helpers import assert_placements_close

WORKER = str(Path(__file__).parent / "faulty_worker.py")
LIMITS = Limits(start=10.0, block=8.0, memory=400 << 20)
SAMPLES = 9000  # three blocks


def with_fault(model: RobotModel, fault: str, **options: object) -> Report:
    workers = (("controller", (sys.executable, WORKER, fault)),)
    sources = ("dh:pinocchio",)
    defaults = {"samples": SAMPLES, "sources": sources, "workers": workers, "limits": LIMITS, "certify": False, "explain": False}
    return crosscheck(model, Options(**{**defaults, **options}))  # type: ignore[arg-type]


def named(report: Report, name: str) -> Source:
    return next(s for s in report.sources if s.name == name)


def below() -> list[psutil.Process]:
    """What this process has started and what runs on, directly or further down."""
    return [p for p in psutil.Process().children(recursive=True) if p.status() != psutil.STATUS_ZOMBIE]


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    before = {p.pid for p in below()}
    yield
    left = [p for p in below() if p.pid not in before]
    assert not left, [p.cmdline() for p in left]


@pytest.mark.parametrize(
    ("fault", "verdict", "code", "reason"),
    [
        ("none", "agrees", 0, ""),
        ("floods stderr", "agrees", 0, ""),
        ("does not end", "agrees", 0, ""),
        ("negative seconds", "agrees", 0, ""),
        ("endless seconds", "agrees", 0, ""),
        ("answers before it has read", "agrees", 0, ""),
        ("has the flange only", "agrees", 0, ""),
        ("misspells a frame", "failed", 3, "has a frame 'thre': "),
        ("answers with a list", "failed", 3, "expected its answer, a JSON object, got '[1]'"),
        ("refuses without words", "failed", 3, "refused, but not why"),
        ("refuses in unwritable letters", "failed", 3, "boom"),
        ("names half a letter", "failed", 3, "half of a surrogate pair"),
        ("writes unwritable letters to stderr", "failed", 3, "exited with code 5"),
        ("leaves a daemon", "failed", 3, "exited with code 7"),
        ("killed by a nameless signal", "failed", 3, "killed by signal 35"),
        ("exits at once", "failed", 3, "at the start: exited with code 7; stderr ends: no licence found"),
        ("sleeps at the start", "failed", 3, "at the start: did not answer within 10 s"),
        ("sleeps at the start with a child", "failed", 3, "at the start: did not answer within 10 s"),
        ("prints rubbish", "failed", 3, "got 'Loading controller firmware v3 ...': does it print to stdout?"),
        ("refuses", "failed", 3, "this controller is for another robot"),
        ("another version", "failed", 3, "version: expected 1, the version this harness speaks, got 2"),
        ("no end of line", "failed", 3, "expected one line of JSON, got"),
        ("exits in a block", "failed", 3, "exited with code 3 after 108 of"),
        ("segfaults", "failed", 3, "killed by SIGSEGV (Segmentation fault); stderr ends: about to read address 0"),
        ("aborts", "failed", 3, "killed by SIGABRT (Aborted)"),
        ("sleeps in a block", "failed", 3, "did not answer within 8 s"),
        ("prints in a block", "failed", 3, "expected the count 823, got 'warning:': does it print to stdout?"),
        ("closes stdout", "failed", 3, "closed its stdout and went on running"),
        ("allocates without end", "failed", 3, "iB of memory, 400 MiB are allowed"),
        ("allocates in a child", "failed", 3, "iB of memory, 400 MiB are allowed"),
        ("reports a failure", "failed", 3, "joint 3 outside its limits"),
        ("big-endian", "failed", 3, "write little-endian"),
        ("float32", "failed", 3, "expected the count 4096 as float64, got it as float32"),
        ("too few frames", "failed", 3, "did not answer within 8 s after"),
        ("too many frames", "failed", 3, "bytes more than it was asked for"),
        ("nan", "invalid placements", 1, ""),
        ("not a rotation", "invalid placements", 1, ""),
        ("column-major", "invalid placements", 1, ""),
        ("the previous block", "keeps state", 1, ""),
    ],
)
def test_faults(models: dict[str, RobotModel], tmp_path: Path, fault: str, verdict: str, code: int, reason: str) -> None:
    """The right verdict, in bounded time; the other source is compared, the report is complete."""
    start = time.monotonic()
    report = with_fault(models["ur3"], fault)
    assert time.monotonic() - start < 60.0
    controller = named(report, "controller")
    assert (controller.verdict, report.verdict.exit_code) == (verdict, code)
    assert reason in controller.reason
    if verdict == "failed" and "at the start" not in reason and "version" not in reason and "block" in fault:
        assert "(configurations 8192 to 9014)" in controller.reason
    assert named(report, "dh:pinocchio").verdict is Verdict.AGREES
    write_report(report, tmp_path)
    assert read_report(tmp_path / "ur3.json") == report
    ElementTree.parse(tmp_path / "ur3.junit.xml")


def in_model_toml(copy_model: Callable[..., Path], fault: str, frames: str = "") -> RobotModel:
    command = f'command = ["{sys.executable}", "{WORKER}", "{fault}"]'
    source = f'[[source]]\nname = "controller"\n{command}\n\n[[source]]\nname = "dh:pinocchio"\n'
    folder = copy_model("ur3", ("model.toml", '[[source]]\nname = "dh:pinocchio"\n', source))
    with (folder / "frames.toml").open("a") as file:
        file.write(frames)
    return load_model(folder)


def test_frames_that_a_program_does_not_have(models: dict[str, RobotModel], copy_model: Callable[..., Path]) -> None:
    """Given by hand, the verdict names them; in model.toml they must be declared; a reference must have all."""
    options = {"samples": 10, "sources": ("dh:pinocchio", "controller"), "certify": False, "trust": True}
    by_hand = with_fault(models["ur3"], "has the flange only", samples=10)
    assert "controller was compared without base, base_link, world, shoulder_link," in by_hand.verdict.sentence
    model = in_model_toml(copy_model, "has the flange only")
    refused = crosscheck(model, Options(**options))  # type: ignore[arg-type]
    assert refused.verdict.exit_code == 3
    assert 'if that is meant: frames.toml, [engine."controller"] without = [' in named(refused, "controller").reason
    lacking = ", ".join(f'"{frame.name}"' for frame in model.frames.frames if frame.dh != "6")
    with (model.folder / "frames.toml").open("a") as file:
        file.write(f'[engine."controller"]\nwithout = [{lacking}]\n')
    assert crosscheck(load_model(model.folder), Options(**options)).verdict.exit_code == 0  # type: ignore[arg-type]
    reference = with_fault(models["ur3"], "has the flange only", samples=10, reference="controller")
    assert reference.verdict.exit_code == 3
    assert "controller is required and failed: cannot be the reference: it does not have base," in reference.verdict.sentence


def test_one_that_dies_while_it_is_certified_has_failed(models: dict[str, RobotModel]) -> None:
    report = with_fault(models["ur3"], "dies beyond the limits", samples=10, certify=True)
    assert (named(report, "controller").verdict, report.verdict.exit_code) == ("failed", 3)
    assert "exited with code 9" in named(report, "controller").reason
    assert named(report, "dh:pinocchio").verdict is Verdict.AGREES


def test_a_narrow_pipe(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    """q does not fit the pipe, and the answer begins before it is read."""
    monkeypatch.setattr("harness.workers.child._widen", lambda fd: None)
    assert with_fault(models["ur3"], "answers before it has read", samples=4096).verdict.exit_code == 0


def test_nothing_is_held_of_robots_that_are_done(models: dict[str, RobotModel]) -> None:
    """Neither processes nor pipes, of programs that ran, failed or were refused; engines wait for the next robot."""
    open_files = psutil.Process().num_fds
    with Workers(LIMITS) as workers:
        counts = []
        for fault in ("none", "refuses", "misspells a frame", "none", "exits at once"):
            options = Options(
                samples=5,
                seed=0,
                sources=("dh:pinocchio",),
                certify=False,
                workers=(("controller", (sys.executable, WORKER, fault)),),
            )
            crosscheck(models["ur3"], options, None, workers)
            counts.append((open_files(), len([p for p in below() if WORKER in " ".join(p.cmdline())])))
        assert not any(programs for _, programs in counts)
        # The thread that watches the memory has a file of /proc open now and then; each leak would be four more.
        assert max(files for files, _ in counts) <= counts[0][0] + 2


def test_an_optional_one_that_fails_does_not_fail_the_gate_and_is_named(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur3")
    sources = f'[[source]]\nname = "controller"\nrequired = false\ncommand = ["{sys.executable}", "{WORKER}", "exits at once"]\n'
    text = (folder / "model.toml").read_text().split("[[source]]")[0]
    (folder / "model.toml").write_text(f'{text}{sources}[[source]]\nname = "dh:pinocchio"\n')
    report = crosscheck(load_model(folder), Options(samples=100, certify=False, trust=True))
    assert report.verdict.exit_code == 0
    assert "failed: controller" in report.verdict.sentence
    assert "no licence found" in named(report, "controller").reason


def test_a_failing_reference_leaves_nothing_verified(models: dict[str, RobotModel]) -> None:
    report = with_fault(models["ur3"], "aborts", reference="controller")
    assert report.verdict.exit_code == 3
    assert "SIGABRT" in report.verdict.sentence


def test_a_command_that_is_not_there(models: dict[str, RobotModel]) -> None:
    report = with_fault(models["ur3"], "", workers=(("controller", ("no-such-program",)),))
    assert "cannot start 'no-such-program'" in named(report, "controller").reason
    assert report.verdict.exit_code == 3


def test_in_process_starts_nothing(models: dict[str, RobotModel]) -> None:
    before = len(below())
    report = crosscheck(
        models["ur3"], Options(samples=10, sources=("dh:pinocchio",), in_process=True), lambda done, total: in_run(before)
    )
    assert report.verdict.exit_code == 0


def in_run(expected: int) -> None:
    assert len(below()) == expected


def test_a_worker_serves_one_robot_after_the_other(models: dict[str, RobotModel]) -> None:
    """The same process; and after it has died, another."""
    others = {p.pid for p in below()}
    with Workers() as workers:
        served = []
        for robot in ("ur3", "panda", "stanford"):
            description = models[robot].table
            engine = workers.load(DHPinocchio, description, description.frames)
            q = np.full((3, len(description.joints)), 0.3)
            assert_placements_close(engine.placements(q, engine.frames), DHNumpy(description).placements(q, engine.frames), 1e-13)
            workers.settle([engine])
            (worker,) = (p for p in below() if p.pid not in others and "worker.py" in " ".join(p.cmdline()))
            served.append(worker.pid)
            if robot == "panda":
                worker.kill()
                worker.wait(10.0)
        assert served[0] == served[1] != served[2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"jobs": -1}, "expected jobs >= 0"),
        ({"start": 0.0}, "expected a start timeout above 0"),
        ({"block": float("nan")}, "expected a block timeout above 0"),
        ({"memory": float("inf")}, "expected a memory limit above 0"),
    ],
)
def test_impossible_options(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Options(**options) if "jobs" in options else Limits(**options)


@pytest.mark.parametrize(
    ("fault", "code", "text"),
    [
        ("none", 0, "ok    ends with exit code 0 when its stdin ends"),
        ("prints rubbish", 1, "does it print to stdout?"),
        ("big-endian", 1, "write little-endian"),
        ("column-major", 1, "the last column is 0 0 0 1 instead: write rows first, or transpose each matrix"),
        ("nan", 1, "WRONG placements are finite"),
        ("not a rotation", 1, "WRONG rotations are rotations"),
        ("the previous block", 1, "it keeps state, or orders them by frame first"),
        ("too many frames", 1, "more than it was asked for"),
        ("segfaults", 1, "killed by SIGSEGV"),
        ("does not end", 1, "it went on running for 5 s"),
        ("talks at the end", 0, "ok    ends with exit code 0 when its stdin ends"),
        ("clamps", 1, "a whole turn more of every joint changes a placement"),
        ("misspells a frame", 1, "has a frame 'thre'"),
        ("has the flange only", 0, "ok    knows the joints and frames of ur5, all but base, base_link"),
    ],
)
def test_worker_check(cli: Callable[..., subprocess.CompletedProcess[str]], fault: str, code: int, text: str) -> None:
    result = cli("worker-check", "--start-timeout", "20", "--block-timeout", "5", "--", sys.executable, WORKER, fault)
    assert result.returncode == code, result.stdout + result.stderr
    assert text in result.stdout
    assert result.stderr == ""


def descendants(pid: int) -> list[psutil.Process]:
    return psutil.Process(pid).children(recursive=True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("fault", ["sleeps in a block", "sleeps at the start with a child"])
def test_no_orphan_however_the_harness_ends(tmp_path: Path, number: signal.Signals, fault: str) -> None:
    worker = f"controller={sys.executable} {WORKER} '{fault}'"
    sources = ["--source", "dh:pinocchio", "--source", "urdf:pinocchio"]
    command = [sys.executable, "-m", "harness", "run", "ur3", *sources, "--samples", "20000", "--worker", worker]
    harness = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True)
    try:
        wanted = 5 if "child" in fault else 4  # two engines, the controller and the warden; and the controller's child
        wait_for(lambda: len(descendants(harness.pid)) >= wanted)
        time.sleep(1.0)
        started = descendants(harness.pid)
        assert any(WORKER in " ".join(p.cmdline()) for p in started)
        os.kill(harness.pid, number)
        harness.wait(20.0)
        wait_for(lambda: not [p for p in started if p.is_running() and p.status() != psutil.STATUS_ZOMBIE])
    finally:
        harness.kill()
        _, error = harness.communicate()
    if number == signal.SIGINT:
        assert harness.returncode == 130
        assert error.decode().strip() == "interrupted: reports written before are unchanged"


def wait_for(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)
