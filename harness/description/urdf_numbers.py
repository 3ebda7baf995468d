"""The numbers of a URDF: a strict grammar, that of urdfdom, and bounds on what a description can hold.

urdfdom reads a number by a C++ stream in the classic locale. So `1_0`, `0x10`, `inf`, `nan`, digits of other scripts and text
behind the number are refused here too, although Python would read some of them.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from lxml import etree

from harness.description.values import LARGEST_ANGLE, LARGEST_LENGTH
from harness.description.written import decimal, is_decimal
from harness.errors import UrdfError

# A factor or the part of a direction has no unit; larger ones than this overflow further on.
LARGEST_FACTOR = 1e9
SPACES = " \t\r\n\f\v"

_SHOWN = 60


def parsed(text: str) -> tuple[float, ...] | None:
    """The numbers of a text, separated by ASCII white space; None if one is no number, or not finite."""
    values = []
    for word in re.split(f"[{SPACES}]+", text.strip(SPACES)):
        if not is_decimal(word):
            return None
        values.append(decimal(word))
    return tuple(values) if all(math.isfinite(value) for value in values) else None


def numbers(
    element: etree._Element | None, key: str, path: Path, count: int, default: tuple[float, ...] | None
) -> tuple[float, ...]:
    """The numbers of one attribute.

    Args:
        element: the element, a child of a `<joint>`; None if there is none.
        key: the attribute.
        path: the file, for messages.
        count: how many numbers there must be.
        default: what an absent attribute means; None if it must be there.

    Raises:
        UrdfError: it is absent, is not so many finite numbers, or is too large.
    """
    text = None if element is None else element.get(key)
    if element is None or text is None:
        if default is not None:
            return default
        raise UrdfError(f"<axis> has no attribute {key!r}", where=path, line=line_of(element))
    values = parsed(text)
    if values is None or len(values) != count:
        what = f"{count} finite numbers" if count > 1 else "a finite number"
        raise UrdfError(f"expected {what} in {key}, got {shown(text)}", where=path, line=line_of(element), hint=_hint(text))
    largest, unit = _bound(element, key)
    if (worst := max(values, key=abs)) and abs(worst) > largest:
        problem = f"expected at most {largest:g}{unit} in {key}, got {worst:g}"
        raise UrdfError(problem, where=path, line=line_of(element), key=f"{_joint_name(element)} <{element.tag}> {key}")
    return values


def shown(text: str) -> str:
    """A text as messages show it, cut to a length."""
    return repr(text) if len(text) <= _SHOWN else f"{text[:_SHOWN]!r}..."


def line_of(element: etree._Element | None) -> int:
    """Line of an element in its file; 0 if it has none."""
    return int(getattr(element, "sourceline", None) or 0)


def _bound(element: etree._Element, key: str) -> tuple[float, str]:
    """Largest magnitude that an attribute may have, and its unit. Joint limits may be of any size: large ones mean none."""
    if element.tag == "limit":
        return math.inf, ""
    if element.tag == "origin":
        return (LARGEST_LENGTH, " m") if key == "xyz" else (LARGEST_ANGLE, " rad")
    if key == "offset":
        joint = element.getparent()
        slides = joint is not None and joint.get("type") == "prismatic"
        return (LARGEST_LENGTH, " m") if slides else (LARGEST_ANGLE, " rad")
    return LARGEST_FACTOR, ""


def _joint_name(element: etree._Element) -> str:
    joint = element.getparent()
    return f"joint {joint.get('name')!r}" if joint is not None else ""


def _hint(text: str) -> str | None:
    """The way out of the usual mistakes; None if it is none of them."""
    if "," in text:
        return "separate numbers by spaces, and write decimals with a point"
    if re.search(r"[0-9.]\s*(m|mm|cm|rad|deg|°)(\s|$)", text):
        return "write numbers without units, in metres and radians"
    if "pi" in text.lower():
        return "write the value of pi out: 3.141592653589793"
    return None
