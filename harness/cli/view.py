"""`crosscheck view`: a local page in which the sources of one robot can be moved and compared."""

from __future__ import annotations

import contextlib
import importlib
import threading
import webbrowser
from dataclasses import dataclass
from pathlib import Path

import click

from harness import api
from harness.cli.console import console
from harness.cli.shared import complete_robots, complete_sources, gathered, models_option, robot_words
from harness.cli.trust import allowed, trust_option
from harness.engines.registry import REFERENCE
from harness.errors import EngineUnavailable, command_line
from harness.report.text import plain
from harness.run.options import Options
from harness.view.guard import Guard
from harness.view.page import Page
from harness.view.server import start_server, stop_server
from harness.view.session import Session


@dataclass(frozen=True, kw_only=True)
class ViewSettings:
    """The options of `crosscheck view`."""

    sources: tuple[str, ...]
    reference: str
    samples: int
    seed: int
    port: int
    open_page: bool
    trust: bool


@click.command()
@click.argument("robot", metavar="ROBOT", shell_complete=complete_robots)
@models_option
@click.option(
    "--source", "sources", multiple=True, shell_complete=complete_sources, help="Show only this source; repeat for more."
)
@click.option(
    "--reference", default=REFERENCE, show_default=True, shell_complete=complete_sources, help="Compare with this source."
)
@click.option("--samples", type=int, default=2000, show_default=True, help="Configurations among which the worst are looked for.")
@click.option("--seed", type=int, default=0, show_default=True, help="Their seed.")
@click.option("--port", type=click.IntRange(1, 65535), default=8080, show_default=True, help="Port, or the next free one.")
@click.option("--open", "open_page", is_flag=True, help="Open the page in the browser.")
@trust_option
@gathered(ViewSettings, "settings")
def view(robot: str, models: Path | None, settings: ViewSettings) -> int:
    """Show a robot's sources side by side in a local page, with a slider for each joint. Ctrl-C ends it.

    The page is served to this machine alone, and only at the address that is printed.
    Needs viser: pip install 'fk-crosscheck[view]'.
    """
    try:
        viser = importlib.import_module("viser")
    except ImportError as error:
        raise EngineUnavailable("view", f"import viser failed: {error}", "pip install 'fk-crosscheck[view]'") from None
    model = api.load_model(robot, models=models)
    options = Options(
        samples=settings.samples,
        seed=settings.seed,
        sources=settings.sources,
        reference=settings.reference,
        certify=False,
        explain=False,
        trust=settings.trust,
    )
    options = allowed(model, options, command_line(["crosscheck", "view", *robot_words(model.folder, models)]))
    with options.worker_pool() as workers:
        session, guard = Session(model, options, workers), Guard()
        server, url = start_server(viser, guard, settings.port, plain(model.name))
        try:
            Page(server, session, guard)
            for name, why in session.absent.items():
                console().print(plain(f"{name} does not run: {why}"), markup=False, soft_wrap=True)
            console().print(
                plain(f"{model.name}, {len(session.sources)} sources: {url} (Ctrl-C ends it)"), markup=False, soft_wrap=True
            )
            if settings.open_page:
                webbrowser.open(url)
            with contextlib.suppress(KeyboardInterrupt):
                threading.Event().wait()
        finally:
            stop_server(server)
    return 0
