"""Where the terminal output and the error lines go."""

from __future__ import annotations

import sys

import click
from rich.console import Console

from harness.errors import CrosscheckError
from harness.report.text import plain

WIDTH_WHEN_PIPED = 1000


def console(stderr: bool = False) -> Console:
    """A rich console. A pipe has no width: what is read by grep or kept in a log must not be folded at 80 columns."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, width=None if stream.isatty() else WIDTH_WHEN_PIPED, highlight=False)


def complain(error: CrosscheckError) -> None:
    """One line on stderr."""
    click.echo(f"error: {plain(str(error))}", err=True)
