"""What runs inside a report: our own scripts and Plotly, packed into the page, named one by one in its security policy."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from functools import lru_cache
from importlib.resources import files
from typing import Any, NamedTuple


class Script(NamedTuple):
    """The text of a script, and the hash by which a Content-Security-Policy lets it run."""

    text: str
    hash: str


def _script(text: str) -> Script:
    return Script(text, "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'")


@lru_cache
def own(name: str) -> Script:
    """A script of ours, from the templates folder."""
    return _script((files("harness.rendering") / "templates" / name).read_text(encoding="utf-8"))


class Packed(NamedTuple):
    """Plotly, gzipped, in base64: a third of its size. hash: of the text that comes out."""

    text: str
    hash: str
    version: str


@lru_cache
def plotly() -> Packed:
    """plotly.js as the installed `plotly` package brings it; the page inflates it, nothing is loaded from anywhere."""
    text = (files("plotly") / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
    packed = base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()
    return Packed(packed, _script(text).hash, text[:200].partition("plotly.js v")[2].split("\n")[0])


def data(value: Any) -> str:
    """JSON that can stand inside a script element: nothing in it ends the element or opens a comment."""
    text = json.dumps(value, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
