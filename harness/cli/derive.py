"""`crosscheck derive-dh` and `crosscheck export-urdf`: from a URDF to a DH table, and back."""

from __future__ import annotations

import math
import re
import tempfile
from pathlib import Path
from typing import cast

import click
from rich.text import Text

from harness.cli.console import console
from harness.convert.derive import Derived, derive
from harness.convert.write_model import export_urdf, write_model
from harness.description.dh import Convention
from harness.description.locate import default_models_dir, find_model
from harness.description.model import load_model
from harness.description.tidy import angle_text, is_identity, number_text, transform_toml
from harness.description.urdf_file import read_urdf
from harness.description.urdf_lint import check
from harness.difference.operands import only_leaf
from harness.rendering.files import write
from harness.rendering.tables import bare_table
from harness.report.document import Report
from harness.report.text import plain
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck

SAMPLES = 200


@click.command("derive-dh")
@click.argument("urdf_path", metavar="URDF", type=click.Path(path_type=Path))
@click.option("--base", help="Link to start from.  [default: the root]")
@click.option("--tip", help="Link to end at.  [default: the only leaf, if there is one]")
@click.option("--convention", type=click.Choice(["standard", "modified"]), default="standard", show_default=True)
@click.option("--source", default="urdf:pinocchio", show_default=True, help="Engine whose placements are believed.")
@click.option("--name", help="Name of the robot model.  [default: the file's]")
@click.option("--out", type=click.Path(path_type=Path), help="Folder of robot models to write it to.")
def derive_dh(
    urdf_path: Path, base: str | None, tip: str | None, convention: str, source: str, name: str | None, out: Path | None
) -> int:
    """Find the DH table of a chain in a URDF, and prove that it is the same robot.

    Exit code: that of cross-checking the result; 2 if no DH table exists.
    """
    urdf = read_urdf(urdf_path)
    check(urdf)
    derived = derive(urdf, base or urdf.roots[0], tip or only_leaf(urdf), cast(Convention, convention), source)
    robot = name or re.sub(r"[^A-Za-z0-9_.-]", "_", urdf_path.stem).lstrip("_.-") or "robot"
    _show(derived)
    report = verify(derived, robot, source, out)
    sentence = report.verdict.sentence
    console().print(Text(plain(sentence), style="green" if report.verdict.exit_code == 0 else "red"), soft_wrap=True)
    if out is not None:
        console().print(Text(f"written to {plain(str(out / robot))}"), soft_wrap=True)
    return report.verdict.exit_code


def verify(derived: Derived, name: str, source: str, out: Path | None) -> Report:
    """Write the robot model (to a temporary folder, if `out` is None), read it back and cross-check it, with a certificate."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = write_model(derived, name, source, out or Path(temporary))
        return crosscheck(load_model(folder), Options(samples=SAMPLES, seed=0, sources=(source,)))


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


@click.command("export-urdf")
@click.argument("robot", metavar="ROBOT")
@click.option("--models", type=click.Path(path_type=Path), help="Folder of robot models.  [default: those of the package]")
@click.option("--out", type=click.Path(path_type=Path), help="File to write to.  [default: standard output]")
def export_urdf_command(robot: str, models: Path | None, out: Path | None) -> int:
    """Write a robot model's DH table as a URDF: kinematics only, one link for each DH frame."""
    text = export_urdf(load_model(find_model(robot, models or default_models_dir())))
    if out is None:
        click.echo(text, nl=False)
    else:
        write(out, text)
    return 0
