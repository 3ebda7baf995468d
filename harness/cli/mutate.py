"""`crosscheck mutate`: how many faults the gate catches, and whether it names their cause."""

from __future__ import annotations

from pathlib import Path

import click

from harness.cli.console import console
from harness.cli.output import Kept
from harness.cli.shared import complete_robots, complete_sources, folders_of, models_option, progress_bar
from harness.description.locate import default_models_dir
from harness.errors import InputError
from harness.mutation.run import SOURCES, run_mutants
from harness.mutation.score import show
from harness.rendering.files import prepare, write
from harness.report.text import plain
from harness.run.options import MOST_JOBS


@click.command()
@click.argument("robots", nargs=-1, metavar="[ROBOT]...", shell_complete=complete_robots)
@models_option
@click.option(
    "--source", "sources", multiple=True, default=SOURCES, show_default=True, shell_complete=complete_sources,
    help="Source that is to catch the mutants; repeat for more.",
)  # fmt: skip
@click.option("--every", type=click.IntRange(min=1), default=1, show_default=True, help="Try only each so manieth mutant.")
@click.option("--jobs", type=click.IntRange(min=0, max=MOST_JOBS), default=0, help="Processes.  [default: one a core]")
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder for mutation.json."
)
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors; the exit code tells.")
def mutate(
    robots: tuple[str, ...], models: Path | None, sources: tuple[str, ...], every: int, jobs: int, out: Path, quiet: bool
) -> int:
    """Put faults into robot models on purpose, and see what the gate makes of them.

    Numbers, signs, units, conventions, frames, axes and controllers, on either side; and rewritings that change nothing.
    Exit code: 0 all that can be seen was caught and nothing else flagged, 1 if not, 2 wrong input, 3 no source can run.
    """
    folders = folders_of(robots, models or default_models_dir())
    for source in sources:
        if not source.startswith("urdf:"):
            raise InputError(f"expected a source that reads a URDF, got {source!r}", key="--source")
    prepare(out)
    with progress_bar("mutants", quiet) as advance:
        result = run_mutants(folders, sources, every, jobs, advance)
    write(out / "mutation.json", result.model_dump_json(indent=1) + "\n")
    if not quiet:
        show(result, console())
        total = result.total
        counts = f"{total.caught} caught, {total.missed} missed, {total.false_alarms} false alarms in {result.seconds:.0f} s"
        console().print(f"{counts}; written to {plain(str(out / 'mutation.json'))}", markup=False)
    return Kept(result.exit_code)
