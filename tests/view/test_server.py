"""A real viser behind the guard: what it answers to foreign pages, to hostile messages, and to too much of anything."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import math
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import psutil
import pytest

from harness.errors import EngineUnavailable
from harness.view import server as server_module
from harness.view.guard import MOST_PAGES, MOST_REQUESTS, Guard
from harness.view.messages import LARGEST
from harness.view.server import PAUSE, start_server, stop_server
from tests.browser.conftest import BROWSER
from tests.view.client import MORE, TEXT, UPGRADE, WebSocket, answer, request
from tests.view.test_messages import CAMERA, update

# nox -s browser installs it; there nothing is skipped.
pytestmark = pytest.mark.skipif(not BROWSER and importlib.util.find_spec("viser") is None, reason="needs viser: nox -s browser")

MIB = 1 << 20


class View:
    """A view with one control of each kind, and what was seen of them."""

    def __init__(self) -> None:
        self.viser: Any = importlib.import_module("viser")
        self.msgpack: Any = importlib.import_module("msgspec.msgpack")
        self.guard = Guard()
        self.server, self.address = start_server(self.viser, self.guard, 0, "test")
        self.port = int(self.address.split(":")[2].split("/")[0])
        self.own = f"127.0.0.1:{self.port}"
        self.seen: list[Any] = []
        self.slider = self.server.gui.add_slider("a", -1.0, 1.0, 0.001, 0.0)
        self.box = self.server.gui.add_checkbox("b", False)
        self.button = self.server.gui.add_button("c")
        self.guard.add(self.slider, (-1.0, 1.0))
        self.guard.add(self.box)
        self.guard.add(self.button)
        self.slider.on_update(lambda event: self.seen.append(event.target.value))
        self.box.on_update(lambda event: self.seen.append(event.target.value))
        self.button.on_click(lambda _: self.seen.append("click"))

    def headers(self, **others: str) -> dict[str, str]:
        """Those of the page's own WebSocket."""
        own = {"Host": self.own, "Origin": f"http://{self.own}"}
        return {**own, "Sec-WebSocket-Protocol": f"viser-v{self.viser.__version__}", **others}

    def open(self, **others: str) -> WebSocket:
        """The page's own WebSocket, or one with other headers."""
        return WebSocket(self.port, self.guard.path, self.headers(**others))

    def get(self, path: str | None = None, method: str = "GET", **others: str) -> tuple[int, dict[str, str], bytes]:
        """The answer to a request for the page, or for another one."""
        headers = {"Host": self.own, **others}
        return answer(self.port, request(self.guard.path if path is None else path, list(headers.items()), method))

    def serves(self) -> bool:
        """Whether a browser that comes now has its page, and moves the slider by it."""
        status, _, body = self.get()
        before = len(self.seen)
        value = 0.25 if self.slider.value != 0.25 else 0.5
        with self.open() as page:
            self.say(page, CAMERA, update(self.slider._impl.uuid, value=value))
            until(lambda: len(self.seen) > before)
        return status == 200 and b"<html" in body and self.seen[-1] == value

    def say(self, page: WebSocket, *messages: object) -> None:
        """Send messages as the page does."""
        for message in messages:
            page.send(self.msgpack.encode(message))


def until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"not within {seconds} s"
        time.sleep(0.01)


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    view = View()
    yield view
    stop_server(view.server)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", view.port), 10)


# Who is let in


def test_the_page_is_served_to_this_machine_alone(view: View) -> None:
    assert view.address == f"http://{view.own}{view.guard.path}"
    assert view.server.get_port() == view.port
    assert view.serves()
    listening = [c.laddr for c in psutil.Process().net_connections() if c.status == "LISTEN" and c.laddr.port == view.port]
    assert {address.ip for address in listening} == {"127.0.0.1"}


@pytest.mark.parametrize(
    ("path", "others"),
    [
        ("/", {}),
        ("/index.html", {}),
        ("/wrong/", {}),
        ("{page}index.html", {}),
        ("{page}../", {}),
        ("{page}%2e%2e/", {}),
        ("//{page}", {}),
        ("{page}", {"Host": "x.invalid"}),
        ("{page}", {"Host": "localhost:{port}"}),
        ("{page}", {"Host": "127.0.0.1"}),
        ("{page}", {"Origin": "http://x.invalid"}),
        ("{page}", {"Origin": "null"}),
        ("{page}", {"Upgrade": "h2c", "Connection": "Upgrade"}),
    ],
)
def test_a_request_that_is_not_the_pages_own_is_refused(view: View, path: str, others: dict[str, str]) -> None:
    others = {name: value.format(port=view.port) for name, value in others.items()}
    status, _, body = view.get(path.format(page=view.guard.path), **others)
    assert status == 403
    assert b"<html" not in body
    assert view.guard.path.strip("/").encode() not in body


@pytest.mark.parametrize("method", ["POST", "PUT", "OPTIONS", "HEAD", "CONNECT", "TRACE"])
def test_other_methods_have_no_answer(view: View, method: str) -> None:
    assert view.get(method=method)[0] in (0, 400, 405)


@pytest.mark.parametrize(
    ("path", "others"),
    [
        ("/", {}),
        ("/wrong/", {}),
        ("{page}", {"Host": "x.invalid"}),
        ("{page}", {"Host": "x.invalid:{port}", "Origin": "http://x.invalid:{port}"}),
        ("{page}", {"Origin": "http://x.invalid"}),
        ("{page}", {"Origin": "http://127.0.0.1:1"}),
        ("{page}", {"Origin": "null"}),
        ("{page}", {"Origin": ""}),
    ],
)
def test_a_socket_that_is_not_the_pages_own_is_refused(view: View, path: str, others: dict[str, str]) -> None:
    headers = view.headers(**{name: value.format(port=view.port) for name, value in others.items()})
    with WebSocket(view.port, path.format(page=view.guard.path), headers) as page:
        assert page.status == 403
    with view.open() as page:
        assert page.status == 101


def test_a_socket_without_an_origin_is_refused(view: View) -> None:
    headers = {name: value for name, value in view.headers().items() if name != "Origin"}
    with WebSocket(view.port, view.guard.path, headers) as page:
        assert page.status == 403


def test_two_hosts_or_origins_are_refused(view: View) -> None:
    own, page = ("Host", view.own), view.guard.path
    assert answer(view.port, request(page, [own, ("Host", "x.invalid")]))[0] == 403
    assert answer(view.port, request(page, []))[0] == 403
    socket_headers = [*UPGRADE.items(), own, ("Origin", f"http://{view.own}"), ("Origin", "http://x.invalid")]
    assert answer(view.port, request(page, socket_headers))[0] == 403


def test_the_page_is_shown_in_no_other_and_tells_nobody_its_address(view: View) -> None:
    headers = view.get()[1]
    policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
    assert policy["frame-ancestors"] == "'none'"
    assert policy["connect-src"] == f"'self' ws://{view.own} data: blob:"
    assert "http" not in policy["default-src"]
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"
    assert "access-control-allow-origin" not in headers


# What is taken from the page


def test_the_page_moves_its_controls(view: View) -> None:
    with view.open() as page:
        view.seen.clear()
        view.say(page, CAMERA, update(view.slider._impl.uuid, value=0.125))
        until(lambda: view.seen == [0.125])
        view.say(page, update(view.box._impl.uuid, value=not view.box.value), update(view.button._impl.uuid, value=True))
        until(lambda: len(view.seen) == 3)
        assert "click" in view.seen


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, "0.9", b"0.9", [0.9], [], {}, {"value": 0.9}, None, True, "x" * 60_000, [[[[0.9]]]]]
)
def test_what_is_no_number_moves_no_slider(view: View, value: object) -> None:
    view.slider.value = -0.5
    with view.open() as page:
        view.say(page, CAMERA, update(view.slider._impl.uuid, value=value))
        view.seen.clear()
        view.say(page, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
    assert view.slider.value == -0.5


@pytest.mark.parametrize(("value", "expected"), [(1e308, 1.0), (-1e308, -1.0), (2**63, 1.0), (5, 1.0), (1.0001, 1.0)])
def test_a_slider_stays_between_its_limits(view: View, value: float, expected: float) -> None:
    view.slider.value = 0.0
    with view.open() as page:
        view.say(page, CAMERA, update(view.slider._impl.uuid, value=value))
        until(lambda: view.slider.value == expected)


def test_other_messages_and_other_properties_change_nothing(view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    def shared(*_: object, **__: object) -> None:
        view.seen.append("shared with the world")

    monkeypatch.setattr(type(view.server), "request_share_url", shared)
    uuid = view.slider._impl.uuid
    upload = {"source_component_uuid": uuid, "transfer_uuid": "t", "filename": "f", "mime_type": "m", "part_count": 9}
    with view.open() as page:
        view.say(
            page,
            CAMERA,
            {"type": "ShareUrlRequest"},
            {"type": "FileTransferStartUpload", **upload, "size_bytes": 1 << 40},
            update(uuid, max=1e9, disabled=True, visible=False, hint="x", label="x"),
            update("unknown", value=1.0),
            update(view.box._impl.uuid, value="x"),
            {"type": "NoSuchMessage"},
            {"type": "GuiButtonHoldMessage", "uuid": view.button._impl.uuid, "frequency": 1e308},
        )
        view.seen.clear()
        view.say(page, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
        time.sleep(0.1)  # what is done in threads
    assert view.seen == ["click"]
    assert view.server.gui._current_file_upload_states == {}
    assert (view.slider.max, view.slider.disabled, view.slider.visible) == (1.0, False, True)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1",
        b"\xff",
        b"\x81",
        b"\xdd\xff\xff\xff\xff",
        b"\x91" * 60_000,
        b"\xc9\xff\xff\xff\xff",
        b"\x80",
        bytes(60_000),
        b"{}",
    ],
)
def test_what_is_no_message_is_ignored(view: View, payload: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    with view.open() as page:
        view.say(page, CAMERA)
        page.send(payload)
        page.send(b"a text", TEXT)
        view.seen.clear()
        view.say(page, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
    assert capfd.readouterr() == ("", "")


def test_what_is_no_request_is_not_told_in_the_terminal(view: View, caplog: pytest.LogCaptureFixture) -> None:
    for sent in (b"\x16\x03\x01\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/1.1\r\nno header\r\n\r\n", b"GET / HTTP/9\r\n\r\n"):
        assert answer(view.port, sent)[0] in (0, 400)
    with view.open() as page:
        page.go_on(b"\xff" * 100)
        assert page.close_code() == 1002
    assert view.serves()
    assert [record.getMessage() for record in caplog.records] == []


# Too much


def sent_in_pieces(page: WebSocket, total: int, frame: int | None = None) -> int:
    """Send so many bytes, as far as they are taken: as one message in one frame, or in many. Returns the largest memory seen."""
    process, piece, largest = psutil.Process(), bytes(frame or MIB), 0
    with contextlib.suppress(ConnectionError):
        if frame is None:
            page.begin(total)
        for i in range(total // len(piece)):
            if frame is None:
                page.go_on(piece)
            else:
                page.send(piece, MORE if i else 2, is_last=False)
            if i % 8 == 0:
                largest = max(largest, process.memory_info().rss)
    return max(largest, process.memory_info().rss)


@pytest.mark.parametrize("frame", [None, 32 * 1024], ids=["one frame", "many frames"])
def test_a_message_of_200_mb_is_cut_off_and_others_are_served(view: View, frame: int | None) -> None:
    before = psutil.Process().memory_info().rss
    with view.open() as other, view.open() as page:
        view.say(other, CAMERA)
        largest = sent_in_pieces(page, 200 * MIB, frame)
        view.seen.clear()
        view.say(other, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
        assert page.close_code() in (1009, 0)  # 0: cut off before it was read
    assert largest - before < 30 * MIB
    assert view.serves()


def test_200_mb_of_headers_are_not_kept(view: View) -> None:
    before, largest = psutil.Process().memory_info().rss, 0
    with socket.create_connection(("127.0.0.1", view.port), 60) as connection, contextlib.suppress(ConnectionError):
        connection.sendall(f"GET {view.guard.path} HTTP/1.1\r\nHost: {view.own}\r\nX: ".encode())
        for _ in range(200):
            connection.sendall(bytes(MIB))
            largest = max(largest, psutil.Process().memory_info().rss)
        assert b"200 OK" not in connection.recv(65536)
    assert largest - before < 30 * MIB
    assert view.serves()


@pytest.mark.parametrize(("length", "code"), [(LARGEST, None), (LARGEST + 1, 1009)])
def test_messages_have_a_largest_size(view: View, length: int, code: int | None) -> None:
    with view.open() as page:
        page.send(bytes(length))
        if code is not None:
            assert page.close_code() == code
            return
        view.seen.clear()
        view.say(page, CAMERA, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)


def test_nothing_is_taken_compressed(view: View) -> None:
    with view.open(**{"Sec-WebSocket-Extensions": "permessage-deflate"}) as page:
        assert page.status == 101
        assert "sec-websocket-extensions" not in page.headers


def test_a_flood_of_messages_waits_in_the_sender(view: View) -> None:
    count = 300
    with view.open() as page:
        view.say(page, CAMERA)
        view.seen.clear()
        start = time.monotonic()
        view.say(page, *[CAMERA] * count, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
        assert time.monotonic() - start > count * PAUSE


def test_only_so_many_pages_are_open_at_a_time(view: View) -> None:
    until(lambda: len(view.server._websock_server._live_connections) == 0)
    with contextlib.ExitStack() as stack:
        pages = [stack.enter_context(view.open()) for _ in range(MOST_PAGES)]
        assert {page.status for page in pages} == {101}
        with view.open() as page:
            assert page.status == 503
        view.seen.clear()
        view.say(pages[0], CAMERA, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
    until(lambda: len(view.server._websock_server._live_connections) == 0)
    assert view.serves()


def test_connections_that_ask_for_nothing_keep_nobody_out(view: View) -> None:
    with contextlib.ExitStack() as stack, view.open() as page:
        view.say(page, CAMERA)
        silent = [stack.enter_context(socket.create_connection(("127.0.0.1", view.port), 60)) for _ in range(3 * MOST_REQUESTS)]
        assert view.get()[0] == 200
        assert {end_of(connection) for connection in silent[: 2 * MOST_REQUESTS]} == {b""}
        view.seen.clear()
        view.say(page, update(view.button._impl.uuid, value=True))
        until(lambda: "click" in view.seen)
    assert view.serves()


def end_of(connection: socket.socket) -> bytes:
    """What comes from a connection before it ends; raises TimeoutError if it does not within a second."""
    connection.settimeout(1.0)
    try:
        return connection.recv(1)
    except ConnectionError:
        return b""


# It starts guarded or not at all


def one_line(error: BaseException) -> str:
    (line,) = str(error).splitlines()
    return line


@pytest.mark.parametrize(
    ("check", "status"), [("lets everybody in", 200), ("keeps everybody out", 403)], ids=["everybody", "nobody"]
)
def test_a_guard_that_does_not_hold_is_seen_at_the_start(
    check: str, status: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Guard, "lets_in", lambda *_: check == "lets everybody in")
    ports = []
    answer = server_module._status

    def asked(port: int, *rest: Any) -> int:
        ports.append(port)
        return answer(port, *rest)

    monkeypatch.setattr(server_module, "_status", asked)
    library: Any = importlib.import_module("websockets.asyncio.server")
    serve = library.serve
    with pytest.raises(EngineUnavailable, match=f"it answers {status} where") as error:
        start_server(importlib.import_module("viser"), Guard(), 0, "x")
    assert one_line(error.value)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", ports[-1]), 10)
    assert library.serve is serve
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["socket", "host"])
def test_each_check_is_tried(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one of the checks out, another answer comes, and the start is refused."""
    right = Guard.lets_in

    def without(self: Guard, port: int, path: str, hosts: list[str], origins: list[str], is_socket: bool) -> bool:
        if name == "host":
            hosts = [f"127.0.0.1:{port}"]
        elif is_socket:
            origins = [f"http://127.0.0.1:{port}"]
        return right(self, port, path, hosts, origins, is_socket)

    monkeypatch.setattr(Guard, "lets_in", without)
    with pytest.raises(EngineUnavailable, match=r"it answers \d+ where 403 is expected"):
        start_server(importlib.import_module("viser"), Guard(), 0, "x")


def test_a_websockets_that_takes_no_such_options_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    library: Any = importlib.import_module("websockets.asyncio.server")

    def serve(handler: Any, host: Any = None, port: Any = None, *, process_request: Any = None) -> None:
        raise AssertionError

    monkeypatch.setattr(library, "serve", serve)
    with pytest.raises(EngineUnavailable, match="it does not start, TypeError") as error:
        start_server(importlib.import_module("viser"), Guard(), 0, "x")
    assert one_line(error.value)
    assert capfd.readouterr() == ("", "")
