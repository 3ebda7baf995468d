"""`crosscheck render`: the other formats, from a report's JSON."""

from __future__ import annotations

from pathlib import Path

import click

from harness.cli.console import console
from harness.cli.output import Kept
from harness.rendering.files import prepare, write_rendered
from harness.report.json_file import read_report
from harness.report.text import plain


@click.command()
@click.argument("report", type=click.Path(path_type=Path), metavar="REPORT.json")
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write to.  [default: beside the report]")
def render(report: Path, out: Path | None) -> int:
    """Render HTML, Markdown and JUnit from a report's JSON again."""
    document = read_report(report)
    folder = out or report.parent
    prepare(folder)
    for path in write_rendered(document, folder):
        console().print(plain(str(path)), markup=False)
    return Kept(0)
