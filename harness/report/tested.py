"""What was tested of the engines, as sentences; shared by every format."""

from __future__ import annotations

from collections.abc import Sequence

from harness.report.document import Source
from harness.report.tested_parts import DESCRIPTIONS
from harness.report.text import metres, radians


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
