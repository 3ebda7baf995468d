"""`crosscheck identify`: which known mechanism is this."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness.cause.changes import amount
from harness.cli.console import console
from harness.cli.shared import CHANGED, complete_robots, models_option
from harness.description.dh import Convention
from harness.description.locate import default_models_dir
from harness.difference.identify import identify
from harness.difference.operands import read_operand
from harness.kinematics.invariants import Difference
from harness.kinematics.side_by_side import Unit
from harness.rendering.tables import bare_table
from harness.report.text import plain

ALIKE = 1e-3


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
    matches, left_out = identify(operand, folder)
    out = console()
    kinds = "".join("P" if slides else "R" for slides in operand.prismatic)
    out.print(
        Text(plain(f"{operand.label}: {len(kinds)} joints, {kinds}; base, tool, joint signs and zero offsets aside")),
        soft_wrap=True,
    )
    table = bare_table("known table", "largest length difference", "largest angle difference", "joints that turn the other way")
    for one in matches[:most]:
        flipped = ", ".join(name for name, sign in zip(operand.joints, one.signs, strict=True) if sign < 0)
        table.add_row(*(Text(plain(cell)) for cell in (one.name, _largest(one.length), _largest(one.angle), flipped)))
    if matches:
        out.print(table)
    else:
        out.print(Text("no known table has such joints"))
    for text in left_out:
        out.print(Text(plain(f"left out: {text}"), style="yellow"), soft_wrap=True)
    return 0 if matches and matches[0].size[0] <= ALIKE else 1


def _largest(difference: Difference | None) -> str:
    if difference is None or difference.size <= CHANGED:
        return "0"
    size = amount(difference.size, cast(Unit, difference.unit)).lstrip("+")
    return f"{size} ({difference.name} of {difference.joint})"
