"""Loads the engines of a run, measures rigid offsets, and binds each engine for good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from harness.description.model import RobotModel
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import adapter_of, description_of, kind_of
from harness.errors import EngineFailed
from harness.run.binding import Bound, bind
from harness.run.naming import wanted_frames
from harness.run.outcome import Outcome
from harness.run.plan import Planned
from harness.run.rigid import Offset, RigidOffsets, transforms
from harness.run.trust import filled_in
from harness.workers import protocol
from harness.workers.pool import Workers


@dataclass(frozen=True)
class Loaded:
    """The engines of a run.

    outcomes: one for each planned source, in order; those that failed to load say why.
    in_house: the in-house FK, bound to the model.
    offsets: the measured offsets of rigid frames, by frame name.
    """

    outcomes: tuple[Outcome, ...]
    in_house: Bound
    offsets: dict[str, Offset]


def load_all(model: RobotModel, planned: Sequence[Planned], workers: Workers) -> Loaded:
    """Load every engine, measure each rigid offset, then bind for good. The first planned source is the reference."""
    outcomes = tuple(Outcome(planned=source) for source in planned)
    rigid = RigidOffsets(model, bind(DHNumpy(model.table), model, {}))
    engines: dict[str, Engine] = {}
    tasks = [(outcome, workers.submit(partial(_load, outcome.planned, model, workers))) for outcome in outcomes]
    for outcome, task in tasks:
        try:
            engine = engines[outcome.name] = task.result()
            outcome.bound = bind(engine, model, {})
            if kind_of(outcome.name) == "urdf":
                tolerance = outcome.planned.tolerance
                rigid.measure(outcome.bound, max(tolerance.position, tolerance.rotation))
        except Exception as error:  # an engine's failure is its result
            outcome.fail(error)
    offsets = transforms(rigid.offsets)
    for outcome in outcomes:
        if outcome.bound is not None:
            outcome.bound = bind(engines[outcome.name], model, offsets)
            _check_frames(outcome, model, outcome is outcomes[0])
    return Loaded(outcomes, bind(DHNumpy(model.table), model, offsets), rigid.offsets)


def _load(planned: Planned, model: RobotModel, workers: Workers) -> Engine:
    frames = wanted_frames(planned.name, model)
    if not planned.command:
        adapter = adapter_of(planned.name)
        return workers.load(adapter, description_of(planned.name, model, adapter.takes), frames)
    greeting = protocol.greeting(description_of(planned.name, model), frames)
    return workers.start(planned.name, filled_in(planned.command, model.folder), greeting, planned.folder)


def _check_frames(outcome: Outcome, model: RobotModel, is_reference: bool) -> None:
    """Take out a source that leaves unchecked what it should show: a reference without a frame, a program that lost one.

    A program of model.toml must have every mapped frame, or frames.toml must say which it lacks; one given with --worker may
    have those it likes, and the verdict names the others.
    """
    bound = outcome.running()
    if is_reference and (lost := [*bound.absent, *(model.frames.frames[i].name for i in bound.missing)]):
        outcome.fail(EngineFailed(outcome.name, f"cannot be the reference: it does not have {', '.join(lost)}"))
    elif outcome.planned.folder is not None and outcome.planned.command and bound.undeclared:
        key = f'frames.toml, [engine."{outcome.name}"] without = {list(bound.undeclared)}'
        text = f"does not have {', '.join(bound.undeclared)}, among {', '.join(bound.engine.frames)}; if that is meant: {key}"
        outcome.fail(EngineFailed(outcome.name, text))
