"""A headless Chromium with the network off, and what it must never do: log an error, or ask for anything."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.description.model import load_model
from harness.rendering.files import write_index, write_report
from harness.report.document import Report
from harness.run.options import Options
from harness.verdict.accepted import accepted_from
from tests.helpers import compared, copied, crosscheck

# The browser's path, said aloud by whoever runs these tests (nox -s browser).
BROWSER = os.environ.get("CROSSCHECK_TESTS_BROWSER", "")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--enable-unsafe-swiftshader"]
FLAGS += ["--host-resolver-rules=MAP rebound.test 127.0.0.1"]  # a name of somebody's that leads to this machine
SOURCES = ("dh:pinocchio", "urdf:pinocchio", "urdf:yourdfpy")

PATIENCE = 180.0  # [s]: Chromium draws by software here, and shares the cores

Open = Callable[..., Any]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without a browser nothing here can be seen: skipped, and shown as such."""
    for item in items:
        if Path(__file__).parent in item.path.parents and not BROWSER:
            item.add_marker(pytest.mark.skip(reason="needs a browser: CROSSCHECK_TESTS_BROWSER=/usr/bin/chromium"))


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        yield chromium
        chromium.close()


def until(page: Any, expression: str, seconds: float = PATIENCE) -> None:
    """Wait until a JavaScript expression is true; asked from outside, since the page's policy forbids eval."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"not within {seconds} s: {expression}"
        page.wait_for_timeout(50)


@pytest.fixture
def open_page(browser: Any) -> Iterator[Open]:
    """Open a file or an address; at the end nothing was logged as an error, and nothing was asked for elsewhere."""
    contexts, errors, asked = [], [], []

    def open_(address: str, width: int = 1280, scheme: str = "light", offline: bool = True, drawn: bool = True) -> Any:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, offline=offline)
        contexts.append(context)
        context.set_default_timeout(1000.0 * PATIENCE)
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        page = context.new_page()
        own = "file:" if address.startswith("file:") else address.rsplit("/", 1)[0]
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("dialog", lambda dialog: errors.append(f"dialog: {dialog.message}"))
        page.on("request", lambda r: None if r.url.startswith((own, "data:", "blob:")) else asked.append(r.url))
        page.goto(address)
        if drawn:
            page.wait_for_selector("html[data-drawn=yes]")
        return page

    yield open_
    for context in contexts:
        context.close()
    assert errors == []
    assert asked == []


@pytest.fixture(scope="session")
def documents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Report]:
    """Three reports: all agree, d1 differs by 0.301 mm, an arm that slides; one of them since it was accepted."""
    folder = tmp_path_factory.mktemp("models")
    edits = {"ur5": ("dh.csv", "0.089159", "0.089460"), "panda": None, "stanford": None}
    found = {}
    for name, edit in edits.items():
        model = load_model(copied(folder, name, *([edit] if edit else [])))
        found[name] = crosscheck(model, Options(samples=200, seed=0, sources=SOURCES, command=f"crosscheck run {name}"))
    found["stanford"] = compared(found["stanford"], accepted_from(found["stanford"]), True)
    return found


@pytest.fixture(scope="session")
def site(documents: dict[str, Report], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reports and their index, as a run writes them."""
    folder = tmp_path_factory.mktemp("site")
    for report in documents.values():
        write_report(report, folder)
    write_index(folder)
    return folder
