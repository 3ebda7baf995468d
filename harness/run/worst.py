"""Where each source is furthest from the reference, and how both sides stand there: what a report draws."""

from __future__ import annotations

import numpy as np

from harness.comparison.compare import Comparison
from harness.run.plan import Participant, pair_tolerance
from harness.run.results import Posed, Results


def pose_all(results: Results) -> dict[str, Posed]:
    """Both sides at the worst configuration, for each source that was compared; one that fails when asked again has none."""
    reference, comparison = results.participants[0], results.comparison
    if reference.bound is None or comparison is None:
        return {}
    found = {}
    for participant in results.participants[1:]:
        if participant.bound is None or participant.name not in comparison.position:
            continue
        try:
            found[participant.name] = _posed(results, comparison, participant)
        except Exception as error:  # the comparison stands without its picture; say why it has none
            participant.reason = participant.reason or f"no picture: {type(error).__name__}: {error}"
    return {name: posed for name, posed in found.items() if posed is not None}


def _posed(results: Results, comparison: Comparison, participant: Participant) -> Posed | None:
    reference = results.participants[0]
    tolerance = pair_tolerance(participant.planned, reference.planned)
    where = comparison.furthest(participant.name, tolerance, range(len(results.model.frames.frames)))
    if where is None:
        return None
    frame, index = where
    q = results.model.configurations.one(results.options.seed, index)[None, :]
    a, b = reference.running().mapped(q), participant.running().mapped(q)
    placements = {i: (a[i][0], b[i][0]) for i in a if i in b}
    if not all(np.isfinite(T).all() for pair in placements.values() for T in pair):
        return None
    return Posed(index, frame, placements)
