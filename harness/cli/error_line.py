"""The one line on stderr that an error is told in. Light, so that a misspelt command is answered at once."""

from __future__ import annotations

import click

from harness.errors import CrosscheckError
from harness.report.text import plain


def complain(error: CrosscheckError) -> None:
    """One line on stderr."""
    click.echo(f"error: {plain(str(error))}", err=True)
