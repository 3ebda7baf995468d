"""`crosscheck diff` and `crosscheck identify`: are these two one mechanism, and which known one is this."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import click
from rich.table import Table
from rich.text import Text

from harness.cause.changes import amount
from harness.cli.console import console
from harness.cli.run import complete_robots, models_option
from harness.description.dh import Convention
from harness.description.locate import default_models_dir
from harness.difference.differences import Diff, diff, remarks
from harness.difference.identify import identify
from harness.difference.operands import read_operand
from harness.errors import InputError
from harness.kinematics.invariants import ParameterDifference
from harness.kinematics.side_by_side import COLUMNS, Unit, difference_of, with_matching_normals
from harness.report.text import metres, plain, radians

CHANGED = 1e-9
ALIKE = 1e-3

HELP = "Link to start from, of the URDF; given twice: of A, then of B.  [default: the root]"


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
def diff_command(
    a: str,
    b: str,
    models: Path | None,
    bases: tuple[str, ...],
    tips: tuple[str, ...],
    conventions: tuple[str, ...],
    tolerance: float,
) -> int:
    """Compare two mechanisms from base to tip, and say why they differ.

    A and B are any two of: a robot model, a DH CSV, a URDF file, PACKAGE:FILE.urdf of an installed package,
    roboticstoolbox:NAME. Exit code: 0 the same, 1 different, 2 wrong input.
    """
    ends = list(zip(_each(bases, "--base"), _each(tips, "--tip"), _each(conventions, "--convention"), strict=True))
    folder = models or default_models_dir()
    operands = [
        read_operand(text, folder, base, tip, cast(Convention, convention or "standard"))
        for text, (base, tip, convention) in zip((a, b), ends, strict=True)
    ]
    found = diff(operands[0], operands[1], (tolerance, tolerance))
    _show(found)
    return 0 if found.same else 1


def _each(values: tuple[str, ...], option: str) -> tuple[str | None, str | None]:
    """The value for A and that for B."""
    if len(values) > 2:
        raise InputError(f"expected at most two, for A and for B, got {len(values)}", key=option)
    return (values[0], values[-1]) if values else (None, None)


def _show(found: Diff) -> None:
    out = console()
    position, rotation = found.errors
    word = Text("SAME", style="bold green") if found.same else Text("DIFFERENT", style="bold red")
    seen = f"up to {metres(position)}, {radians(rotation)} apart"
    proven = f"; for all q at most {metres(found.bound[0])}, {radians(found.bound[1])}" if found.bound else ""
    out.print(word, Text(plain(f"{found.a.label} and {found.b.label}: {seen}{proven}")), soft_wrap=True)
    if found.unexplained:
        out.print(Text(plain(f"  unexplained: {found.unexplained}")), soft_wrap=True)
    if found.explanation is not None:
        e = found.explanation
        for i, (change, others) in enumerate(zip(e.changes, e.equivalents, strict=True)):
            out.print(Text(plain(f"  {'why: ' if i == 0 else '     '}{change.text}"), style="bold"), soft_wrap=True)
            if others:
                out.print(Text(plain(f"         the same: {'; '.join(c.text for c in others[:4])}")), soft_wrap=True)
        for text in remarks(found):
            out.print(Text(plain(f"  note: {text}")), soft_wrap=True)
        left = f"{metres(e.after[0])}, {radians(e.after[1])} after"
        out.print(Text(f"  tried: {metres(e.before[0])}, {radians(e.before[1])} before, {left}"))
    out.print()
    _tables(found)


def _tables(found: Diff) -> None:
    """Both canonical tables, a row a joint, and what differs in mm and degrees."""
    out = console()
    one, other = found.tables
    for operand, side in ((found.a, one), (found.b, other)):
        if side.problem:
            out.print(Text(plain(f"{operand.label} has no DH table: {side.problem}"), style="yellow"), soft_wrap=True)
    if one.problem or other.problem:
        return
    out.print(
        Text(plain(f"canonical {found.convention} DH: A = {found.a.label}, B = {found.b.label}; differences B - A")),
        soft_wrap=True,
    )
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("joint", overflow="fold")
    for name, unit in COLUMNS:
        for head in (f"A {name} [{'mm' if unit == 'm' else 'deg'}]", f"B {name}", "difference"):
            table.add_column(head, justify="right")
    for a, b in zip(one.rows, with_matching_normals(one.rows, other.rows, found.convention), strict=True):
        cells: list[Text] = [Text(plain(a.name))]
        for name, unit in COLUMNS:
            cells += _cells(float(getattr(a, name)), float(getattr(b, name)), unit)
        table.add_row(*cells)
    out.print(table)
    if found.matching is not None and (largest := found.matching.largest) is not None and largest.size > CHANGED:
        what = f"{largest.name} of {largest.joint} by {amount(largest.size, cast(Unit, largest.unit)).lstrip('+')}"
        out.print(Text(plain(f"base, tool, joint signs and zero offsets aside, most different: {what}")), soft_wrap=True)
    elif found.matching is not None:
        out.print(Text("base, tool, joint signs and zero offsets aside: the same mechanism"))


def _cells(a: float, b: float, unit: Unit) -> list[Text]:
    scale = 1e3 if unit == "m" else 180.0 / math.pi
    difference = difference_of(b, a, unit)
    changed = abs(difference) > CHANGED
    return [
        Text(f"{round(a * scale, 6) + 0.0:.9g}"),
        Text(f"{round(b * scale, 6) + 0.0:.9g}", style="bold" if changed else ""),
        Text(f"{difference * scale:+.6g}" if changed else "", style="red"),
    ]


@click.command("identify")
@click.argument("robot", metavar="URDF|ROBOT|CSV", shell_complete=complete_robots)
@models_option
@click.option("--base", help="Link to start from, of a URDF.  [default: the root]")
@click.option("--tip", help="Link to end at, of a URDF.  [default: the only leaf, if there is one]")
@click.option(
    "--convention", type=click.Choice(["standard", "modified"]), default="standard", show_default=True, help="Of a CSV."
)
@click.option("--most", type=click.IntRange(min=1), default=10, show_default=True, help="Tables to show.")
def identify_command(robot: str, models: Path | None, base: str | None, tip: str | None, convention: str, most: int) -> int:
    """Which known DH table this mechanism is, modulo base, tool, joint signs and zero offsets; nearest first.

    Known are the robot models, the tables beside them, and those that the Robotics Toolbox packages, if it is installed.
    Exit code: 0 one is it to within a millimetre and a milliradian, 1 none is, 2 wrong input.
    """
    folder = models or default_models_dir()
    operand = read_operand(robot, folder, base, tip, cast(Convention, convention))
    found, left_out = identify(operand, folder)
    out = console()
    kinds = "".join("P" if slides else "R" for slides in operand.prismatic)
    out.print(
        Text(plain(f"{operand.label}: {len(kinds)} joints, {kinds}; base, tool, joint signs and zero offsets aside")),
        soft_wrap=True,
    )
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column in ("known table", "largest length difference", "largest angle difference", "joints that turn the other way"):
        table.add_column(column, overflow="fold")
    for one in found[:most]:
        flipped = ", ".join(name for name, sign in zip(operand.joints, one.signs, strict=True) if sign < 0)
        table.add_row(*(Text(plain(cell)) for cell in (one.name, _largest(one.length), _largest(one.angle), flipped)))
    if found:
        out.print(table)
    else:
        out.print(Text("no known table has such joints"))
    for text in left_out:
        out.print(Text(plain(f"left out: {text}"), style="yellow"), soft_wrap=True)
    return 0 if found and found[0].size[0] <= ALIKE else 1


def _largest(difference: ParameterDifference | None) -> str:
    if difference is None or difference.size <= CHANGED:
        return "0"
    size = amount(difference.size, cast(Unit, difference.unit)).lstrip("+")
    return f"{size} ({difference.name} of {difference.joint})"
