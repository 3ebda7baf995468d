"""`crosscheck derive-dh`: from a URDF to a DH table, with proof."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness.cli.console import console
from harness.cli.shared import gathered
from harness.convert.derive import Derived, derive
from harness.convert.verify import verify
from harness.description.dh import Convention
from harness.description.tidy import angle_text, is_identity, number_text, transform_toml
from harness.description.urdf_file import read_urdf
from harness.description.urdf_lint import check
from harness.difference.operands import only_leaf
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
    urdf = read_urdf(urdf_path)
    check(urdf)
    base, tip = settings.base or urdf.roots[0], settings.tip or only_leaf(urdf)
    derived = derive(urdf, base, tip, cast(Convention, settings.convention), settings.source)
    robot = settings.name or re.sub(r"[^A-Za-z0-9_.-]", "_", urdf_path.stem).lstrip("_.-") or "robot"
    _show(derived)
    report = verify(derived, robot, settings.source, settings.out)
    sentence = report.verdict.sentence
    console().print(Text(plain(sentence), style="green" if report.verdict.exit_code == 0 else "red"), soft_wrap=True)
    if settings.out is not None:
        console().print(Text(f"written to {plain(str(settings.out / robot))}"), soft_wrap=True)
    return report.verdict.exit_code


def _show(derived: Derived) -> None:
    out = console()
    out.print(Text(f"{plain(derived.base)} to {plain(derived.tip)}, {derived.table.convention} DH, metres and radians"))
    table = bare_table("joint", "type", "a", "alpha", "d", "theta")
    for row in derived.table.rows:
        cells = (row.name, row.kind, number_text(row.a), angle_text(row.alpha), number_text(row.d), angle_text(row.theta))
        table.add_row(*(Text(plain(cell)) for cell in cells))
    out.print(table)
    for name, T in (("base", derived.table.base), ("tool", derived.table.tool)):
        if not is_identity(T):
            out.print(Text(f"{name}: " + ", ".join(f"{k} = {v}" for k, v in transform_toml(T).items())))
    for direction in derived.free:
        out.print(Text(f"fixed by choice: {plain(direction)}", style="yellow"), soft_wrap=True)
    if math.isfinite(derived.residual):
        out.print(Text(f"the joint screws rebuild the chain to {derived.residual:.1e}", style="dim"))
