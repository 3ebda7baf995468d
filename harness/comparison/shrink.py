"""Makes the worst configuration smaller while it still shows the disagreement, as property-based testers do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from harness.se3 import Array


def shrink(q: Array, disagrees: Callable[[Array], bool]) -> Array:
    """Set joints to zero one by one, then round those left, as long as `disagrees(q)` stays true.

    q: (n,) [rad or m], for which `disagrees` is true. Returns a q for which it is true, at which no further joint can be
    set to zero alone. At most n (n + 1) + n calls.
    """
    q = np.array(q, dtype=np.float64)
    shrunk = True
    while shrunk:
        shrunk = False
        # From the tip: in most disagreements the joints after the fault do not matter.
        for i in reversed(range(len(q))):
            if q[i] != 0.0 and disagrees(trial := _replaced(q, i, 0.0)):
                q, shrunk = trial, True
    for i in range(len(q)):
        if q[i] != (rounded := round(float(q[i]), 1)) and rounded != 0.0 and disagrees(trial := _replaced(q, i, rounded)):
            q = trial
    return q


def _replaced(q: Array, i: int, value: float) -> Array:
    trial = q.copy()
    trial[i] = value
    return trial
