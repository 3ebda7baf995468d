"""Plain numbers and names as people read them; shared by every format. Nothing of the report document is imported here."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable

# C0 and C1 controls, line separators and bidirectional overrides change more than their own letters; surrogates and
# non-characters cannot be written to XML.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def plain(text: str) -> str:
    """`text` on one line, every control character replaced by U+FFFD: safe on a terminal and in XML."""
    return _CONTROL.sub("\ufffd", text.replace("\n", " ").replace("\t", " "))


_WORD = r"""(?:[\w@%+=:,./-]|'[^']*'|"'"|\$'(?:[^'\\]|\\[^'])*')+"""
_INERT = re.compile(rf"crosscheck(?: {_WORD})*", re.ASCII)


def pasteable(command: str) -> str:
    """A command line of `crosscheck`, as it is if every word is quoted that a shell would otherwise read as more than a word.

    Any other text, from a report that somebody else has written, comes back as one quoted word: pasted, it runs nothing.
    """
    return command if not command or _INERT.fullmatch(command) else shlex.quote(command)


def metres(x: float) -> str:
    """`0.301 mm` from a tenth of a millimetre up, `5.3e-12 m` below."""
    if x == 0.0:
        return "0 m"
    return f"{x * 1000:.3f} mm" if 1e-4 <= x < 1.0 else f"{x:.4g} m" if x >= 1.0 else f"{x:.1e} m"


def radians(x: float) -> str:
    """`1.25 deg` from 1e-4 rad up, `2.0e-11 rad` below."""
    if x == 0.0:
        return "0 rad"
    return f"{math.degrees(x):.3g} deg" if x >= 1e-4 else f"{x:.1e} rad"


def quantity(x: float, unit: str) -> str:
    """A length or an angle."""
    return metres(x) if unit == "m" else radians(x)


def numbers(values: Iterable[float], digits: int = 6) -> str:
    """`[0.2, -1.1, 0]`."""
    return "[" + ", ".join(f"{0.0 if v == 0 else v:.{digits}g}" for v in values) + "]"


def point(values: Iterable[float]) -> str:
    """A position [m] without what rounding leaves of a zero: `[0, -0.39225, 0]`."""
    return numbers([round(v, 12) for v in values])


def degrees(values: Iterable[float]) -> str:
    """Angles in degrees: `[90, 0, 30]`."""
    return numbers([round(math.degrees(v), 6) for v in values])
