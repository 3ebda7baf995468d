"""Where the terminal output goes."""

from __future__ import annotations

import sys

from rich.console import Console

WIDTH_WHEN_PIPED = 1000


def console(stderr: bool = False) -> Console:
    """A rich console. A pipe has no width: what is read by grep or kept in a log must not be folded at 80 columns."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, width=None if stream.isatty() else WIDTH_WHEN_PIPED, highlight=False)
