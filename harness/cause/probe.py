"""The configurations at which two models are compared, and what each row of the answers is for.

The rows come in four groups, in this order:

1. FITTED random configurations, which repairs are fitted to;
2. CHECKED random configurations, which check that a repair holds elsewhere as well;
3. zero;
4. one finite step of each joint, from which its screw is read.

The first group is the part "fit", the rest is the part "check". Only this module knows the order: ask a `Probe` for rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from harness.kinematics.screws import step_configurations
from harness.se3 import Array

FITTED = 16
CHECKED = 48
SEED = 0

Part: TypeAlias = Literal["fit", "check"]
PARTS: tuple[Part, ...] = ("fit", "check")


@dataclass(frozen=True)
class Observations:
    """Placements of both sides at the same configurations.

    q: configurations (N, n) [rad or m].
    a, b: placements of F frames, (N, F, 4, 4) each [m].
    """

    q: Array
    a: Array
    b: Array


@dataclass(frozen=True)
class Probe:
    """The configurations at which both sides are asked.

    random: random configurations (FITTED + CHECKED, n) [rad or m].
    steps: zero, then one finite step of each joint, (n + 1, n) [rad or m].
    """

    random: Array
    steps: Array

    @classmethod
    def within(cls, lower: Array, upper: Array, prismatic: Sequence[bool]) -> Probe:
        """The probe of one robot. Every call with the same arguments gives the same configurations.

        lower, upper: between which each joint is drawn, (n,) [rad or m].
        prismatic: for each joint whether it slides.
        """
        random = np.random.default_rng(SEED).uniform(lower, upper, (FITTED + CHECKED, len(lower)))
        return cls(random, step_configurations(prismatic))

    @cached_property
    def q(self) -> Array:
        """All configurations, (FITTED + CHECKED + 1 + n, n) [rad or m]: ask both sides here, in this order."""
        return np.concatenate([self.random, self.steps])

    def observed(self, T_a: Array, T_b: Array) -> dict[Part, Observations]:
        """The answers of both sides at `q`, (N, F, 4, 4) each, cut into parts. Raises ValueError if rows are missing."""
        if not len(T_a) == len(T_b) == len(self.q):
            raise ValueError(f"{len(self.q)} configurations were asked; there are {len(T_a)} and {len(T_b)} placements")
        cuts: dict[Part, slice] = {"fit": slice(FITTED), "check": slice(FITTED, None)}
        return {part: Observations(self.q[cut], T_a[cut], T_b[cut]) for part, cut in cuts.items()}

    def sampled(self, check: Array) -> Array:
        """Of the rows of the part "check" (configurations or placements), those at random configurations."""
        return check[:CHECKED]

    def stepped(self, check: Array) -> Array:
        """Of the rows of the part "check", the n + 1 others: at zero, then after one step of each joint."""
        return check[CHECKED:]
