"""`crosscheck identify`: which known mechanism is this."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness.api import identify
from harness.cli.console import console
from harness.cli.shared import complete_robots, models_option
from harness.description.dh import Convention
from harness.difference.identify import NONE_LIKE_IT
from harness.rendering.tables import bare_table
from harness.report.text import plain


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
    result = identify(robot, base=base, tip=tip, convention=cast(Convention, convention), models=models)
    out = console()
    out.print(Text(result.headline()), soft_wrap=True)
    header, rows = result.table(most)
    if rows:
        table = bare_table(*header)
        for row in rows:
            table.add_row(*(Text(cell) for cell in row))
        out.print(table)
    else:
        out.print(Text(NONE_LIKE_IT))
    for text in result.left_out:
        out.print(Text(plain(f"left out: {text}"), style="yellow"), soft_wrap=True)
    return result.exit_code
