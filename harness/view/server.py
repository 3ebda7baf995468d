"""Starts viser behind the guard of a view.

viser has no option for what the guard does. But it starts its server by one call of `serve` of the library websockets, which
takes all that is needed. While viser starts, that function is one that adds the guard. This was read in viser 1.1.1; other
versions than `VERSIONS` are refused. Whether the checks hold is tried at each start, before the page is filled. If they do
not, nothing is served.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import http
import http.client
import importlib
import io
import logging
import os
import queue
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

from packaging.specifiers import SpecifierSet
from packaging.version import InvalidVersion, Version

from harness.errors import InputError
from harness.view.guard import LOOPBACK, VERSIONS, Guard, Visitors, authority, page_headers, unknown_viser
from harness.view.messages import LARGEST, cleaned

PORTS = 1000  # tried at most, from the one asked for on
PAUSE = 0.002  # between two messages [s]: a flood waits in the sender
PATIENCE = 60.0  # with our own server [s]
REFUSED = "This is not the address that crosscheck view has printed. Open that one.\n"
FULL = "Too many pages of this view are open. Close one.\n"


def start_server(viser: Any, guard: Guard, port: int, label: str) -> tuple[Any, str]:
    """A `viser.ViserServer` behind the guard, and the address of its page.

    Args:
        viser: the module.
        guard: of this view.
        port: where to serve the page; the next free one if it is taken. 0: any.
        label: what the page shows as its name.

    Raises:
        EngineUnavailable: this viser is not one that can be guarded. Nothing is served then.
        InputError: no port is free.
    """
    version = str(getattr(viser, "__version__", "of an unknown version"))
    if not _is_known(version):
        raise unknown_viser(f"it is {version}")
    logging.getLogger("websockets").setLevel(logging.ERROR)  # a browser that goes away is no error of ours
    with contextlib.ExitStack() as undo:
        door = undo.enter_context(contextlib.closing(_listening(port)))
        port = door.getsockname()[1]
        with _guarded_serve(guard, door) as calls:
            server = _started(lambda: viser.ViserServer(host=LOOPBACK, port=0, label=label, verbose=False))
        undo.callback(stop_server, server)
        if len(calls) != 1:
            raise unknown_viser("it starts its server in another way")
        _try_out(guard, port)
        undo.pop_all()
    return server, guard.address(port)


def stop_server(server: Any) -> None:
    """End it, without a word."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _is_known(version: str) -> bool:
    try:
        return SpecifierSet(VERSIONS).contains(Version(version), prereleases=False)
    except InvalidVersion:
        return False


def _listening(first: int) -> socket.socket:
    """A socket that this machine alone can reach, at this port or the next free one. Raises InputError if there is none."""
    last = min(first + PORTS, 65536) - 1
    for port in range(first, last + 1):
        door = socket.socket()
        try:
            if os.name == "posix":  # a port of which old connections are still closing is free
                door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            door.bind((LOOPBACK, port))
            door.listen()
            return door
        except OSError:
            door.close()
    raise InputError(f"no port from {first} to {last} is free", key="--port")


def _started(make: Callable[[], Any]) -> Any:
    """What `make` returns. If a thread that it has started fails, it would wait for that one for ever: this does not.

    Raises EngineUnavailable if it fails or takes too long.
    """
    results: queue.SimpleQueue[tuple[Any, BaseException | None]] = queue.SimpleQueue()

    def run() -> None:
        try:
            results.put((make(), None))
        except BaseException as error:
            results.put((None, error))

    hook = threading.excepthook
    threading.excepthook = lambda args: results.put((None, args.exc_value))
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # its banner: the address is told elsewhere
            threading.Thread(target=run, daemon=True).start()
            server, error = results.get(timeout=PATIENCE)
    except queue.Empty:
        raise unknown_viser(f"it does not start within {PATIENCE:.0f} s") from None
    finally:
        threading.excepthook = hook
    if error is not None:
        raise unknown_viser(f"it does not start, {type(error).__name__}: {error}")
    return server


@contextlib.contextmanager
def _guarded_serve(guard: Guard, door: socket.socket) -> Iterator[list[object]]:
    """While it lasts, `websockets.asyncio.server.serve` starts servers at the door, behind the guard. Yields its calls."""
    library: Any = importlib.import_module("websockets.asyncio.server")
    serve, calls, visitors = library.serve, list[object](), Visitors()

    def guarded(handler: Any, host: Any = None, port: Any = None, **options: Any) -> Any:
        calls.append(handler)
        own = {
            "sock": door,
            "process_request": _request_check(guard, visitors, options.get("process_request")),
            "create_connection": _cleaning(options.get("create_connection") or library.ServerConnection, guard, visitors),
            "max_size": LARGEST,
            "compression": None,  # what is small on the way must not be large here
        }
        return serve(handler, **{**options, **own})

    library.serve = guarded
    try:
        yield calls
    finally:
        library.serve = serve


def _request_check(guard: Guard, visitors: Visitors, inner: Callable[..., Any] | None) -> Callable[..., Any]:
    """`process_request` of the server: the checks of the guard, then the page, and no other file."""

    def process(connection: Any, request: Any) -> Any:
        headers, port = request.headers, connection.local_address[1]
        is_socket = bool(headers.get_all("Upgrade"))
        if not guard.lets_in(port, request.path, headers.get_all("Host"), headers.get_all("Origin"), is_socket):
            return connection.respond(http.HTTPStatus.FORBIDDEN, REFUSED)
        response = inner(connection, dataclasses.replace(request, path="/")) if inner else None
        if response is not None:
            response.headers.update(page_headers(port))
            return response
        return None if visitors.opens_page(connection) else connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, FULL)

    return process


def _cleaning(base: Any, guard: Guard, visitors: Visitors) -> Any:
    """The class of a connection from which only cleaned messages are read."""
    msgpack = importlib.import_module("msgspec.msgpack")

    class Cleaning(base):  # type: ignore[misc]
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            visitors.came(self)

        def connection_lost(self, exc: Exception | None) -> None:
            visitors.went(self)
            super().connection_lost(exc)

        async def recv(self, *_: Any, **__: Any) -> bytes:
            while True:
                raw = await super().recv()
                await asyncio.sleep(PAUSE)
                message = None
                with contextlib.suppress(Exception):  # a text, no msgpack, or nested too deeply
                    message = cleaned(msgpack.decode(raw), guard.controls)
                if message is not None:
                    return bytes(msgpack.encode(message))

        def recv_streaming(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError("messages are read whole")

    return Cleaning


def _try_out(guard: Guard, port: int) -> None:
    """Ask our own server for what it must refuse, and for the page. Raises EngineUnavailable if an answer is another."""
    own, page = authority(port), guard.path
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade"}
    upgrade |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "A" * 22 + "=="}
    asked: tuple[tuple[str, dict[str, str], int], ...] = (
        ("/", {"Host": own}, 403),
        (page, {"Host": "x.invalid"}, 403),
        ("/", {"Host": own, "Origin": f"http://{own}", **upgrade}, 403),
        (page, {"Host": own, "Origin": "http://x.invalid", **upgrade}, 403),
        (page, {"Host": own}, 200),
    )
    for path, headers, expected in asked:
        if (status := _status(port, path, headers)) != expected:
            raise unknown_viser(f"it answers {status} where {expected} is expected")


def _status(port: int, path: str, headers: dict[str, str]) -> int:
    """The status of the answer to a request; 0 if there is none."""
    connection = http.client.HTTPConnection(LOOPBACK, port, timeout=PATIENCE)
    try:
        connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    except (OSError, http.client.HTTPException):
        return 0
    finally:
        connection.close()
