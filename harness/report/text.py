"""Numbers and names as people read them; shared by every format."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from harness.report.document import Source
from harness.report.model_parts import ParameterPair
from harness.report.regression import Changed, Moved, Regression

MAX_SAME = 3

# C0 and C1 controls, line separators and bidirectional overrides change more than their own letters; surrogates and
# non-characters cannot be written to XML.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def plain(text: str) -> str:
    """`text` on one line, every control character replaced by U+FFFD: safe on a terminal and in XML."""
    return _CONTROL.sub("\ufffd", text.replace("\n", " ").replace("\t", " "))


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


def change_of(pair: ParameterPair, value: float) -> str:
    """A canonical number in mm or degrees, nine digits, rounding left off."""
    scale = 1e3 if pair.unit == "m" else 180.0 / math.pi
    return f"{round(value * scale, 6) + 0.0:.9g}"


def difference(pair: ParameterPair) -> str:
    """`-0.301 mm`, `+0.0002 deg`: what the URDF has more than the table."""
    scale, unit = (1e3, "mm") if pair.unit == "m" else (180.0 / math.pi, "deg")
    return f"{pair.difference * scale:+.6g} {unit}"


def moved_text(moved: Moved) -> str:
    """`urdf:pinocchio at tool0: position 1e-12 m, now 0.301 mm`."""
    before, after = quantity(moved.before, moved.unit), quantity(moved.after, moved.unit)
    return f"{moved.source} at {moved.frame}: {moved.quantity} {before}, now {after}"


def changed_text(changed: Changed) -> str:
    """`urdf:pinocchio: agrees, now disagrees`."""
    return f"{changed.what}: {changed.before}, now {changed.after}"


def worsened(found: Regression) -> list[str]:
    """What a strict run fails for, a line each."""
    lines = [found.problem] if found.problem else []
    lines += [moved_text(m) for m in found.grown]
    return lines + [changed_text(c) for c in found.changed if c.worse]


def numbers(values: Iterable[float], digits: int = 6) -> str:
    """`[0.2, -1.1, 0]`."""
    return "[" + ", ".join(f"{0.0 if v == 0 else v:.{digits}g}" for v in values) + "]"


def point(values: Iterable[float]) -> str:
    """A position [m] without what rounding leaves of a zero: `[0, -0.39225, 0]`."""
    return numbers([round(v, 12) for v in values])


def degrees(values: Iterable[float]) -> str:
    """Angles in degrees: `[90, 0, 30]`."""
    return numbers([round(math.degrees(v), 6) for v in values])


def why(source: Source) -> list[str]:
    """The explanation, one change a line, each with what would do the same; then what it leaves. Empty if there is none."""
    found = source.explanation
    if found is None:
        return []
    if not found.changes:
        return [f"unexplained: {found.unexplained}"]
    lines = []
    for change in found.changes:
        lines.append(change.text)
        if change.equivalents:
            more = f"; and {len(change.equivalents) - MAX_SAME} more" if len(change.equivalents) > MAX_SAME else ""
            same = "; ".join(other.text for other in change.equivalents[:MAX_SAME])
            lines.append(f"  the same: {same}{more}")
    before = f"{metres(found.before_position)}, {radians(found.before_rotation)}"
    lines.append(f"  tried: {before} before, {metres(found.after_position)}, {radians(found.after_rotation)} after")
    return lines


def for_all(source: Source) -> str:
    """The bound over every configuration at the frame where it is largest: `<= 1.6e-11 m`, or `refused`."""
    if source.certificate is None:
        return ""
    if source.certificate.status == "refused":
        return "refused"
    return f"<= {metres(max(bound.position_upper for bound in source.certificate.frames))}"
