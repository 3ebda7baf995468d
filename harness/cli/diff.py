"""`crosscheck diff`: are these two one mechanism, and if not, why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness.cause.changes import amount
from harness.cli.console import console
from harness.cli.shared import CHANGED, complete_robots, gathered, models_option
from harness.description.dh import Convention
from harness.description.locate import default_models_dir
from harness.difference.differences import Diff, diff, remarks
from harness.difference.operands import read_operand
from harness.errors import InputError
from harness.kinematics.side_by_side import COLUMNS, Unit, less, turned
from harness.rendering.tables import bare_table
from harness.report.text import metres, plain, radians

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
@click.option("--tolerance", type=click.FloatRange(min=0, min_open=True), default=1e-6, show_default=True, help="In m and rad.")
@gathered(DiffSettings, "settings")
def diff_command(a: str, b: str, models: Path | None, settings: DiffSettings) -> int:
    """Compare two mechanisms from base to tip, and say why they differ.

    A and B are any two of: a robot model, a DH CSV, a URDF file, PACKAGE:FILE.urdf of an installed package,
    roboticstoolbox:NAME. Exit code: 0 the same, 1 different, 2 wrong input.
    """
    bases, tips = _each(settings.bases, "--base"), _each(settings.tips, "--tip")
    ends = list(zip(bases, tips, _each(settings.conventions, "--convention"), strict=True))
    folder = models or default_models_dir()
    operands = [
        read_operand(text, folder, base, tip, cast(Convention, convention or "standard"))
        for text, (base, tip, convention) in zip((a, b), ends, strict=True)
    ]
    result = diff(operands[0], operands[1], (settings.tolerance, settings.tolerance))
    _show(result)
    return 0 if result.same else 1


def _each(values: tuple[str, ...], option: str) -> tuple[str | None, str | None]:
    """The value for A and that for B."""
    if len(values) > 2:
        raise InputError(f"expected at most two, for A and for B, got {len(values)}", key=option)
    return (values[0], values[-1]) if values else (None, None)


def _show(result: Diff) -> None:
    out = console()
    position, rotation = result.errors
    word = Text("SAME", style="bold green") if result.same else Text("DIFFERENT", style="bold red")
    seen = f"up to {metres(position)}, {radians(rotation)} apart"
    proven = f"; for all q at most {metres(result.bound[0])}, {radians(result.bound[1])}" if result.bound else ""
    out.print(word, Text(plain(f"{result.a.label} and {result.b.label}: {seen}{proven}")), soft_wrap=True)
    if result.unexplained:
        out.print(Text(plain(f"  unexplained: {result.unexplained}")), soft_wrap=True)
    if result.explanation is not None:
        e = result.explanation
        for i, (change, others) in enumerate(zip(e.changes, e.equivalents, strict=True)):
            out.print(Text(plain(f"  {'why: ' if i == 0 else '     '}{change.text}"), style="bold"), soft_wrap=True)
            if others:
                out.print(Text(plain(f"         the same: {'; '.join(c.text for c in others[:4])}")), soft_wrap=True)
        for text in remarks(result):
            out.print(Text(plain(f"  note: {text}")), soft_wrap=True)
        after = f"{metres(e.after[0])}, {radians(e.after[1])} after"
        out.print(Text(f"  tried: {metres(e.before[0])}, {radians(e.before[1])} before, {after}"))
    out.print()
    _tables(result)


def _tables(result: Diff) -> None:
    """Both canonical tables, a row a joint, and what differs in mm and degrees."""
    out = console()
    one, other = result.tables
    for operand, side in ((result.a, one), (result.b, other)):
        if side.problem:
            out.print(Text(plain(f"{operand.label} has no DH table: {side.problem}"), style="yellow"), soft_wrap=True)
    if one.problem or other.problem:
        return
    out.print(
        Text(plain(f"canonical {result.convention} DH: A = {result.a.label}, B = {result.b.label}; differences B - A")),
        soft_wrap=True,
    )
    table = bare_table("joint")
    for name, unit in COLUMNS:
        for head in (f"A {name} [{'mm' if unit == 'm' else 'deg'}]", f"B {name}", "difference"):
            table.add_column(head, justify="right")
    for a, b in zip(one.rows, turned(one.rows, other.rows, result.convention), strict=True):
        cells: list[Text] = [Text(plain(a.name))]
        for name, unit in COLUMNS:
            cells += _cells(float(getattr(a, name)), float(getattr(b, name)), unit)
        table.add_row(*cells)
    out.print(table)
    if result.matching is not None and (largest := result.matching.largest) is not None and largest.size > CHANGED:
        what = f"{largest.name} of {largest.joint} by {amount(largest.size, cast(Unit, largest.unit)).lstrip('+')}"
        out.print(Text(plain(f"base, tool, joint signs and zero offsets aside, most different: {what}")), soft_wrap=True)
    elif result.matching is not None:
        out.print(Text("base, tool, joint signs and zero offsets aside: the same mechanism"))


def _cells(a: float, b: float, unit: Unit) -> list[Text]:
    scale = 1e3 if unit == "m" else 180.0 / math.pi
    difference = less(b, a, unit)
    changed = abs(difference) > CHANGED
    return [
        Text(f"{round(a * scale, 6) + 0.0:.9g}"),
        Text(f"{round(b * scale, 6) + 0.0:.9g}", style="bold" if changed else ""),
        Text(f"{difference * scale:+.6g}" if changed else "", style="red"),
    ]
