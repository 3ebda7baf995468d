"""Attributes and elements of a `<joint>` that URDF does not have: a slip of spelling, or an extension that nobody reads.

Engines let them pass, and take the default for what was meant: an `<origin xzy="...">` is no origin. So where the right name is
missing, and has kinematic meaning, the file is refused; elsewhere it is a warning.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path

from lxml import etree

from harness.description.finding import Finding, about
from harness.description.urdf_numbers import line_of, parsed, shown
from harness.errors import UrdfError

# The last three of <limit> came with later versions of the format.
KNOWN = {
    "origin": ("xyz", "rpy"),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"),
    "mimic": ("joint", "multiplier", "offset"),
}
# What decides where a link is, or how far a joint goes.
KINEMATIC = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper"),
    "mimic": ("joint", "multiplier", "offset"),
}
# A fixed joint does not move: what these say of it has no meaning.
MEANINGLESS_IF_FIXED = ("axis", "limit", "mimic")
OTHER_ELEMENTS = ("calibration", "dynamics", "safety_controller")
# Names that are not spelt alike, from other formats and from extensions.
MEANT = {
    **dict.fromkeys(("pos", "position", "trans", "translation"), "xyz"),
    **dict.fromkeys(("euler", "quat", "quat_wxyz", "quat_xyzw", "orientation", "rotation"), "rpy"),
}
LONGEST_NAME = 40
# Numbers that say nothing of where a link is, at any joint and at a fixed one.
LOOSE: dict[str, tuple[str, ...]] = {"limit": ("effort", "velocity"), "mimic": ()}
LOOSE_IF_FIXED: dict[str, tuple[str, ...]] = {"limit": ("lower", "upper"), "mimic": ("multiplier", "offset")}


class Spelling:
    """Collects what is misspelt without harm in the joints of one file; raises for the rest."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._joints: dict[tuple[str, str], list[tuple[str, int]]] = {}

    def check(self, joint: etree._Element) -> None:
        """Look at one joint.

        Raises:
            UrdfError: an engine would take a default for what is misspelt.
        """
        name, fixed = str(joint.get("name")), joint.get("type") == "fixed"
        present = {child.tag for child in joint}
        for child in joint:
            tag = child.tag
            if not isinstance(tag, str) or tag.startswith("{"):
                continue
            if tag in ("limit", "mimic"):
                self._numbers(child, name, fixed)
            if fixed and tag == "axis":
                self._fixed_axis(child, name)
            elif tag in KNOWN:
                self._attributes(child, name, fixed and tag in MEANINGLESS_IF_FIXED)
            elif tag not in OTHER_ELEMENTS and (meant := spelt_like(tag, KNOWN, 0.7)) and meant not in present:
                harmless = meant == "limit" or (fixed and meant in MEANINGLESS_IF_FIXED)
                self._report(f"no <{meant}>, it has <{tag}>; did you mean <{meant}>?", name, child, harmless)

    def findings(self) -> list[Finding]:
        """What was misspelt without harm, one finding a kind."""
        return [about(code, "warning", what, joints) for (code, what), joints in self._joints.items()]

    def _fixed_axis(self, axis: etree._Element, name: str) -> None:
        """An axis without direction: nothing turns about it, yet some engines read it all the same."""
        text = axis.get("xyz")
        if text is not None:
            values = parsed(text)
            if values is None or len(values) != len("xyz"):
                what = f"<axis> of a fixed joint: expected 3 finite numbers in xyz, got {shown(text)}"
                self._add("fixed-axis-not-numbers", what, name, axis)
            return
        misspelt = next((key for key in map(str, axis.attrib) if spelt_like(key, KNOWN["axis"])), None)
        typo = f", it has {shown(misspelt)}; did you mean 'xyz'?" if misspelt else ""
        self._add("fixed-axis-without-xyz", f"<axis> of a fixed joint: no attribute 'xyz'{typo}", name, axis)

    def _numbers(self, element: etree._Element, name: str, fixed: bool) -> None:
        """Numbers that say nothing of where a link is. Those that do are read, and refused, with the joint."""
        for key in LOOSE[element.tag] + (LOOSE_IF_FIXED[element.tag] if fixed else ()):
            text = element.get(key)
            if text is None or len(parsed(text) or ()) == 1:
                continue
            what = element.tag if key in LOOSE[element.tag] else f"fixed-{element.tag}"
            code = f"{what}-not-finite" if _python_reads(text) else f"{what}-not-a-number"
            self._add(code, f"<{element.tag}>: expected a finite number in {key}, got {shown(text)}", name, element)

    def _attributes(self, element: etree._Element, name: str, meaningless: bool) -> None:
        tag = element.tag
        known = KINEMATIC.get(tag, ())
        has_none = tag != "limit" and bool(known) and not any(element.get(k) is not None for k in known)
        for key in map(str, element.attrib):
            if key in KNOWN[tag] or key.startswith("{"):
                continue
            meant = spelt_like(key, KNOWN[tag]) or (MEANT.get(key.casefold()) if tag == "origin" else None)
            if meant is not None and element.get(meant) is None:
                what = f"<{tag}> has no attribute {meant!r}, it has {shown(key)}; did you mean {meant!r}?"
            else:
                what = f"<{tag}> has an attribute {shown(key)} that URDF does not know; known: {', '.join(KNOWN[tag])}"
            replaces = meant in known and element.get(str(meant)) is None
            self._report(what, name, element, meaningless or not (replaces or has_none))

    def _report(self, what: str, joint: str, element: etree._Element, harmless: bool) -> None:
        if not harmless:
            raise UrdfError(f"joint {joint!r}: {what}", where=self._path, line=line_of(element))
        self._add("unknown-attribute", what, joint, element)

    def _add(self, code: str, what: str, joint: str, element: etree._Element) -> None:
        self._joints.setdefault((code, what), []).append((joint, line_of(element)))


def _python_reads(text: str) -> bool:
    """Whether an engine written in Python reads it: `inf`, `nan`, `1_0`."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def spelt_like(name: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The known name that is spelt most like this one, whatever its case; None if none is near.

    Args:
        name: the name.
        known: the names it may be.
        cutoff: how alike they must be, from 0 to 1, where 1 is the same.
    """
    if len(name) > LONGEST_NAME:
        return None
    folded = name.casefold()
    if swapped := next((k for k in known if sorted(k) == sorted(folded)), None):
        return swapped
    close = difflib.get_close_matches(folded, list(known), n=1, cutoff=cutoff)
    return close[0] if close else None
