"""What is to be said beside an explanation: another unit, digits that were left off, a search that was ended."""

from __future__ import annotations

import math

from harness.cause.changes import GAUGE, Change
from harness.cause.explain import Explanation


def remarks(explanation: Explanation) -> list[str]:
    """One sentence each; empty if the lengths have nothing in common, and if the search was not ended."""
    sentences = []
    if explanation.ended:
        sentences.append(f"the search for changes that do the same was ended after {explanation.ended} evaluations")
    lengths = _lengths(explanation)
    if len(lengths) < 2:
        return sentences
    ratios = sorted(1.0 + c.size / c.before for c in lengths if min(abs(c.before), abs(c.before + c.size)) > 1e-6)
    middle = ratios[len(ratios) // 2] if ratios else 1.0
    if len(ratios) >= 3 and ratios[-1] < 1.1 * ratios[0] and abs(math.log(abs(middle))) > math.log(1.5):
        sentences.append(
            f"{len(ratios)} lengths are {ratios[0]:.3g} to {ratios[-1]:.3g} times as large in one as in the other: another unit"
        )
    rounded = [c for c in lengths if abs(c.size) <= 0.5001 * 10.0 ** -_decimals(c.before)]
    if len(rounded) >= 2:
        largest = max(abs(c.size) for c in rounded) * 1e3
        count = f"{len(rounded)} of {len(lengths)} lengths"
        sentences.append(f"{count} differ only beyond the digits given, by at most {largest:.3g} mm: rounded there")
    return sentences


def _lengths(explanation: Explanation) -> list[Change]:
    """One change of a length on file for each slot that has one, base and tool aside; one that was not zero, if there is."""
    groups = [
        [c for c in (change, *others) if c.kind == "parameter" and c.unit == "m" and not c.parameter.startswith(GAUGE)]
        for change, others in zip(explanation.changes, explanation.equivalents, strict=True)
    ]
    return [next((c for c in group if c.before != 0.0), group[0]) for group in groups if group]


def _decimals(x: float) -> int:
    """Digits behind the point of the shortest text that reads back as x."""
    text = f"{x:.12f}".rstrip("0")
    return len(text.partition(".")[2])
