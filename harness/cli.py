"""The command `crosscheck`. Exit codes: 0 agreement, 1 disagreement, 2 wrong input, 3 a required source missing, 130 Ctrl-C."""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem, get_completion_class
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as ProgressBar

from harness import __version__
from harness.cli_derive import derive_dh, export_urdf_command
from harness.console import console
from harness.crosscheck import Progress, crosscheck
from harness.description.locate import default_models_dir, find_model, model_folders
from harness.description.model import load_model
from harness.engines.registry import REFERENCE, registered
from harness.errors import CrosscheckError, InputError
from harness.overview import show_engines, show_frames
from harness.report.document import Report
from harness.report.files import prepare, write_index, write_rendered, write_report
from harness.report.json_file import read_report
from harness.report.terminal import show
from harness.report.text import plain
from harness.results import Options


def _robots(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    folders = model_folders(ctx.params.get("models") or default_models_dir())
    return [CompletionItem(name) for name in folders if name.startswith(incomplete)]


def _sources(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(name) for name in registered() if name.startswith(incomplete)]


models_option = click.option(
    "--models",
    type=click.Path(path_type=Path),
    help="Folder of robot models.  [default: the models that come with the package]",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="crosscheck")
def cli() -> None:
    """Cross-validate a robot's DH table against its URDF with every FK engine installed."""


@cli.command()
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=_robots)
@models_option
@click.option(
    "--source",
    "sources",
    multiple=True,
    shell_complete=_sources,
    help="Compare only this source; repeat for more. It is then required.  [default: those of model.toml]",
)
@click.option(
    "--reference",
    default=REFERENCE,
    show_default=True,
    shell_complete=_sources,
    help="Source that the others are compared with.",
)
@click.option("--samples", type=int, default=2000, show_default=True, help="Random configurations, besides the fixed ones.")
@click.option("--certify/--no-certify", default=True, show_default=True, help="Prove a bound for all configurations.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random configurations.")
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder for the reports."
)
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors; the exit code tells.")
@click.option("--json", "as_json", is_flag=True, help="Print each report as one line of JSON.")
def run(
    robots: tuple[str, ...],
    models: Path | None,
    sources: tuple[str, ...],
    reference: str,
    samples: int,
    seed: int,
    certify: bool,
    out: Path,
    quiet: bool,
    as_json: bool,
) -> int:
    """Cross-check robot models (names, or folders with a model.toml; none: all) and write reports.

    Exit code: 0 all agree, 1 a disagreement, 2 wrong input, 3 a required source is missing or failed; with several of
    these, the smallest.
    """
    folders = _folders(robots, models or default_models_dir())
    prepare(out)
    codes: list[int] = []
    names: dict[str, Path] = {}
    for folder in folders:
        try:
            model = load_model(folder)
            if model.name in names:
                raise InputError(f"robot name {model.name!r} is also that of {names[model.name]}", where=folder)
            names[model.name] = folder
            command = _command(folder, models, samples, seed, sources, reference, certify)
            with _progress(model.name, quiet or as_json) as advance:
                report = crosscheck(model, Options(samples, seed, sources, reference, command, certify), advance)
            write_report(report, out)
            _tell(report, quiet, as_json)
            codes.append(report.verdict.exit_code)
        except CrosscheckError as error:  # this robot's input is wrong: the others are still checked
            _complain(error)
            codes.append(error.exit_code)
    write_index(out)
    if not quiet and not as_json:
        console().print(f"{codes.count(0)} of {len(codes)} robots agree; reports in {plain(str(out))}", markup=False)
    return min((code for code in codes if code), default=0)


@cli.command()
@click.argument("robot", metavar="ROBOT|URDF", shell_complete=_robots)
@models_option
def frames(robot: str, models: Path | None) -> int:
    """Show the frame tree: joint types, axes, and what each frame is mapped to."""
    return show_frames(robot, models or default_models_dir(), console())


@cli.command()
def engines() -> int:
    """Show which engines are installed, their versions, how to install the others, and their traits."""
    return show_engines(console())


@cli.command()
@click.argument("report", type=click.Path(path_type=Path), metavar="REPORT.json")
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write to.  [default: beside the report]")
def render(report: Path, out: Path | None) -> int:
    """Render HTML, Markdown and JUnit from a report's JSON again."""
    document = read_report(report)
    folder = out or report.parent
    prepare(folder)
    for path in write_rendered(document, folder):
        console().print(plain(str(path)), markup=False)
    return 0


@cli.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> int:
    """Print the completion script of a shell, e.g. for bash: eval "$(crosscheck completion bash)"."""
    script = get_completion_class(shell)
    if script is None:
        raise InputError(f"no completion for {shell}")
    click.echo(script(cli, {}, "crosscheck", "_CROSSCHECK_COMPLETE").source())
    return 0


def _folders(robots: tuple[str, ...], models: Path) -> list[Path]:
    if not robots:
        return list(model_folders(models).values())
    return list(dict.fromkeys(find_model(robot, models) for robot in robots))


def _command(
    folder: Path, models: Path | None, samples: int, seed: int, sources: tuple[str, ...], reference: str, certify: bool
) -> str:
    inside = folder.parent == (models or default_models_dir())
    words = ["crosscheck", "run", folder.name if inside else str(folder)]
    if models is not None and inside:
        words += ["--models", str(models)]
    for source in sources:
        words += ["--source", source]
    if reference != REFERENCE:
        words += ["--reference", reference]
    words += ["--samples", str(samples), "--seed", str(seed)]
    return shlex.join(words if certify else [*words, "--no-certify"])


@contextlib.contextmanager
def _progress(name: str, silent: bool) -> Iterator[Progress]:
    """A progress bar on stderr for one robot; none when piped, in CI or when silent."""
    bar = ProgressBar(
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


def _complain(error: CrosscheckError) -> None:
    click.echo(f"error: {plain(str(error))}", err=True)


cli.add_command(derive_dh)
cli.add_command(export_urdf_command)


def main() -> None:
    """Entry point: every error one line on stderr, no traceback for wrong input."""
    try:
        code: Any = cli.main(standalone_mode=False)
    except CrosscheckError as error:
        _complain(error)
        code = error.exit_code
    except click.ClickException as error:
        click.echo(f"error: {plain(error.format_message())}", err=True)
        code = 2
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted: reports written before are unchanged", err=True)
        code = 130
    except BrokenPipeError:  # the reader, e.g. head, has gone; nothing more can be said
        sys.stdout = None
        code = 141
    sys.exit(code if isinstance(code, int) else 0)
