"""`crosscheck export-urdf`: from a DH table to a URDF."""

from __future__ import annotations

from pathlib import Path

import click

from harness import api
from harness.cli.shared import models_option
from harness.convert.export_urdf import export_urdf
from harness.rendering.files import write


@click.command("export-urdf")
@click.argument("robot", metavar="ROBOT")
@models_option
@click.option("--out", type=click.Path(path_type=Path), help="File to write to.  [default: standard output]")
def export_urdf_command(robot: str, models: Path | None, out: Path | None) -> int:
    """Write a robot model's DH table as a URDF: kinematics only, one link for each DH frame."""
    text = export_urdf(api.load_model(robot, models=models))
    if out is None:
        click.echo(text.encode(), nl=False)  # XML without a declaration is UTF-8, whatever the terminal is
    else:
        write(out, text)
    return 0
