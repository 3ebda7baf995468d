"""Strings description, engines, analysis and report together: one robot model in, one report document out."""

from __future__ import annotations

import time
from collections.abc import Callable

from harness.analysis.compare import Comparison
from harness.analysis.shrink import shrink
from harness.assemble import assemble
from harness.certificates import certify_all
from harness.description.model import RobotModel
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import load_engine
from harness.report.document import Report
from harness.results import Options, Reproduced, Results
from harness.se3 import Array, position_error, rotation_error
from harness.sources import Bound, Participant, bind, measure_rigid, pair_tolerance, plan

BLOCK = 4096
SUBSET = 256

Progress = Callable[[int, int], None]


def crosscheck(model: RobotModel, options: Options, progress: Progress | None = None) -> Report:
    """Cross-check one robot model: every planned source against the reference at every mapped frame.

    `progress(done, total)` is called after each block of configurations. Raises InputError for wrong options; a missing
    or failing engine is part of the report.
    """
    started = time.perf_counter()
    participants = [Participant(planned) for planned in plan(model, options.sources, options.reference)]
    results = Results(model, options, participants)
    _bind_all(results)
    results.comparison = _compare(results, progress)
    if results.comparison is not None:
        results.reproduced = _reproduce(results, results.comparison)
        if options.certify:
            results.certified = certify_all(results)
    results.seconds = time.perf_counter() - started
    return assemble(results)


def _bind_all(results: Results) -> None:
    """Load every engine, measure the rigid offsets with the first URDF source that answers, then bind for good."""
    model = results.model
    q = model.configurations.lattice()
    in_house = bind(DHNumpy(model.table), model, {})
    needs_measuring = any(frame.relation == "rigid" for frame in model.frames.frames)
    engines = {}
    for participant in results.participants:
        try:
            engine = engines[participant.name] = load_engine(participant.name, model)
            participant.bound = bind(engine, model, {})
            if needs_measuring and not results.offsets and participant.name.startswith("urdf:"):
                results.offsets = measure_rigid(model, in_house, participant.bound, q)
                results.measured_from = participant.name
        except Exception as error:  # an engine's failure is its result
            participant.fail(error)
    for participant in results.participants:
        if participant.bound is not None:
            participant.bound = bind(engines[participant.name], model, results.offsets)
    results.in_house = bind(DHNumpy(model.table), model, results.offsets)


def _compare(results: Results, progress: Progress | None) -> Comparison | None:
    """Stream all configurations through all sources. None if the reference is out."""
    configurations, options = results.model.configurations, results.options
    fixed = len(configurations.fixed)
    total = fixed + options.samples
    reference = results.participants[0]
    live = {p.name: p for p in results.participants if p.bound is not None}
    comparison = Comparison(
        {name: p.bound.view for name, p in live.items() if p.bound is not None},
        reference.name,
        len(results.model.frames.frames),
        fixed + min(SUBSET, options.samples),
    )
    for start in range(0, total, BLOCK):
        stop = min(start + BLOCK, total)
        q = configurations.block(options.seed, start, stop)
        raw: dict[str, Array] = {}
        for name, participant in list(live.items()):
            try:
                raw[name] = _bound(participant).raw(q)
            except Exception as error:  # an engine's failure is its result
                participant.fail(error)
                participant.reason += f" (configurations {start} to {stop - 1})"
                comparison.drop(name)
                del live[name]
        if reference.name not in live:
            return None
        comparison.update(start, raw)
        if progress:
            progress(stop, total)
    return comparison


def _bound(participant: Participant) -> Bound:
    if participant.bound is None:
        raise RuntimeError(f"{participant.name} is not bound")
    return participant.bound


def _reproduce(results: Results, comparison: Comparison) -> dict[str, Reproduced]:
    """For each source outside tolerance its worst configuration, shrunk; at a frame of declared offset if one disagrees."""
    reference, frames = results.participants[0], results.model.frames.frames
    # A rigid frame shows a change of its offset, at any q; one at a declared offset shows the discrepancy itself.
    declared = [i for i, frame in enumerate(frames) if frame.relation != "rigid"]
    found: dict[str, Reproduced] = {}
    for participant in results.participants[1:]:
        if participant.bound is None:
            continue
        tolerance = pair_tolerance(participant.planned, reference.planned)
        worst = comparison.worst(participant.name, tolerance, declared) or comparison.worst(
            participant.name, tolerance, range(len(frames))
        )
        if worst is None:
            continue
        frame, index = worst
        q = results.model.configurations.one(results.options.seed, index)
        try:
            found[participant.name] = _shrunk(_bound(reference), participant.bound, frame, q, tolerance)
        except Exception as error:  # the comparison stands without its reproducer; say why it has none
            participant.reason = f"no reproducer: {type(error).__name__}: {error}"
    return found


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
    return Reproduced(frame, q, position, rotation, *placements(q))
