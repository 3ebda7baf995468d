"""`crosscheck engines` and `crosscheck engines install`."""

from __future__ import annotations

from pathlib import Path

import click
from rich.console import Console
from rich.text import Text

from harness.cli.console import console
from harness.cli.output import Kept
from harness.cli.shared import complete_sources
from harness.engines.base import Engine
from harness.engines.registry import adapter_of, registered
from harness.errors import EngineUnavailable, InputError
from harness.report.text import plain
from harness.workers.environments import cache_folder, where
from harness.workers.install import install


@click.group(invoke_without_command=True)
@click.pass_context
def engines(ctx: click.Context) -> int:
    """Show which engines are installed, their versions, how to install the others, and their traits."""
    return show_engines(console()) if ctx.invoked_subcommand is None else 0


@engines.command("install")
@click.argument("names", nargs=-1, metavar="[NAME]...", shell_complete=complete_sources)
@click.option("--all", "everything", is_flag=True, help="Every engine there is.")
@click.option(
    "--constraint", "-c", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Constraints file for pip."
)
def install_command(names: tuple[str, ...], everything: bool, constraint: Path | None) -> int:
    """Install engines, each in an environment where it does not disturb the others. Exit code 3 if one could not be."""
    if bool(names) == everything:
        raise InputError("expected names of engines, or --all", hint="crosscheck engines lists them")
    adapters: list[type[Engine]] = []
    missing = 0
    for name in registered() if everything else names:
        try:
            adapters.append(adapter_of(name))
        except EngineUnavailable as error:
            _say(f"{name}: NOT INSTALLED: {error.reason}")
            missing += 1
    done = install(adapters, constraint.resolve() if constraint else None, _say)
    missing += sum(bool(entry.problem) for entry in done.values())
    asked = len(registered() if everything else names)
    _say(f"{asked - missing} of {asked} engines installed; environments in {cache_folder()}")
    return Kept(3 if missing else 0)


def _say(text: str) -> None:
    console().print(plain(text), markup=False, soft_wrap=True)


def show_engines(out: Console) -> int:
    """Print every registered engine: versions or the reason and the install line, then its traits."""
    for name, entry in registered().items():
        if entry.adapter is None:
            out.print(Text(name, style="bold"), Text(f"broken: {plain(entry.problem)}", style="red"), soft_wrap=True)
            continue
        try:
            versions = ", ".join(f"{k} {v}" for k, v in where(entry.adapter).versions.items()) or "built in"
            out.print(Text(name, style="bold"), Text(versions, style="green"), soft_wrap=True)
        except EngineUnavailable as error:
            text = f"not installed: {error.reason}; {error.install}"
            out.print(Text(name, style="bold"), Text(plain(text), style="yellow"), soft_wrap=True)
        for trait in entry.adapter.traits:
            when = f" [matters with: {trait.lint}]" if trait.lint else ""
            out.print(Text(f"    {trait.text}{when}"), soft_wrap=True)
            out.print(Text(f"        {trait.evidence}", style="dim"), soft_wrap=True)
    return 0
