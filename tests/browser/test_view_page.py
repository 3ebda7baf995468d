"""`crosscheck view` in a browser: a slider is moved, the discrepancy shown follows."""

from __future__ import annotations

import contextlib
import http.server
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from harness.description.model import RobotModel, load_model
from harness.engines.dh_numpy import DHNumpy
from harness.report.text import metres
from harness.se3 import position_error
from tests.browser.conftest import BROWSER, Open, until
from tests.helpers import copied


class Silent(http.server.BaseHTTPRequestHandler):
    """An empty page for every request."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR5 whose forearm is twisted by 10 mrad: how far off the tool is depends on the joints after it."""
    return copied(
        tmp_path_factory.mktemp("view"),
        "ur5",
        ("dh.csv", "elbow_joint,revolute,-0.39225,0,", "elbow_joint,revolute,-0.39225,0.01,"),
    )


@pytest.fixture(scope="module")
def served(broken: Path) -> Iterator[tuple[str, int]]:
    """The address of a running view and the id of its process."""
    command = [sys.executable, "-m", "harness", "view", str(broken), "--samples", "50", "--port", "8765"]
    command += ["--source", "dh:pinocchio", "--source", "urdf:pinocchio"]
    view = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert view.stdout is not None
        line = view.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/[\w-]{40,}", line)
        assert found, line
        yield found[0], view.pid
        view.send_signal(signal.SIGINT)
        assert view.wait(60) == 0
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(view.pid, signal.SIGKILL)
        view.wait(10)
        if view.stdout is not None:
            view.stdout.close()


def test_a_slider_moves_the_arm_and_the_discrepancy(
    open_page: Open, served: tuple[str, int], broken: Path, models: dict[str, RobotModel]
) -> None:
    page = open_page(served[0] + "/", offline=False, drawn=False)
    page.wait_for_selector("#discrepancies table")
    tables = [DHNumpy(model.table) for model in (load_model(broken), models["ur5"])]

    def shown() -> tuple[list[float], str]:
        """q as the page tells it, and what it says of urdf:pinocchio at tool0: both of one moment, when it is at rest."""
        text = ""
        while text != (text := page.locator("#discrepancies").inner_text()):
            page.wait_for_timeout(500)
        found = re.search(r"q = \[([^\]]*)\]", text)
        assert found
        row = next(line for line in text.splitlines() if line.startswith("tool0"))
        return [float(x) for x in found[1].split(",")], row.split("\t")[2]

    def expected(q: list[float]) -> str:
        T_a, T_b = (engine.placements(np.array([q]), ("tool",))[0, 0] for engine in tables)
        return metres(float(position_error(T_a, T_b)))

    assert shown()[0] == [0.0] * 6
    assert f"✗ {expected([0.0] * 6)}" in shown()[1]
    seen = {shown()[1]}
    for joint, drag in ((2, 30), (3, 30), (4, -25), (5, 0)):
        before, head = shown()[0], page.locator("#discrepancies").inner_text().split(";")[0]
        thumb = page.locator("[role=slider]").nth(joint)
        if drag:
            box = thumb.bounding_box()
            assert box
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x + drag, y, steps=4)
            page.mouse.up()
        else:
            thumb.focus()
            page.keyboard.press("ArrowRight")
        until(page, f"!document.querySelector('#discrepancies').innerText.startsWith({head!r})")
        q, row = shown()
        assert q[joint] != before[joint]
        assert f"✗ {expected(q)}" in row
        seen.add(row)
    assert len(seen) >= 3


def test_buttons_go_to_the_worst_the_published_and_the_singular(open_page: Open, served: tuple[str, int]) -> None:
    page = open_page(served[0] + "/", offline=False, drawn=False)
    page.wait_for_selector("#discrepancies table")
    for name in (r"urdf:pinocchio at ", "article", r"1: smallest singular value"):
        before = page.locator("#discrepancies p").first.inner_text()
        page.get_by_role("button", name=re.compile(name)).first.click()
        until(page, f"document.querySelector('#discrepancies p').innerText !== {before!r}")
    assert page.get_by_role("button", name=re.compile("share", re.I)).count() == 0
    page.get_by_label("urdf:pinocchio").uncheck()


def test_only_this_machine_is_served(served: tuple[str, int]) -> None:
    process = psutil.Process(served[1])
    processes = [process, *process.children(recursive=True)]
    listening = [c.laddr.ip for p in processes for c in p.net_connections() if c.status == "LISTEN"]
    assert listening
    assert set(listening) == {"127.0.0.1"}


SOCKET = """address => new Promise(done => {
    const socket = new WebSocket(address.replace('http', 'ws'), 'viser-v' + VERSION);
    socket.onopen = () => done('open');
    socket.onclose = () => done('refused');
})"""


def socket_from(page: Any, address: str) -> str:
    """Whether a WebSocket from a page is `open` or `refused`."""
    import viser

    return str(page.evaluate(SOCKET.replace("VERSION", repr(viser.__version__)), address))


def test_a_page_of_another_origin_is_refused(browser: Any, served: tuple[str, int]) -> None:
    other = http.server.HTTPServer(("127.0.0.1", 0), Silent)
    threading.Thread(target=other.serve_forever, daemon=True).start()
    context = browser.new_context()
    try:
        page = context.new_page()
        assert page.goto(served[0] + "/").status == 200
        assert socket_from(page, served[0] + "/") == "open"
        page.goto(f"http://127.0.0.1:{other.server_port}/")
        for address in (served[0] + "/", served[0].rsplit("/", 1)[0] + "/"):
            assert socket_from(page, address) == "refused"
    finally:
        context.close()
        other.shutdown()
        other.server_close()


def test_a_foreign_name_that_leads_here_is_refused(browser: Any, served: tuple[str, int]) -> None:
    context = browser.new_context()
    try:
        page = context.new_page()
        foreign = served[0].replace("127.0.0.1", "rebound.test") + "/"
        assert page.goto(foreign).status == 403
        assert "printed" in page.inner_text("body")
        assert socket_from(page, foreign) == "refused"
        assert socket_from(page, served[0] + "/") == "refused"
    finally:
        context.close()


def test_the_browser_is_there() -> None:
    assert Path(BROWSER).is_file()
