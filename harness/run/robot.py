"""One robot model cross-checked: plan, load, compare, then what is known of each disagreement."""

from __future__ import annotations

import contextlib
import time

from harness.description.model import RobotModel
from harness.errors import EngineFailed
from harness.run.checkpoint import Checkpoints
from harness.run.explaining import explain_all
from harness.run.loading import load_all
from harness.run.options import Options
from harness.run.outcome import Run
from harness.run.plan import plan
from harness.run.probing import probe_all
from harness.run.proving import prove_all
from harness.run.resuming import AnswersChangedError, resume
from harness.run.streaming import Progress, compare
from harness.run.worst import find_worst, reproduce
from harness.workers.pool import Workers
from harness.workers.process import ProcessEngine


def load(model: RobotModel, options: Options, workers: Workers) -> Run:
    """The run with every engine loaded and bound, nothing compared yet. Raises InputError for wrong options."""
    started = time.perf_counter()
    loaded = load_all(model, plan(model, options), workers)
    return Run(
        model=model,
        options=options,
        reference=loaded.outcomes[0],
        others=loaded.outcomes[1:],
        in_house=loaded.in_house,
        offsets=loaded.offsets,
        loaded_in=time.perf_counter() - started,
    )


def run_robot(
    model: RobotModel,
    options: Options,
    progress: Progress | None = None,
    workers: Workers | None = None,
    checkpoints: Checkpoints | None = None,
) -> Run:
    """Cross-check one robot model: every planned source against the reference at every mapped frame.

    model: the robot model.
    options: what is asked.
    progress: called as `progress(done, total)` after each block of configurations.
    workers: used and left open, so that the next robot need not start them again; None: workers of its own.
    checkpoints: where a long run keeps how far it has come, and finds it again if it was interrupted; None: nowhere.

    Raises InputError for wrong options. A missing or failing engine is part of the result.
    """
    started = time.perf_counter()
    with contextlib.ExitStack() as stack:
        workers = workers or stack.enter_context(options.worker_pool())
        run = load(model, options, workers)
        checkpoint = checkpoints.of(run) if checkpoints and options.resume else None
        begun = None
        try:
            begun = resume(run, workers, checkpoint) if checkpoint else None
        except AnswersChangedError:
            # What the engines were asked just now may have changed their state: new ones, as if this had not been.
            workers.settle(())
            run = load(model, options, workers)
            checkpoint = checkpoints.of(run) if checkpoints else None
        run.comparison = compare(run, workers, progress, checkpoint, begun)
        if run.comparison is not None:
            reproduce(run)
            find_worst(run)
            if options.explain:
                explain_all(run)
            if options.certify:
                prove_all(run)
            if options.certify and options.probe:
                probe_all(run, workers)
        _drop_dead(run)
        workers.settle(o.bound.engine for o in run.outcomes if o.bound is not None)
    run.seconds = time.perf_counter() - started
    return run


def _drop_dead(run: Run) -> None:
    """A worker that crashed or hung after the comparison, while it was tested, has failed like any other."""
    for outcome in run.outcomes:
        engine = outcome.bound.engine if outcome.bound else None
        if isinstance(engine, ProcessEngine) and engine.died:
            run.take_out(outcome, EngineFailed(outcome.name, engine.died))
