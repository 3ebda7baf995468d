"""`crosscheck engines`, `crosscheck engines install` and `crosscheck worker-check`."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import click
from rich.text import Text

from harness.cli.console import console
from harness.cli.frames import show_engines
from harness.cli.run import complete_sources, models_option
from harness.description.frames_file import EngineNames
from harness.description.locate import default_models_dir, find_model
from harness.description.model import RobotModel, load_model
from harness.engines.base import Engine
from harness.engines.registry import adapter_of, description_of, registered
from harness.errors import EngineFailed, EngineUnavailable, InputError
from harness.report.text import plain
from harness.run.binding import bind
from harness.run.naming import wanted_frames
from harness.workers import protocol
from harness.workers.conformance import Finding, examine
from harness.workers.environments import cache_folder
from harness.workers.install import install
from harness.workers.pool import Workers
from harness.workers.process import Limits, ProcessEngine


@click.group(invoke_without_command=True)
@click.pass_context
def engines(ctx: click.Context) -> int:
    """Show which engines are installed, their versions, how to install the others, and their traits."""
    return show_engines(console()) if ctx.invoked_subcommand is None else 0


@engines.command("install")
@click.argument("names", nargs=-1, metavar="[NAME]...", shell_complete=complete_sources)
@click.option("--all", "everything", is_flag=True, help="Every engine there is.")
@click.option(
    "--constraint", "-c", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Constraints file for pip."
)
def install_command(names: tuple[str, ...], everything: bool, constraint: Path | None) -> int:
    """Install engines, each in an environment where it does not disturb the others. Exit code 3 if one could not be."""
    if bool(names) == everything:
        raise InputError("expected names of engines, or --all", hint="crosscheck engines lists them")
    adapters: list[type[Engine]] = []
    missing = 0
    for name in registered() if everything else names:
        try:
            adapters.append(adapter_of(name))
        except EngineUnavailable as error:
            _say(f"{name}: NOT INSTALLED: {error.reason}")
            missing += 1
    done = install(adapters, constraint.resolve() if constraint else None, _say)
    missing += sum(bool(entry.problem) for entry in done.values())
    _say(f"{len(done) - missing} of {len(done)} engines installed; environments in {cache_folder()}")
    return 3 if missing else 0


def _say(text: str) -> None:
    console().print(plain(text), markup=False, soft_wrap=True)


@click.command("worker-check", context_settings={"ignore_unknown_options": True})
@click.argument("command", nargs=-1, required=True, metavar="-- COMMAND...", type=click.UNPROCESSED)
@click.option("--robot", default="ur5", show_default=True, help="Robot model whose description it is given.")
@click.option("--name", default="worker", show_default=True, help="Name it goes by; with urdf: in front it is given the URDF.")
@models_option
@click.option("--start-timeout", type=float, default=10.0, show_default=True, help="Seconds for its answer to the greeting.")
@click.option("--block-timeout", type=float, default=30.0, show_default=True, help="Seconds for a block of 4096.")
def worker_check(
    command: tuple[str, ...], robot: str, name: str, models: Path | None, start_timeout: float, block_timeout: float
) -> int:
    """Check that a program speaks the worker protocol, and say what is wrong. Exit code 0 if nothing is, else 1."""
    model = load_model(find_model(robot, models or default_models_dir()))
    words = [word.replace("{model}", str(model.folder.resolve())) for word in command]
    greeting = protocol.greeting(description_of(name, model), wanted_frames(name, model))
    first = "answers the greeting with one line of JSON"
    with Workers(Limits(start_timeout, block_timeout)) as workers:
        try:
            engine = workers.start(name, words, greeting)
        except (EngineFailed, EngineUnavailable) as error:
            return _tell([Finding(first, error.reason)])
        turning = [_turns(joint, engine, model) for joint in engine.joints]
        return _tell(chain([Finding(first), _names(engine, model)], examine(engine, turning)))


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


def _tell(findings: Iterable[Finding]) -> int:
    code = 0
    for finding in findings:
        text = Text("ok    " if not finding.problem else "WRONG ", style="red" if finding.problem else "green")
        text.append(plain(finding.what), style="default")
        console().print(text, soft_wrap=True)
        if finding.problem:
            console().print(Text(f"      {plain(finding.problem)}"), soft_wrap=True)
            code = 1
    return code
