"""Asks before a program of a model folder is started for the first time, and after each change of it."""

from __future__ import annotations

import sys
from dataclasses import replace

import click

from harness.description.model import RobotModel
from harness.errors import command_line
from harness.run.options import Options
from harness.run.plan import programs
from harness.run.trust import Program, fingerprint, is_remembered, remember

trust_option = click.option(
    "--trust",
    is_flag=True,
    envvar="CROSSCHECK_TRUST",
    help="Start the programs that a model.toml names without asking. Also CROSSCHECK_TRUST=1.",
)


def allowed(model: RobotModel, options: Options, again: str, silent: bool = False) -> Options:
    """The options that start the programs of the model's folder, once the user has allowed each of them.

    Args:
        model: the robot model.
        options: what is asked; with `trust`, everything is allowed.
        again: the command line that asks for the same.
        silent: nobody is asked, even at a terminal.

    Raises:
        UntrustedError: a program was not allowed.
        InputError: the options are wrong.
    """
    if options.trust:
        return options
    marks = {program: fingerprint(program) for program in programs(model, options)}
    unknown = {program: mark for program, mark in marks.items() if mark is None or not is_remembered(mark)}
    for program, mark in unknown.items():
        if silent or not _at_terminal() or not _asked(program, mark is not None):
            raise program.refusal(f"if you trust it: {again} --trust")
    for program, mark in unknown.items():
        if mark is not None:
            _keep(program, mark)
    return replace(options, trust=True)


def _at_terminal() -> bool:
    return sys.stdin is not None and sys.stderr is not None and sys.stdin.isatty() and sys.stderr.isatty()


def _asked(program: Program, can_be_kept: bool) -> bool:
    """Ask at the terminal. Anything but a yes, the end of the input among it, is a no."""
    kept = "until the command, or a file beside it, changes" if can_be_kept else "for this time: the folder is too large"
    lines = (
        "A model folder wants to start a program, with all that you may do on this machine:",
        f"  command  {command_line(program.command)}",
        f"  in       {command_line([str(program.folder)])}",
        f"  named by {command_line([str(program.folder / 'model.toml')])}, {program.key}",
    )
    click.echo("\n".join(lines), err=True)
    click.echo(f"Start it? A yes holds {kept}. [y/N] ", err=True, nl=False)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _keep(program: Program, mark: str) -> None:
    try:
        remember(mark, program)
    except OSError as error:
        click.echo(f"this yes could not be kept: {error.strerror}", err=True)
