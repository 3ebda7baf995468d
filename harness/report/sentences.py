"""Parts of the report document as sentences that people read; shared by every format."""

from __future__ import annotations

import math
from collections.abc import Sequence

from harness.report.document import Source
from harness.report.model_parts import ParameterPair
from harness.report.regression import Changed, Moved, Regression
from harness.report.text import metres, quantity, radians

MAX_SAME = 3
DESCRIPTIONS = {"dh": "dh.csv", "urdf": "the URDF"}


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


def for_all(source: Source) -> str:
    """The bound over every configuration at the frame where it is largest: `<= 1.6e-11 m`, or `refused`."""
    if source.certificate is None:
        return ""
    if source.certificate.status == "refused":
        return "refused"
    return f"<= {metres(max(bound.position_upper for bound in source.certificate.frames))}"


def all_tested(sources: Sequence[Source]) -> str:
    """What can be said at once of all sources that compute what their own description says; empty if none was tested so."""
    good = [(s.name, s.tested) for s in sources if s.tested and s.tested.description and not s.tested.problem]
    if not good:
        return ""
    name, worst = max(good, key=lambda pair: max(pair[1].position, pair[1].rotation))
    off = f"{metres(worst.position)}, {radians(worst.rotation)} off at most ({name})"
    exact = all(max(t.position, t.rotation) <= t.limit for _, t in good)
    engines = "1 engine computes what its" if len(good) == 1 else f"{len(good)} engines compute what their"
    least = min(t.configurations for _, t in good)
    return f"{engines} own description says at {least} configurations tried, {'to rounding' if exact else off}"


def own_description(source: Source) -> str:
    """How far a source was tested against its own description, in a clause; empty if it was not."""
    t = source.tested
    if t is None or t.problem:
        return t.problem if t else ""
    if t.reason:
        return f"not compared with a description of its own: {t.reason}"
    at = f"at {t.configurations} configurations" + (f", up to {t.turns:.3g} turns" if t.turns else "")
    return f"computes what {DESCRIPTIONS[t.description]} says {at}: {metres(t.position)}, {radians(t.rotation)} off at most"


def further_out(source: Source) -> list[str]:
    """What a source does beyond the limits that does not speak against it, a clause each."""
    t, texts = source.tested, []
    if t is None:
        return []
    if t.refused:
        texts.append(f"does not answer beyond the joint limits: {t.refused}")
    if at := t.beyond:
        off = f"{metres(at.position)}, {radians(at.rotation)} at {at.frame}"
        texts.append(f"from {at.turns:.3g} turns on it is not what {DESCRIPTIONS[t.description]} says: {off}")
    if t.ignored_step and max(t.position, t.rotation) > t.limit:
        texts.append(f"ignores joint steps up to {t.ignored_step:g} rad or m, as its traits say")
    return texts
