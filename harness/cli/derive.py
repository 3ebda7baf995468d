"""`crosscheck derive-dh`: from a URDF to a DH table, with proof."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness import api
from harness.cli.console import console
from harness.cli.output import Kept
from harness.cli.shared import gathered
from harness.convert.result import HEADER, Derived
from harness.convert.verify import verify
from harness.description.dh import Convention
from harness.rendering.tables import bare_table
from harness.report.text import plain


@dataclass(frozen=True, kw_only=True)
class DeriveSettings:
    """The options of `crosscheck derive-dh`; None stands for the default that its help gives."""

    base: str | None
    tip: str | None
    convention: str
    source: str
    name: str | None
    out: Path | None


@click.command("derive-dh")
@click.argument("urdf_path", metavar="URDF", type=click.Path(path_type=Path))
@click.option("--base", help="Link to start from.  [default: the root]")
@click.option("--tip", help="Link to end at.  [default: the only leaf, if there is one]")
@click.option("--convention", type=click.Choice(["standard", "modified"]), default="standard", show_default=True)
@click.option("--source", default="urdf:pinocchio", show_default=True, help="Engine whose placements are believed.")
@click.option("--name", help="Name of the robot model.  [default: the file's]")
@click.option("--out", type=click.Path(path_type=Path), help="Folder of robot models to write it to.")
@gathered(DeriveSettings, "settings")
def derive_dh(urdf_path: Path, settings: DeriveSettings) -> int:
    """Find the DH table of a chain in a URDF, and prove that it is the same robot.

    Exit code: that of cross-checking the result; 2 if no DH table exists.
    """
    convention = cast(Convention, settings.convention)
    derived = api.derive_dh(urdf_path, base=settings.base, tip=settings.tip, convention=convention, source=settings.source)
    robot = settings.name or re.sub(r"[^A-Za-z0-9_.-]", "_", urdf_path.stem).lstrip("_.-") or "robot"
    _show(derived)
    report = verify(derived, robot, settings.source, settings.out)
    console().print(Text(plain(report.verdict.sentence), style="green" if report.passes else "red"), soft_wrap=True)
    if settings.out is not None:
        console().print(Text(f"written to {plain(str(settings.out / robot))}"), soft_wrap=True)
        return Kept(report.verdict.exit_code)
    return report.verdict.exit_code


def _show(derived: Derived) -> None:
    out = console()
    out.print(Text(derived.headline()))
    table = bare_table(*HEADER)
    for row in derived.rows():
        table.add_row(*(Text(cell) for cell in row))
    out.print(table)
    for line in derived.transforms():
        out.print(Text(line))
    for line in derived.choices():
        out.print(Text(line, style="yellow"), soft_wrap=True)
    if check := derived.check():
        out.print(Text(check, style="dim"))
