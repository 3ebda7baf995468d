"""`crosscheck worker-check`: does a program speak the worker protocol."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import click
from rich.text import Text

from harness import api
from harness.cli.console import console
from harness.cli.shared import gathered, models_option, seconds
from harness.description.frames_file import EngineNames
from harness.description.model import RobotModel
from harness.engines.registry import description_of
from harness.errors import EngineFailed, EngineUnavailable
from harness.report.text import plain
from harness.run.binding import bind
from harness.run.naming import wanted_frames
from harness.run.trust import filled_in
from harness.workers import protocol
from harness.workers.conformance import Finding, examine
from harness.workers.pool import Workers
from harness.workers.process import Limits, ProcessEngine


@dataclass(frozen=True, kw_only=True)
class WorkerCheckSettings:
    """The options of `crosscheck worker-check`; timeouts in seconds."""

    robot: str
    name: str
    models: Path | None
    start_timeout: float
    block_timeout: float


@click.command("worker-check", context_settings={"ignore_unknown_options": True})
@click.argument("command", nargs=-1, required=True, metavar="-- COMMAND...", type=click.UNPROCESSED)
@click.option("--robot", default="ur5", show_default=True, help="Robot model whose description it is given.")
@click.option("--name", default="worker", show_default=True, help="Name it goes by; with urdf: in front it is given the URDF.")
@models_option
@click.option("--start-timeout", type=seconds, default=10.0, show_default=True, help="Seconds for its answer to the greeting.")
@click.option("--block-timeout", type=seconds, default=30.0, show_default=True, help="Seconds for a block of 4096.")
@gathered(WorkerCheckSettings, "settings")
def worker_check(command: tuple[str, ...], settings: WorkerCheckSettings) -> int:
    """Check that a program speaks the worker protocol, and say what is wrong. Exit code 0 if nothing is, else 1."""
    name = settings.name
    model = api.load_model(settings.robot, models=settings.models)
    greeting = protocol.greeting(description_of(name, model), wanted_frames(name, model))
    first = "answers the greeting with one line of JSON"
    with Workers(Limits(settings.start_timeout, settings.block_timeout)) as workers:
        try:
            engine = workers.start(name, filled_in(command, model.folder), greeting)
        except (EngineFailed, EngineUnavailable) as error:
            return _show([Finding(first, error.reason)])
        turning = [_turns(joint, engine, model) for joint in engine.joints]
        return _show(chain([Finding(first), _names(engine, model)], examine(engine, turning)))


def _turns(joint: str, engine: ProcessEngine, model: RobotModel) -> bool:
    """Whether a joint of the worker is revolute in the robot model, as far as the model knows it."""
    names = model.engine_names.get(engine.source, EngineNames()).joints
    own = next((ours for ours, theirs in names.items() if theirs == joint), joint)
    if own in model.table.joints:
        return model.table.kind(own) == "revolute"
    return model.urdf is not None and own in model.urdf.joints and model.urdf.joints[own].type != "prismatic"


def _names(engine: ProcessEngine, model: RobotModel) -> Finding:
    """Whether it uses the names of the robot model."""
    what = f"knows the joints and frames of {model.name}"
    try:
        bound = bind(engine, model, {})
    except EngineFailed as error:
        return Finding(what, error.reason)
    return Finding(f"{what}, all but {', '.join(bound.undeclared)}" if bound.undeclared else what)


def _show(findings: Iterable[Finding]) -> int:
    code = 0
    for finding in findings:
        text = Text("ok    " if not finding.problem else "WRONG ", style="red" if finding.problem else "green")
        text.append(plain(finding.what), style="default")
        console().print(text, soft_wrap=True)
        if finding.problem:
            console().print(Text(f"      {plain(finding.problem)}"), soft_wrap=True)
            code = 1
    return code
