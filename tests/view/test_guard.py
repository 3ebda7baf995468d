"""The view takes requests of its own page only, without viser; and of a viser that it does not know, none at all."""

from __future__ import annotations

import hmac
import http.server
import re
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from packaging.specifiers import SpecifierSet

from harness.errors import EngineUnavailable, InputError
from harness.view import server as server_module
from harness.view.guard import MOST_PAGES, MOST_REQUESTS, VERSIONS, Guard, Visitors
from harness.view.page import Page
from harness.view.server import start_server

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
PORT = 8080
OWN = f"127.0.0.1:{PORT}"


@pytest.fixture
def guard() -> Guard:
    return Guard()


def test_the_page_and_its_socket_are_let_in(guard: Guard) -> None:
    for path in (guard.path, guard.path.rstrip("/"), guard.path + "?a=b"):
        assert guard.lets_in(PORT, path, [OWN], [], False)
        for is_socket in (True, False):
            assert guard.lets_in(PORT, path, [OWN], [f"http://{OWN}"], is_socket)


@pytest.mark.parametrize(
    "path", ["", "/", "//", "/x/", "/{upper}/", "/{token}x/", "/{short}/", "/x/{token}/", "/{token}/x", "/?{token}/"]
)
def test_without_the_secret_nothing_is_let_in(guard: Guard, path: str) -> None:
    token = guard.path.strip("/")
    asked = path.format(token=token, upper=token.swapcase(), short=token[:-1])
    assert not guard.lets_in(PORT, asked, [OWN], [], False)
    assert not guard.lets_in(PORT, asked, [OWN], [f"http://{OWN}"], True)


@pytest.mark.parametrize(
    "hosts",
    [
        [], [""], ["x.invalid"], [f"x.invalid:{PORT}"], ["127.0.0.1"], [f"127.0.0.1:{PORT + 1}"], [f"127.0.0.1.x.invalid:{PORT}"],
        [f"localhost:{PORT}"], [f"{OWN}@x.invalid"], [OWN, "x.invalid"], ["x.invalid", OWN], [OWN, OWN], [f" {OWN}"],
    ],
)  # fmt: skip
def test_a_foreign_host_is_not_let_in(guard: Guard, hosts: list[str]) -> None:
    assert not guard.lets_in(PORT, guard.path, hosts, [], False)
    assert not guard.lets_in(PORT, guard.path, hosts, [f"http://{OWN}"], True)
    assert not guard.lets_in(PORT, guard.path, hosts, [f"http://{host}" for host in hosts], True)


@pytest.mark.parametrize(
    "origins",
    [
        ["http://x.invalid"], ["null"], [""], [OWN], [f"https://{OWN}"], ["http://127.0.0.1"], [f"http://127.0.0.1:{PORT + 1}"],
        [f"http://{OWN}.x.invalid"], [f"http://{OWN}/"], [f"http://{OWN}", "http://x.invalid"], [f"http://localhost:{PORT}"],
        ["file://"],
    ],
)  # fmt: skip
def test_a_foreign_origin_is_not_let_in(guard: Guard, origins: list[str]) -> None:
    for is_socket in (True, False):
        assert not guard.lets_in(PORT, guard.path, [OWN], origins, is_socket)


def test_a_socket_says_where_it_comes_from(guard: Guard) -> None:
    assert not guard.lets_in(PORT, guard.path, [OWN], [], True)


def test_at_port_80_a_browser_names_no_port(guard: Guard) -> None:
    assert guard.address(80) == f"http://127.0.0.1{guard.path}"
    assert guard.lets_in(80, guard.path, ["127.0.0.1"], ["http://127.0.0.1"], True)
    assert not guard.lets_in(80, guard.path, ["127.0.0.1:80"], [], False)


def test_each_view_has_a_secret_of_its_own_that_nobody_guesses() -> None:
    tokens = {Guard().path.strip("/") for _ in range(50)}
    assert len(tokens) == 50
    assert all(re.fullmatch(r"[\w-]{43,}", token) for token in tokens)  # 256 bits


@pytest.mark.parametrize("says", [True, False])
def test_the_secret_is_compared_in_constant_time_and_in_no_other_way(
    guard: Guard, monkeypatch: pytest.MonkeyPatch, says: bool
) -> None:
    compared: list[set[bytes]] = []

    def compare(a: bytes, b: bytes) -> bool:
        compared.append({a, b})
        return says

    monkeypatch.setattr(hmac, "compare_digest", compare)
    token = guard.path.strip("/")
    for path in (guard.path, "/x/", "/"):
        assert guard.lets_in(PORT, path, [OWN], [], False) is says
    assert compared == [{f"/{token}".encode()}, {f"/{token}".encode(), b"/x"}, {f"/{token}".encode(), b""}]


def test_a_path_of_any_bytes_is_refused_and_no_fault(guard: Guard) -> None:
    for path in ("/\udcff\udc80/", "/é/", "/\x00/", "/" + "a" * 100_000):
        assert not guard.lets_in(PORT, path, [OWN], [], False)


class Connection:
    """One that can be ended."""

    def __init__(self) -> None:
        self.is_ended = False
        self.transport = SimpleNamespace(abort=self._end)

    def _end(self) -> None:
        self.is_ended = True


def test_of_too_many_connections_the_oldest_that_is_no_page_is_ended() -> None:
    visitors, page = Visitors(), Connection()
    visitors.came(page)
    assert visitors.opens_page(page)
    others = [Connection() for _ in range(MOST_REQUESTS + 3)]
    for connection in others:
        visitors.came(connection)
    assert [c.is_ended for c in others] == [True] * 3 + [False] * MOST_REQUESTS
    assert not page.is_ended
    visitors.went(others[3])
    visitors.came(Connection())
    assert not others[4].is_ended


def test_only_so_many_pages_are_open() -> None:
    visitors, pages = Visitors(), [Connection() for _ in range(MOST_PAGES + 1)]
    for page in pages:
        visitors.came(page)
    assert [visitors.opens_page(page) for page in pages] == [True] * MOST_PAGES + [False]
    visitors.went(pages[0])
    assert visitors.opens_page(pages[-1])


# A viser that is not what was read


class OtherServer:
    """Serves everything to everybody, in a way of its own."""

    started: list[OtherServer] = []

    def __init__(self, host: str, port: int, **_: Any) -> None:
        self.server = http.server.HTTPServer((host, port), http.server.BaseHTTPRequestHandler)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        OtherServer.started.append(self)

    def stop(self) -> None:
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def without_websockets(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """In place of the libraries that viser needs, which are not needed here."""
    library = SimpleNamespace(serve=lambda *_, **__: None, ServerConnection=object)
    for name in ("websockets", "websockets.asyncio"):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace())
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", library)
    return library


@pytest.mark.parametrize("version", ["1.0.9", "1.2.0", "2.0", "0.2.7", "1.1.2rc1", "unknown", "", None])
def test_another_version_is_not_started(guard: Guard, version: str | None) -> None:
    def server(**_: Any) -> None:
        raise AssertionError("it was started")

    viser = SimpleNamespace(ViserServer=server, **({} if version is None else {"__version__": version}))
    with pytest.raises(EngineUnavailable, match="cannot be kept to its own page") as error:
        start_server(viser, guard, 0, "x")
    assert error.value.install == "pip install 'fk-crosscheck[view]'"


def test_one_that_serves_in_another_way_is_ended(guard: Guard, without_websockets: SimpleNamespace) -> None:
    serve = without_websockets.serve
    with pytest.raises(EngineUnavailable, match="it starts its server in another way"):
        start_server(SimpleNamespace(__version__="1.1.9", ViserServer=OtherServer), guard, 0, "x")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", OtherServer.started[-1].server.server_port), 10)
    assert without_websockets.serve is serve


def test_one_whose_server_fails_in_its_thread_is_one_line_and_no_wait(
    guard: Guard, without_websockets: SimpleNamespace, capfd: pytest.CaptureFixture[str]
) -> None:
    def fails() -> None:
        raise TypeError("unexpected keyword argument 'sock'")

    class Waits:
        def __init__(self, **_: Any) -> None:
            threading.Thread(target=fails, daemon=True).start()
            threading.Event().wait()

    hook, start = threading.excepthook, time.monotonic()
    with pytest.raises(EngineUnavailable, match="it does not start, TypeError: unexpected keyword argument 'sock'"):
        start_server(SimpleNamespace(__version__="1.1.9", ViserServer=Waits), guard, 0, "x")
    assert time.monotonic() - start < server_module.PATIENCE / 2
    assert threading.excepthook is hook
    assert capfd.readouterr() == ("", "")


def test_one_that_never_answers_is_not_waited_for(
    guard: Guard, without_websockets: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_module, "PATIENCE", 0.2)
    viser = SimpleNamespace(__version__="1.1.9", ViserServer=lambda **_: threading.Event().wait())
    with pytest.raises(EngineUnavailable, match="it does not start within"):
        start_server(viser, guard, 0, "x")


def test_controls_without_an_identifier_are_refused(guard: Guard) -> None:
    with pytest.raises(EngineUnavailable, match="no identifier"):
        guard.add(SimpleNamespace(uuid="x"), (0.0, 1.0))
    assert guard.controls == {}


def test_the_command_refuses_another_viser_in_one_line(tmp_path: Path) -> None:
    code = "import sys, types; sys.modules['viser'] = types.ModuleType('viser'); sys.modules['viser'].__version__ = '9.1'; "
    code += "sys.argv = ['crosscheck', 'view', 'sixr', '--source', 'dh:pinocchio', '--samples', '5']; "
    code += "from harness.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path)
    assert done.returncode == 3
    (line,) = done.stderr.splitlines()
    assert "this viser cannot be kept to its own page (it is 9.1)" in line
    assert "http://" not in done.stdout + done.stderr


def test_the_versions_are_those_that_are_installed() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert f"viser{VERSIONS}" in project["project"]["optional-dependencies"]["view"]
    for name in ("constraints.txt", "locks/browser.txt"):
        pinned = re.search(r"^viser==(\S+?)[; ]", (ROOT / name).read_text(), re.MULTILINE)
        assert pinned
        assert pinned[1] in SpecifierSet(VERSIONS)


# The port


def test_a_taken_port_is_passed_over_and_others_cannot_reach_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with server_module._listening(0) as door:
        assert door.getsockname()[0] == "127.0.0.1"
        taken = door.getsockname()[1]
        with server_module._listening(taken) as other:
            assert other.getsockname()[1] != taken
        monkeypatch.setattr(server_module, "PORTS", 1)
        with pytest.raises(InputError, match=f"--port: no port from {taken} to {taken} is free"):
            server_module._listening(taken)


@pytest.mark.parametrize(("first", "last"), [(1, 1000), (65000, 65535), (65535, 65535)])
def test_ports_that_nobody_may_have_end_in_one_line(monkeypatch: pytest.MonkeyPatch, first: int, last: int) -> None:
    tried = []

    class Forbidden(socket.socket):
        def bind(self, address: Any) -> None:
            tried.append(address[1])
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket, "socket", Forbidden)
    with pytest.raises(InputError, match=f"no port from {first} to {last} is free"):
        server_module._listening(first)
    assert tried == list(range(first, last + 1))


# The page


class Anything:
    """Takes every call, as a server or a control of viser would, and keeps callbacks."""

    def __init__(self, uuid: str = "") -> None:
        self._impl = SimpleNamespace(uuid=uuid)
        self.callbacks: list[Any] = []
        self.value: Any = None
        self.min, self.max = -10.0, 10.0

    def __enter__(self) -> Anything:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __getattr__(self, name: str) -> Any:
        return lambda *_, **__: Anything()

    def on_update(self, callback: Any) -> None:
        self.callbacks.append(callback)

    on_click = on_update


class Gui(Anything):
    """Keeps the controls that were added, and gives each an identifier."""

    def __init__(self) -> None:
        super().__init__()
        self.controls: dict[str, Anything] = {}

    def _add(self, label: str, *_: Any) -> Anything:
        control = Anything(f"{len(self.controls)}")
        self.controls[label] = control
        return control

    add_slider = add_checkbox = add_button = _add


class SlowSession:
    """Two joints, and sources that need a while; counts how often they are asked."""

    def __init__(self) -> None:
        joints = SimpleNamespace(joints=["a", "b"], kind=lambda _: "revolute")
        law = SimpleNamespace(lower=np.array([-1.0, -2.0]), upper=np.array([1.0, 2.0]))
        self.model = SimpleNamespace(table=joints, configurations=law, urdf=None)
        self.run = SimpleNamespace(comparison=None)
        self.sources, self.frames, self.reference, self.absent = ["dh:numpy"], ["base"], "dh:numpy", dict[str, str]()
        self.places = [SimpleNamespace(kind="fixed", name="home", q=np.array([0.5, 0.5]))]
        self.asked: list[Any] = []

    def placements(self, q: Any) -> dict[str, Any]:
        time.sleep(0.05)
        self.asked.append(q)
        return {}

    def apart(self, placements: Any) -> list[Any]:
        return []


@pytest.fixture
def page(guard: Guard) -> tuple[Page, Gui, SlowSession]:
    gui, session = Gui(), SlowSession()
    server: Any = SimpleNamespace(gui=gui, scene=Anything(), initial_camera=SimpleNamespace())
    return Page(server, session, guard), gui, session  # type: ignore[arg-type]


def test_the_guard_knows_all_controls_of_the_page(page: tuple[Page, Gui, SlowSession], guard: Guard) -> None:
    limits = {label: guard.controls[control._impl.uuid] for label, control in page[1].controls.items()}
    assert limits == {
        "a [rad]": (-1.0, 1.0), "b [rad]": (-2.0, 2.0), "All to zero": None, "dh:numpy, the reference": None, "home": None,
    }  # fmt: skip
    assert all(len(control.callbacks) == 1 for control in page[1].controls.values())


@pytest.mark.parametrize("given", [float("nan"), float("inf"), "1", None, [1.0], True])
def test_a_slider_that_holds_no_number_moves_nothing(page: tuple[Page, Gui, SlowSession], given: object) -> None:
    slider = page[1].controls["b [rad]"]
    slider.value = given
    slider.callbacks[0](SimpleNamespace(target=slider))
    assert page[0].q.tolist() == [0.0, 0.0]
    slider.value = 1e308
    slider.callbacks[0](SimpleNamespace(target=slider))
    assert page[0].q.tolist() == [0.0, 2.0]


def test_moves_do_not_pile_up_and_the_last_one_is_shown(page: tuple[Page, Gui, SlowSession]) -> None:
    slider, session = page[1].controls["a [rad]"], page[2]

    def move(value: float) -> None:
        slider.callbacks[0](SimpleNamespace(target=SimpleNamespace(value=value)))

    threads = [threading.Thread(target=move, args=(i / 200,)) for i in range(1, 101)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(session.asked) < 50
    np.testing.assert_array_equal(session.asked[-1], page[0].q)
    assert page[0].q[0] > 0.0
