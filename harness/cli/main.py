"""The command `crosscheck`. Exit codes: 0 agreement, 1 disagreement, 2 wrong input, 3 a required source missing, 130 Ctrl-C."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click
from click.shell_completion import get_completion_class

from harness import __version__
from harness.cli.accept import accept
from harness.cli.console import complain, console
from harness.cli.derive import derive_dh, export_urdf_command
from harness.cli.diff import diff_command, identify_command
from harness.cli.engines import engines, worker_check
from harness.cli.frames import show_frames
from harness.cli.mutate import mutate
from harness.cli.run import complete_robots, models_option, run
from harness.cli.view import view
from harness.description.locate import default_models_dir
from harness.errors import CrosscheckError, InputError
from harness.rendering.files import prepare, write_rendered
from harness.report.json_file import read_report
from harness.report.text import plain


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="crosscheck")
def cli() -> None:
    """Cross-validate a robot's DH table against its URDF with every FK engine installed."""


@cli.command()
@click.argument("robot", metavar="ROBOT|URDF", shell_complete=complete_robots)
@models_option
def frames(robot: str, models: Path | None) -> int:
    """Show the frame tree: joint types, axes, and what each frame is mapped to."""
    return show_frames(robot, models or default_models_dir(), console())


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


for command in (run, accept, view, engines, worker_check, derive_dh, export_urdf_command, diff_command, identify_command, mutate):
    cli.add_command(command)


def main() -> None:
    """Entry point: every error one line on stderr, no traceback for wrong input."""
    try:
        code: Any = cli.main(standalone_mode=False)
    except CrosscheckError as error:
        complain(error)
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
