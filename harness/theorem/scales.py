"""The periods of the joints: a factor of 1/2 needs two turns, and whole numbers of halves as frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterable

from harness.theorem.chain import Chains


def scales_of(descriptions: Iterable[Chains]) -> tuple[int, ...]:
    """For each joint the common denominator of all factors by which it turns something, (n,)."""
    scales: list[int] = []
    for chains in descriptions:
        scales = scales or [1] * len(chains.joints)
        turning = {step for path in chains.paths.values() for step in path if step.turns and step.moves}
        for step in turning:
            scales = [math.lcm(s, x.denominator) for s, x in zip(scales, step.row, strict=True)]
    return tuple(scales)
