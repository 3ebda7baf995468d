"""Strings description, engines, analysis and report together: one robot model in, one report document out."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from functools import partial

import numpy as np

from harness.comparison.compare import Comparison
from harness.comparison.shrink import shrink
from harness.description.model import RobotModel
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import adapter_of, description_of, kind_of
from harness.errors import EngineFailed
from harness.report.document import Report
from harness.run.binding import Bound, bind, measure_rigid, wanted_frames
from harness.run.certifying import certify_all
from harness.run.explaining import explain_all
from harness.run.options import Options
from harness.run.plan import Participant, Planned, pair_tolerance, plan
from harness.run.results import Reproduced, Results
from harness.run.streaming import Progress, compare
from harness.run.worst import pose_all
from harness.se3 import Array, position_error, rotation_error
from harness.verdict.assemble import assemble
from harness.workers import protocol
from harness.workers.pool import Workers
from harness.workers.process import ProcessEngine


def crosscheck(model: RobotModel, options: Options, progress: Progress | None = None, workers: Workers | None = None) -> Report:
    """Cross-check one robot model: every planned source against the reference at every mapped frame.

    `progress(done, total)` is called after each block of configurations. `workers`, if given, are used and left open, so that
    the next robot need not start them again. Raises InputError for wrong options; a missing
    or failing engine is part of the report.
    """
    started = time.perf_counter()
    participants = [Participant(planned=planned) for planned in plan(model, options)]
    results = Results(model=model, options=options, participants=participants)
    with contextlib.ExitStack() as stack:
        workers = workers or stack.enter_context(options.workshop())
        bind_all(results, workers)
        results.loaded_in = time.perf_counter() - started
        results.comparison = compare(results, workers, progress)
        if results.comparison is not None:
            results.reproduced = _reproduce(results, results.comparison)
            results.posed = pose_all(results)
            if options.explain:
                results.explained = explain_all(results)
            if options.certify:
                results.certified = certify_all(results, workers)
        _died(results)
        workers.settle(p.bound.engine for p in participants if p.bound is not None)
    results.seconds = time.perf_counter() - started
    return assemble(results)


def _load(planned: Planned, model: RobotModel, workers: Workers) -> Engine:
    frames = wanted_frames(planned.name, model)
    if not planned.command:
        adapter = adapter_of(planned.name)
        return workers.load(adapter, description_of(planned.name, model, adapter.takes), frames)
    command = [word.replace("{model}", str(model.folder.resolve())) for word in planned.command]
    greeting = protocol.greeting(description_of(planned.name, model), frames)
    return workers.start(planned.name, command, greeting, planned.folder)


def bind_all(results: Results, workers: Workers) -> None:
    """Load every engine, measure each rigid offset, then bind for good.

    With the first URDF source that has the frame, or a later one in which the offset is nearer to constant, if it is not.
    """
    model = results.model
    q = model.configurations.lattice()
    in_house = bind(DHNumpy(model.table), model, {})
    rigid = {frame.name for frame in model.frames.frames if frame.relation == "rigid"}
    engines: dict[str, Engine] = {}
    spreads: dict[str, float] = {}
    tasks = [(p, workers.submit(partial(_load, p.planned, model, workers))) for p in results.participants]
    for participant, task in tasks:
        try:
            engine = engines[participant.name] = task.result()
            participant.bound = bind(engine, model, {})
            if kind_of(participant.name) == "urdf" and (loose := _loose(rigid, spreads, participant)):
                for name, measured in measure_rigid(model, in_house, participant.bound, q).items():
                    if name in loose and measured.spread < spreads.get(name, np.inf):
                        results.offsets[name], spreads[name] = measured
                        results.measured_from[name] = participant.name
        except Exception as error:  # an engine's failure is its result
            participant.fail(error)
    for participant in results.participants:
        if participant.bound is not None:
            participant.bound = bind(engines[participant.name], model, results.offsets)
            _check_frames(participant, model, participant is results.participants[0])
    results.in_house = bind(DHNumpy(model.table), model, results.offsets)


def _loose(rigid: set[str], spreads: Mapping[str, float], participant: Participant) -> set[str]:
    """Rigid frames without an offset yet, or with one that moves by more than the tolerance: no rigid one, as it was measured."""
    limit = max(participant.planned.tolerance.position, participant.planned.tolerance.rotation)
    return {name for name in rigid if spreads.get(name, np.inf) > limit}


def _check_frames(participant: Participant, model: RobotModel, is_reference: bool) -> None:
    """Take out a source that leaves unchecked what it should show: a reference without a frame, a program that lost one.

    A program of model.toml must have every mapped frame, or frames.toml must say which it lacks; one given with --worker may
    have those it likes, and the verdict names the others.
    """
    bound = participant.running()
    if is_reference and (lost := [*bound.absent, *(model.frames.frames[i].name for i in bound.missing)]):
        participant.fail(EngineFailed(participant.name, f"cannot be the reference: it does not have {', '.join(lost)}"))
    elif participant.planned.folder is not None and participant.planned.command and bound.undeclared:
        key = f'frames.toml, [engine."{participant.name}"] without = {list(bound.undeclared)}'
        text = f"does not have {', '.join(bound.undeclared)}, among {', '.join(bound.engine.frames)}; if that is meant: {key}"
        participant.fail(EngineFailed(participant.name, text))


def _died(results: Results) -> None:
    """A worker that crashed or hung after the comparison, while being certified, has failed like any other."""
    for participant in results.participants:
        engine = participant.bound.engine if participant.bound else None
        if isinstance(engine, ProcessEngine) and engine.died:
            participant.fail(EngineFailed(participant.name, engine.died))
            if participant is results.participants[0]:
                results.comparison = None
            elif results.comparison is not None:
                results.comparison.drop(participant.name)
            results.certified.pop(participant.name, None)
            results.reproduced.pop(participant.name, None)
            results.posed.pop(participant.name, None)
            results.explained.pop(participant.name, None)


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
            found[participant.name] = _shrunk(reference.running(), participant.bound, frame, q, tolerance)
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
    T_reference, T_source = placements(q)
    return Reproduced(frame=frame, q=q, position=position, rotation=rotation, T_reference=T_reference, T_source=T_source)
