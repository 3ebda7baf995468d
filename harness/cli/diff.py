"""`crosscheck diff`: are these two one mechanism, and if not, why."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import click
from rich.console import Console
from rich.text import Text

from harness.api import diff
from harness.cli.console import console
from harness.cli.shared import Quantity, complete_robots, gathered, models_option
from harness.description.dh import Convention
from harness.description.values import LARGEST_ANGLE
from harness.difference.result import Difference, Line
from harness.errors import InputError
from harness.rendering.tables import bare_table

# How each kind of line and cell looks.
STYLES = {
    "": "", "same": "bold green", "different": "bold red", "cause": "bold", "warning": "yellow", "changed": "bold",
    "by": "red",
}  # fmt: skip

HELP = "Link to start from, of the URDF; given twice: of A, then of B.  [default: the root]"


@dataclass(frozen=True, kw_only=True)
class DiffSettings:
    """The options of `crosscheck diff`: none, one for A and B, or one for each; tolerance in m and rad."""

    bases: tuple[str, ...]
    tips: tuple[str, ...]
    conventions: tuple[str, ...]
    tolerance: float


@click.command("diff")
@click.argument("a", shell_complete=complete_robots)
@click.argument("b", shell_complete=complete_robots)
@models_option
@click.option("--base", "bases", multiple=True, help=HELP)
@click.option("--tip", "tips", multiple=True, help="Link to end at, likewise.  [default: the only leaf, if there is one]")
@click.option(
    "--convention", "conventions", multiple=True, type=click.Choice(["standard", "modified"]),
    help="DH convention of a CSV, likewise.  [default: standard]",
)  # fmt: skip
@click.option("--tolerance", type=Quantity(LARGEST_ANGLE), default=1e-6, show_default=True, help="In m and rad.")
@gathered(DiffSettings, "settings")
def diff_command(a: str, b: str, models: Path | None, settings: DiffSettings) -> int:
    """Compare two mechanisms from base to tip, and say why they differ.

    A and B are any two of: a robot model, a DH CSV, a URDF file, PACKAGE:FILE.urdf of an installed package,
    roboticstoolbox:NAME. Exit code: 0 the same, 1 different, 2 wrong input.
    """
    result = diff(
        a,
        b,
        base=_each(settings.bases, "--base"),
        tip=_each(settings.tips, "--tip"),
        convention=cast("tuple[Convention, Convention]", _each(settings.conventions or ("standard",), "--convention")),
        tolerance=settings.tolerance,
        models=models,
    )
    _show(result)
    return result.exit_code


def _each(values: tuple[str, ...], option: str) -> tuple[str | None, str | None]:
    """The value for A and that for B."""
    if len(values) > 2:
        raise InputError(f"expected at most two, for A and for B, got {len(values)}", key=option)
    return (values[0], values[-1]) if values else (None, None)


def _show(result: Difference) -> None:
    """Print verdict and causes, then both canonical tables, a row a joint."""
    out = console()
    for line in (result.headline(), *result.reasons()):
        _print(out, line)
    out.print()
    for line in result.notes():
        _print(out, line)
    header, rows = result.table()
    if not rows:
        return
    table = bare_table(header[0])
    for column in header[1:]:
        table.add_column(Text(column), justify="right")  # [mm] is a unit, not markup
    for row in rows:
        table.add_row(*(Text(cell.text, style=STYLES[cell.kind]) for cell in row))
    out.print(table)
    out.print(Text(result.aside()), soft_wrap=True)


def _print(out: Console, line: Line) -> None:
    """One line, its first word in the colour of the verdict."""
    word, _, rest = line.text.partition(" ")
    if line.kind in ("same", "different"):
        out.print(Text(word, style=STYLES[line.kind]), Text(rest), soft_wrap=True)
    else:
        out.print(Text(line.text, style=STYLES[line.kind]), soft_wrap=True)
