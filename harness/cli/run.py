"""`crosscheck run`: cross-check robot models, write reports, tell the verdict."""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import click
from click.shell_completion import CompletionItem
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from harness.cli.console import complain, console
from harness.description.locate import default_models_dir, find_model, model_folders
from harness.description.model import load_model
from harness.engines.registry import REFERENCE, registered
from harness.errors import CrosscheckError, InputError
from harness.rendering.engine_table import show_engine_table
from harness.rendering.files import prepare, write_index, write_report, write_summary
from harness.rendering.terminal import show
from harness.report.document import Report
from harness.report.text import plain
from harness.run.options import Options
from harness.verdict.accepted import FOLDER, AcceptedNumbers, read_accepted
from harness.verdict.crosscheck import crosscheck
from harness.verdict.gate import combined
from harness.workers.process import Limits


def complete_robots(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of the robot models that begin like that."""
    folders = model_folders(ctx.params.get("models") or default_models_dir())
    return [CompletionItem(name) for name in folders if name.startswith(incomplete)]


def complete_sources(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of the engines that begin like that."""
    return [CompletionItem(name) for name in registered() if name.startswith(incomplete)]


def _workers(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """NAME=COMMAND LINE of each --worker, split as a shell would."""
    pairs: list[tuple[str, tuple[str, ...]]] = []
    for value in values:
        name, equals, text = value.partition("=")
        try:
            words = tuple(shlex.split(text))
        except ValueError as error:
            raise InputError(f"not a command line: {error}", key=f"--worker {value}") from None
        if not name or not equals or not words:
            raise InputError(f"expected NAME=COMMAND, got {value!r}", key="--worker")
        if name in dict(pairs):
            raise InputError(f"{name!r} is there twice", key="--worker")
        pairs.append((name, words))
    return tuple(pairs)


models_option = click.option(
    "--models",
    type=click.Path(path_type=Path),
    help="Folder of robot models.  [default: the models that come with the package]",
)

accepted_option = click.option(
    "--accepted",
    type=click.Path(path_type=Path),
    default=Path("reports") / FOLDER,
    show_default=True,
    help="Folder of the accepted numbers.",
)


@click.command()
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=complete_robots)
@models_option
@click.option(
    "--source",
    "sources",
    multiple=True,
    shell_complete=complete_sources,
    help="Compare only this source; repeat for more. It is then required.  [default: those of model.toml]",
)
@click.option("--all-engines", is_flag=True, help="Also run every other engine there is; they are not required.")
@click.option(
    "--worker",
    "workers",
    multiple=True,
    metavar="NAME=COMMAND",
    callback=_workers,
    help="Also compare a program that speaks the worker protocol; {model} in it is the model's folder. It is required.",
)
@click.option(
    "--reference",
    default=REFERENCE,
    show_default=True,
    shell_complete=complete_sources,
    help="Source that the others are compared with.",
)
@click.option("--samples", type=int, default=2000, show_default=True, help="Random configurations, besides the fixed ones.")
@click.option("--certify/--no-certify", default=True, show_default=True, help="Prove a bound for all configurations.")
@click.option("--explain/--no-explain", default=True, show_default=True, help="Look for the cause of each disagreement.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random configurations.")
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder for the reports."
)
@accepted_option
@click.option("--strict", is_flag=True, help="Fail if a discrepancy grew since it was accepted, by more than the noise floor.")
@click.option("--jobs", type=int, default=0, help="Engines that compute at a time.  [default: one a core]")
@click.option("--start-timeout", type=float, default=Limits.start, show_default=True, help="Seconds for an engine to start.")
@click.option("--block-timeout", type=float, default=Limits.block, show_default=True, help="Seconds for 4096 configurations.")
@click.option("--memory-limit", type=float, default=Limits.memory / 2**30, show_default=True, help="GiB for each engine.")
@click.option("--in-process", is_flag=True, help="Run the engines in this process, for debugging: no limits hold.")
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors; the exit code tells.")
@click.option("--json", "as_json", is_flag=True, help="Print each report as one line of JSON.")
def run(
    robots: tuple[str, ...],
    models: Path | None,
    sources: tuple[str, ...],
    all_engines: bool,
    workers: tuple[tuple[str, tuple[str, ...]], ...],
    reference: str,
    samples: int,
    certify: bool,
    explain: bool,
    seed: int,
    out: Path,
    accepted: Path,
    strict: bool,
    jobs: int,
    start_timeout: float,
    block_timeout: float,
    memory_limit: float,
    in_process: bool,
    quiet: bool,
    as_json: bool,
) -> int:
    """Cross-check robot models (names, or folders with a model.toml; none: all) and write reports.

    Exit code: 0 all agree, 1 a disagreement, 2 wrong input, 3 a required source is missing or failed; with several of
    these, the smallest.
    """
    limits = Limits(start_timeout, block_timeout, memory_limit * 2**30)
    options = Options(
        samples=samples,
        seed=seed,
        sources=sources,
        reference=reference,
        command="",
        certify=certify,
        explain=explain,
        all_engines=all_engines,
        workers=workers,
        limits=limits,
        jobs=jobs,
        in_process=in_process,
        strict=strict,
    )
    folders = folders_of(robots, models or default_models_dir())
    prepare(out)
    codes: list[int] = []
    names: dict[str, Path] = {}
    reports: list[Report] = []
    with options.worker_pool() as pool:
        for folder in folders:
            try:
                model = load_model(folder)
                if model.name in names:
                    raise InputError(f"robot name {model.name!r} is also that of {names[model.name]}", where=folder)
                names[model.name] = folder
                on_file = _on_file(accepted / f"{model.name}.json", strict)
                with progress_bar(model.name, quiet or as_json) as advance:
                    command = _command(folder, models, options, strict)
                    report = crosscheck(model, options.reproduced_by(command), advance, pool, on_file)
                write_report(report, out)
                write_summary(report)
                _tell(report, quiet, as_json)
                reports.append(report)
                codes.append(report.verdict.exit_code)
            except CrosscheckError as error:  # this robot's input is wrong: the others are still checked
                complain(error)
                codes.append(error.exit_code)
    write_index(out)
    if not quiet and not as_json:
        if all_engines:
            show_engine_table(reports, console())
        console().print(f"{codes.count(0)} of {len(codes)} robots agree; reports in {plain(str(out))}", markup=False)
    return combined(codes)


def folders_of(robots: tuple[str, ...], models: Path) -> list[Path]:
    """The folders of the robots asked for; all of `models`, if none."""
    if not robots:
        return list(model_folders(models).values())
    return list(dict.fromkeys(find_model(robot, models) for robot in robots))


def _on_file(path: Path, strict: bool) -> AcceptedNumbers | None:
    """The accepted numbers, before any work is done. Raises InputError if they are wrong, or not there and `strict`."""
    return read_accepted(path) if strict or path.exists() else None


def _command(folder: Path, models: Path | None, options: Options, strict: bool) -> str:
    """The command line that gives the same numbers, and the same verdict."""
    inside = folder.parent == (models or default_models_dir())
    words = ["crosscheck", "run", folder.name if inside else str(folder)]
    if models is not None and inside:
        words += ["--models", str(models)]
    for source in options.sources:
        words += ["--source", source]
    words += ["--all-engines"] if options.all_engines else []
    for name, command in options.workers:
        words += ["--worker", f"{name}={shlex.join(command)}"]
    if options.reference != REFERENCE:
        words += ["--reference", options.reference]
    words += ["--samples", str(options.samples), "--seed", str(options.seed)]
    for option, wanted in (("--no-certify", not options.certify), ("--no-explain", not options.explain), ("--strict", strict)):
        words += [option] if wanted else []
    return shlex.join(words)


@contextlib.contextmanager
def progress_bar(name: str, silent: bool) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr for one robot; none when piped, in CI or when silent."""
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeRemainingColumn(),
        console=console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty() or bool(os.environ.get("CI")) or silent,
    )
    with bar:
        task = bar.add_task(plain(name), total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _tell(report: Report, quiet: bool, as_json: bool) -> None:
    if as_json:
        click.echo(report.model_dump_json())
    elif not quiet:
        out = console()
        show(report, out)
        out.print()
