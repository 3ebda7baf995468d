"""`crosscheck run`: cross-check robot models, write reports, tell the verdict."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import click

from harness import api
from harness.cli.console import console
from harness.cli.crash import attempt
from harness.cli.output import Kept, json_line
from harness.cli.shared import (
    FreshSeed,
    Quantity,
    accepted_option,
    complete_robots,
    complete_sources,
    folders_of,
    gathered,
    models_option,
    progress_bar,
    robot_words,
    seconds,
)
from harness.cli.trust import allowed, trust_option
from harness.description.locate import default_models_dir
from harness.engines.registry import REFERENCE
from harness.errors import ExitCode, InputError, command_line
from harness.rendering.engine_table import show_engine_table
from harness.rendering.files import prepare, write_index, write_report, write_summary
from harness.rendering.terminal import show
from harness.report.document import Report
from harness.report.text import plain
from harness.run.options import Options
from harness.verdict.gate import combined
from harness.workers.process import Limits


def _workers(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """NAME=COMMAND LINE of each --worker, split as a shell would."""
    pairs: list[tuple[str, tuple[str, ...]]] = []
    for value in values:
        name, equals, text = value.partition("=")
        try:
            words = tuple(shlex.split(text))
        except ValueError as error:
            raise InputError(f"not a command line: {error}", key=f"--worker {value}") from None
        if not name.isprintable() or not name or not equals or not words:
            raise InputError(f"expected NAME=COMMAND, got {value!r}", key="--worker")
        if name in dict(pairs):
            raise InputError(f"{name!r} is there twice", key="--worker")
        pairs.append((name, words))
    return tuple(pairs)


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """The arguments and options of `crosscheck run`; timeouts in seconds, the memory limit in GiB."""

    robots: tuple[str, ...]
    models: Path | None
    sources: tuple[str, ...]
    all_engines: bool
    workers: tuple[tuple[str, tuple[str, ...]], ...]
    reference: str
    samples: int
    certify: bool
    explain: bool
    seed: int
    probe_seed: int
    out: Path
    accepted: Path
    strict: bool
    jobs: int
    resume: bool
    start_timeout: float
    block_timeout: float
    memory_limit: float
    in_process: bool
    trust: bool
    quiet: bool
    as_json: bool

    @property
    def silent(self) -> bool:
        """Whether people read nothing of it: no progress, no tables."""
        return self.quiet or self.as_json

    def options(self) -> Options:
        """What every robot is cross-checked with. Raises InputError for numbers that cannot be."""
        return Options(
            samples=self.samples,
            seed=self.seed,
            probe_seed=self.probe_seed,
            sources=self.sources,
            reference=self.reference,
            certify=self.certify,
            explain=self.explain,
            all_engines=self.all_engines,
            workers=self.workers,
            limits=Limits(self.start_timeout, self.block_timeout, self.memory_limit * 2**30),
            jobs=self.jobs,
            in_process=self.in_process,
            trust=self.trust,
            accepted=self.accepted,
            strict=self.strict,
            resume=self.resume,
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
@click.option(
    "--certify/--no-certify",
    default=True,
    show_default=True,
    help="Prove how far the two files can be apart, and test each engine against its own.",
)
@click.option("--explain/--no-explain", default=True, show_default=True, help="Look for the cause of each disagreement.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random configurations.")
@click.option(
    "--probe-seed",
    type=FreshSeed(),
    default=0,
    show_default=True,
    metavar="N|fresh",
    help="Seed of the configurations at which each engine is tested against its own description; fresh: a new one.",
)
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder for the reports."
)
@accepted_option
@click.option("--strict", is_flag=True, help="Fail if a discrepancy grew since it was accepted, by more than the noise floor.")
@click.option("--resume/--no-resume", default=True, show_default=True, help="Continue an interrupted run of the same inputs.")
@click.option("--jobs", type=int, default=0, help="Engines that compute at a time.  [default: one a core]")
@click.option("--start-timeout", type=seconds, default=Limits.start, show_default=True, help="Seconds for an engine to start.")
@click.option("--block-timeout", type=seconds, default=Limits.block, show_default=True, help="Seconds for 4096 configurations.")
@click.option("--memory-limit", type=Quantity(1e9), default=Limits.memory / 2**30, show_default=True, help="GiB for each engine.")
@click.option("--in-process", is_flag=True, help="Run the engines in this process, for debugging: no limits hold.")
@trust_option
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors; the exit code tells.")
@click.option("--json", "as_json", is_flag=True, help="Print each report as one line of JSON.")
@gathered(RunSettings, "settings")
def run(settings: RunSettings) -> int:
    """Cross-check robot models (names, or folders with a model.toml; none: all) and write reports.

    Exit code: 0 all agree, 1 a disagreement, 2 wrong input, 3 a required source is missing or failed, 70 a fault of
    crosscheck itself. If several apply: 1 before all, then 70, 2, 3. What ends one robot does not end the others.
    """
    options = settings.options()
    folders = folders_of(settings.robots, settings.models or default_models_dir())
    prepare(settings.out)
    tally = Tally()
    others = [attempt(lambda: _each(folders, options, settings, tally)), attempt(lambda: _write_index(settings))]
    if not settings.silent:
        others.append(attempt(lambda: _show_total(tally, settings)))
    return Kept(combined([*tally.codes, *others]))


def _write_index(settings: RunSettings) -> None:
    """Write the index. What it leaves out is told, unless nothing but errors is wanted."""
    if settings.quiet:
        write_index(settings.out, lambda line: None)
    else:
        write_index(settings.out)


@dataclass
class Tally:
    """What became of the robots so far.

    names: the folder of each robot name.
    codes: the exit code of each robot, in order.
    reports: their reports, as far as there are any.
    faults: folders of the robots that a fault of the harness ended.
    """

    names: dict[str, Path] = field(default_factory=dict)
    codes: list[int] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def _each(folders: Sequence[Path], options: Options, settings: RunSettings, tally: Tally) -> None:
    """Cross-check one robot after the other. What goes wrong with one is told, and ends that one."""
    with api.Session(options, checkpoints=settings.out) as session:
        for folder in folders:
            codes: list[int] = []
            codes.append(attempt(partial(_one, session, folder, settings, tally, codes), folder.name))
            tally.codes.append(combined(codes))
            if ExitCode.INTERNAL in codes:
                tally.faults.append(folder.name)


def _one(session: api.Session, folder: Path, settings: RunSettings, tally: Tally, codes: list[int]) -> None:
    """Cross-check one robot, write its reports and print its verdict. Its verdict goes to `codes` as soon as it is known."""
    model = api.load_model(folder)
    if model.name in tally.names:
        raise InputError(f"robot name {model.name!r} is also that of {tally.names[model.name]}", where=folder)
    tally.names[model.name] = folder
    command = _command(folder, settings.models, session.options)
    options = allowed(model, session.options.reproduced_by(command), command, settings.silent)
    with progress_bar(model.name, settings.silent) as advance:
        report = session.crosscheck(model, progress=advance, options=options)
    codes.append(report.verdict.exit_code)
    tally.reports.append(report)
    for work in (partial(write_report, report, settings.out), partial(write_summary, report), partial(_print, report, settings)):
        codes.append(attempt(work, folder.name))


def _show_total(tally: Tally, settings: RunSettings) -> None:
    """Print the last line, after the table of the engines if all of them ran."""
    if settings.all_engines:
        show_engine_table(tally.reports, console())
    parts = [f"{tally.codes.count(0)} of {len(tally.codes)} robots agree"]
    if tally.faults:
        parts.append(f"{len(tally.faults)} ended by a fault of the harness: {', '.join(tally.faults)}")
    console().print(plain("; ".join([*parts, f"reports in {settings.out}"])), markup=False)


def _command(folder: Path, models: Path | None, options: Options) -> str:
    """The command line that gives the same numbers, and the same verdict."""
    words = ["crosscheck", "run", *robot_words(folder, models)]
    for source in options.sources:
        words += ["--source", source]
    words += ["--all-engines"] if options.all_engines else []
    for name, command in options.workers:
        words += ["--worker", f"{name}={shlex.join(command)}"]
    if options.reference != REFERENCE:
        words += ["--reference", options.reference]
    words += ["--samples", str(options.samples), "--seed", str(options.seed)]
    words += ["--probe-seed", str(options.probe_seed)] if options.probe_seed and options.certify else []
    flags = {"--no-certify": not options.certify, "--no-explain": not options.explain, "--strict": options.strict}
    words += [flag for flag, wanted in flags.items() if wanted]
    return command_line(words)


def _print(report: Report, settings: RunSettings) -> None:
    if settings.as_json:
        click.echo(json_line(report.model_dump_json()))
    elif not settings.quiet:
        out = console()
        show(report, out)
        out.print()
