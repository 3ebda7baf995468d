"""Where each source is furthest from the reference: the configuration itself, and one with as few joints moved as possible."""

from __future__ import annotations

import numpy as np

from harness.comparison.shrink import shrink
from harness.run.binding import Bound
from harness.run.outcome import Outcome, Reproduced, Run, Worst
from harness.se3 import Array, position_error, rotation_error


def find_worst(run: Run) -> None:
    """For each source that was compared, both sides at its worst configuration. One that fails when asked again has none."""
    for outcome in run.compared:
        try:
            outcome.worst = _worst(run, outcome)
        except Exception as error:  # the comparison stands without its picture; say why it has none
            outcome.reason = outcome.reason or f"no picture: {type(error).__name__}: {error}"


def _worst(run: Run, outcome: Outcome) -> Worst | None:
    every = range(len(run.model.frames.frames))
    where = run.discrepancies().furthest(outcome.name, run.tolerance(outcome), every)
    if where is None:
        return None
    frame, index = where
    q = run.model.configurations.one(run.options.seed, index)[None, :]
    T_a, T_b = run.reference.running().mapped(q), outcome.running().mapped(q)
    placements = {i: (T_a[i][0], T_b[i][0]) for i in T_a if i in T_b}
    if not all(np.isfinite(T).all() for pair in placements.values() for T in pair):
        return None
    return Worst(index, frame, placements)


def reproduce(run: Run) -> None:
    """For each source outside tolerance its worst configuration, shrunk; at a frame of declared offset if one disagrees."""
    frames = run.model.frames.frames
    # A rigid frame shows a change of its offset, at any q; one at a declared offset shows the discrepancy itself.
    declared = [i for i, frame in enumerate(frames) if frame.relation != "rigid"]
    for outcome in run.compared:
        comparison, tolerance = run.discrepancies(), run.tolerance(outcome)
        where = comparison.worst(outcome.name, tolerance, declared) or comparison.worst(
            outcome.name, tolerance, range(len(frames))
        )
        if where is None:
            continue
        frame, index = where
        q = run.model.configurations.one(run.options.seed, index)
        try:
            outcome.reproduced = _shrunk(run.reference.running(), outcome.running(), frame, q, tolerance)
        except Exception as error:  # the comparison stands without its reproducer; say why it has none
            outcome.reason = f"no reproducer: {type(error).__name__}: {error}"


def _shrunk(reference: Bound, source: Bound, frame: int, q: Array, tolerance: tuple[float, float]) -> Reproduced:
    def placements(q: Array) -> tuple[Array, Array]:
        return reference.mapped(q[None, :])[frame][0], source.mapped(q[None, :])[frame][0]

    def errors(q: Array) -> tuple[float, float]:
        T_a, T_b = placements(q)
        return float(position_error(T_a, T_b)), float(rotation_error(T_a, T_b))

    def disagrees(q: Array) -> bool:
        return any(error > limit for error, limit in zip(errors(q), tolerance, strict=True))

    q = shrink(q, disagrees)
    position, rotation = errors(q)
    T_reference, T_source = placements(q)
    return Reproduced(frame=frame, q=q, position=position, rotation=rotation, T_reference=T_reference, T_source=T_source)
