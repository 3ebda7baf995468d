"""`crosscheck accept`: the numbers of a report go on file, and later runs show what moved."""

from __future__ import annotations

from pathlib import Path

import click

from harness import api
from harness.cli.console import console
from harness.cli.output import Kept
from harness.cli.shared import accepted_option, complete_robots, folders_of, models_option, robot_words
from harness.description.locate import default_models_dir
from harness.errors import InputError, command_line
from harness.rendering.files import prepare, write
from harness.report.document import Report
from harness.report.text import plain
from harness.verdict.accepted import accepted_from, accepted_text


@click.command()
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=complete_robots)
@models_option
@click.option("--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder of the reports.")
@accepted_option
def accept(robots: tuple[str, ...], models: Path | None, out: Path, accepted: Path) -> int:
    """Put the numbers of the last reports of these robots (none: all) on file, to be committed.

    Later runs say what moved since; `crosscheck run --strict` fails if anything grew. This changes no verdict: a deviation
    that is meant goes into model.toml, with its reason.
    """
    folder = models or default_models_dir()
    reports = [_current(path, models, out) for path in folders_of(robots, folder)]
    prepare(accepted)
    for report in reports:
        path = write(accepted / f"{report.robot.name}.json", accepted_text(accepted_from(report)))
        note = "" if report.passes else "; it does not pass: --strict will fail only for what grows from here"
        console().print(plain(f"{path}{note}"), markup=False, soft_wrap=True)
    return Kept(0)


def _current(folder: Path, models: Path | None, out: Path) -> Report:
    """The robot's report, if it is one of the files as they are now. Raises InputError."""
    model = api.load_model(folder)
    path, again = out / f"{model.name}.json", command_line(["crosscheck", "run", *robot_words(folder, models)])
    if not path.exists():
        raise InputError("no report to accept", where=path, hint=again)
    report = api.read_report(path)
    # What was reviewed must be what is on disk: numbers of older files would be wrong from the start.
    if changed := [name for name, digest in model.hashes.items() if report.robot.hashes.get(name) != digest]:
        raise InputError(f"the report is older than {', '.join(changed)}", where=path, hint=again)
    return report
