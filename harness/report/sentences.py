"""Parts of the report document as sentences that people read; shared by every format."""

from __future__ import annotations

import math

from harness.report.document import Source
from harness.report.model_parts import ParameterPair
from harness.report.regression import Changed, Moved, Regression
from harness.report.text import metres, quantity, radians

MAX_SAME = 3


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


def worsened(regression: Regression) -> list[str]:
    """What a strict run fails for, a line each."""
    lines = [regression.problem] if regression.problem else []
    lines += [moved_text(m) for m in regression.grown]
    return lines + [changed_text(c) for c in regression.changed if c.worse]


def why(source: Source) -> list[str]:
    """The explanation, one change a line, each with what would do the same; then what it leaves. Empty if there is none."""
    explanation = source.explanation
    if explanation is None:
        return []
    if not explanation.changes:
        return [f"unexplained: {explanation.unexplained}"]
    lines = []
    for change in explanation.changes:
        lines.append(change.text)
        if change.equivalents:
            more = f"; and {len(change.equivalents) - MAX_SAME} more" if len(change.equivalents) > MAX_SAME else ""
            same = "; ".join(other.text for other in change.equivalents[:MAX_SAME])
            lines.append(f"  the same: {same}{more}")
    before = f"{metres(explanation.before_position)}, {radians(explanation.before_rotation)}"
    lines.append(f"  tried: {before} before, {metres(explanation.after_position)}, {radians(explanation.after_rotation)} after")
    return lines
