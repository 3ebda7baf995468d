"""Asks a server on this machine as a browser would, or as none would: raw requests, and a WebSocket frame by frame."""

from __future__ import annotations

import contextlib
import socket
import struct
from types import TracebackType

BINARY, TEXT, CLOSE, MORE = 2, 1, 8, 0
UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
}


def request(path: str, headers: list[tuple[str, str]], method: str = "GET") -> bytes:
    """A request as it goes over the wire."""
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers), "", ""]
    return "\r\n".join(lines).encode("utf-8", "surrogateescape")


def answer(port: int, sent: bytes) -> tuple[int, dict[str, str], bytes]:
    """Status (0: none), headers and body of the answer to what was sent."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
        connection.sendall(sent)
        got = b""
        with contextlib.suppress(ConnectionError):
            while piece := connection.recv(65536):
                got += piece
    return parsed(got)


def parsed(got: bytes) -> tuple[int, dict[str, str], bytes]:
    """Status, headers (names in lower case) and what comes after them."""
    head, _, body = got.partition(b"\r\n\r\n")
    first, *lines = head.decode("latin-1").split("\r\n")
    headers = dict(line.split(": ", 1) for line in lines)
    return int(first.split(" ")[1]) if first else 0, {name.lower(): value for name, value in headers.items()}, body


class WebSocket:
    """One that was asked for. `status`: of the answer, 101 if it is open; 0 without an answer."""

    def __init__(self, port: int, path: str, headers: dict[str, str]) -> None:
        self._connection = socket.create_connection(("127.0.0.1", port), timeout=60)
        with contextlib.suppress(ConnectionError):
            self._connection.sendall(request(path, list({**UPGRADE, **headers}.items())))
        got = b""
        with contextlib.suppress(ConnectionError):
            while b"\r\n\r\n" not in got and (piece := self._connection.recv(65536)):
                got += piece
        self.status, self.headers, self._rest = parsed(got)

    def __enter__(self) -> WebSocket:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._connection.close()

    def send(self, payload: bytes, opcode: int = BINARY, is_last: bool = True) -> None:
        """Send one frame."""
        self.begin(len(payload), opcode, is_last)
        self.go_on(payload)

    def begin(self, length: int, opcode: int = BINARY, is_last: bool = True) -> None:
        """Send the head of a frame of this length; its mask is zero, which changes nothing."""
        first = bytes([opcode | (0x80 if is_last else 0)])
        if length < 126:
            size = bytes([0x80 | length])
        elif length < 1 << 16:
            size = b"\xfe" + struct.pack("!H", length)
        else:
            size = b"\xff" + struct.pack("!Q", length)
        self.go_on(first + size + bytes(4))

    def go_on(self, payload: bytes) -> None:
        """Send bytes as they are."""
        self._connection.sendall(payload)

    def close_code(self) -> int:
        """Wait for the end of the connection; the code that it was closed with, 0 without one. Raises TimeoutError."""
        got = self._rest
        with contextlib.suppress(ConnectionError):
            while piece := self._connection.recv(1 << 16):
                got += piece
        while len(got) >= 2:
            opcode, size, start = got[0] & 0x0F, got[1] & 0x7F, 2
            if size == 126:
                size, start = struct.unpack("!H", got[2:4])[0], 4
            elif size == 127:
                size, start = struct.unpack("!Q", got[2:10])[0], 10
            if opcode == CLOSE:
                return int(struct.unpack("!H", got[start : start + 2])[0])
            got = got[start + size :]
        return 0
