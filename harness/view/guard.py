"""Which requests and messages a view takes: those of its own page, in the browser that was given the address.

A page of some website can reach servers of this machine from the user's browser. Three checks of each request keep it out:

- Host must be the address that is served. A name of the attacker's that leads to this machine is refused.
- The path must be a secret. Only the address that is printed and opened has it.
- A WebSocket must come from this very page, by its Origin.

`harness.view.server` puts this before viser, `harness.view.messages` looks at each message.
"""

from __future__ import annotations

import hmac
import secrets
from typing import Any

from harness.errors import EngineUnavailable
from harness.view.messages import Range

LOOPBACK = "127.0.0.1"
VERSIONS = ">=1.1,<1.2"  # of viser, as in pyproject.toml
MOST_PAGES = 16  # open at a time
MOST_REQUESTS = 64  # connections at a time that are not, or not yet, an open page


def authority(port: int) -> str:
    """The address of the server as a browser writes it in Host and Origin: port 80 is left out."""
    return LOOPBACK if port == 80 else f"{LOOPBACK}:{port}"


def unknown_viser(why: str) -> EngineUnavailable:
    """The error for a viser that is not what was read: it would not be kept to its own page."""
    reason = f"this viser cannot be kept to its own page ({why}); it is known for viser {VERSIONS}"
    return EngineUnavailable("view", reason, "pip install 'fk-crosscheck[view]'")


class Guard:
    """What one view takes. `controls`: what may be moved on its page, and how far; the page fills it."""

    def __init__(self) -> None:
        self.controls: dict[str, Range | None] = {}
        self._token = secrets.token_urlsafe(32)

    def address(self, port: int) -> str:
        """The address of the page, the secret in it."""
        return f"http://{authority(port)}{self.path}"

    @property
    def path(self) -> str:
        """The path of the page: the secret."""
        return f"/{self._token}/"

    def add(self, control: Any, limits: Range | None = None) -> None:
        """Let the browser use a control of the page.

        Args:
            control: what viser returned when the control was added.
            limits: of a slider [rad or m]; None for a box or a button.

        Raises:
            EngineUnavailable: viser names its controls in another way.
        """
        try:
            self.controls[control._impl.uuid] = limits
        except AttributeError:
            raise unknown_viser("its controls have no identifier") from None

    def lets_in(self, port: int, path: str, hosts: list[str], origins: list[str], is_socket: bool) -> bool:
        """Whether a request is the page's own.

        Args:
            port: the port that it came in by.
            path: the path asked for, with what comes after a question mark.
            hosts: the values of its headers Host.
            origins: the values of its headers Origin.
            is_socket: whether it asks for a WebSocket, which always has an Origin in a browser.
        """
        own = authority(port)
        asked = path.partition("?")[0].removesuffix("/").encode("utf-8", "surrogateescape")
        knows = hmac.compare_digest(asked, self.path.removesuffix("/").encode())  # in a time that tells nothing of the secret
        from_here = origins == [f"http://{own}"] or (not origins and not is_socket)
        return knows and hosts == [own] and from_here


class Visitors:
    """The connections that are open, of which there is only so many: pages, and others in the order in which they came."""

    def __init__(self) -> None:
        self._others: dict[Any, None] = {}
        self._pages: set[Any] = set()

    def came(self, connection: Any) -> None:
        """A connection was made. If there are too many, the oldest that is no page is closed: it may ask for nothing for ever."""
        if len(self._others) >= MOST_REQUESTS:
            oldest = next(iter(self._others))
            del self._others[oldest]
            oldest.transport.abort()
        self._others[connection] = None

    def opens_page(self, connection: Any) -> bool:
        """Count a connection as an open page; False if there are too many."""
        if len(self._pages) >= MOST_PAGES:
            return False
        self._others.pop(connection, None)
        self._pages.add(connection)
        return True

    def went(self, connection: Any) -> None:
        """A connection is lost."""
        self._others.pop(connection, None)
        self._pages.discard(connection)


def page_headers(port: int) -> dict[str, str]:
    """Headers of the page: shown in no other page, its address told to nobody, nothing loaded from or sent to elsewhere."""
    own = f"'self' ws://{authority(port)} data: blob:"
    policy = (
        "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'",  # viser's page unpacks itself
        f"connect-src {own}",
        "frame-ancestors 'none'",
        "base-uri 'none'",
        "form-action 'none'",
    )
    return {
        "Content-Security-Policy": "; ".join(policy),
        "Referrer-Policy": "no-referrer",
        "X-Frame-Options": "DENY",
        "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cache-Control": "no-store",
    }
