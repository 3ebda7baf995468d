"""Streams all configurations through all sources, several at a time, and compares them block by block."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

import numpy as np

from harness.comparison.compare import Comparison
from harness.run.checkpoint import Checkpoint
from harness.run.outcome import Outcome, Run
from harness.se3 import Array
from harness.workers.pool import Workers
from harness.workers.protocol import MAX_BLOCK

BLOCK = MAX_BLOCK
SUBSET = 256

Progress = Callable[[int, int], None]
Answers: TypeAlias = "dict[str, Array]"
Tasks: TypeAlias = "dict[str, Future[Array]]"


@dataclass(kw_only=True)
class Begun:
    """A comparison on its way.

    comparison: what was accumulated.
    next: the configuration to go on with.
    last: by source, the answer to the one before that; empty at the beginning.
    """

    comparison: Comparison
    next: int = 0
    last: Answers = field(default_factory=dict)


def total_of(run: Run) -> int:
    """The number of configurations, fixed and random."""
    return len(run.model.configurations.fixed) + run.options.samples


def new_comparison(run: Run) -> Comparison:
    """A comparison of all sources that run, before the first configuration."""
    fixed = len(run.model.configurations.fixed)
    return Comparison(
        {o.name: o.running().view for o in run.outcomes if o.bound is not None},
        run.reference.name,
        len(run.model.frames.frames),
        fixed + min(SUBSET, run.options.samples),
    )


def compare(
    run: Run,
    workers: Workers,
    progress: Progress | None,
    checkpoint: Checkpoint | None = None,
    begun: Begun | None = None,
) -> Comparison | None:
    """Compare all sources at all configurations. None if the reference is out.

    run: every engine is loaded.
    workers: those of the engines.
    progress: called as `progress(done, total)` after each block, and at once if the run continues another.
    checkpoint: where to write how far it has come; None: nowhere.
    begun: where to go on; None: at the beginning.
    """
    total, reference = total_of(run), run.reference.name
    live = {o.name: o for o in run.outcomes if o.bound is not None}
    begun = begun or Begun(comparison=new_comparison(run))
    comparison, last, stop = begun.comparison, begun.last, begun.next
    if progress and stop:
        progress(stop, total)
    tasks = hand_out(run, workers, live, stop, total)
    while tasks:
        start, stop = stop, min(stop + BLOCK, total)
        raw = _collect(tasks, live, comparison, f"(configurations {start} to {stop - 1})")
        if reference not in live:
            return None
        tasks = hand_out(run, workers, live, stop, total)  # before comparing: the engines need not wait for that
        comparison.update(start, raw)
        last = {name: T[-1].copy() for name, T in raw.items()}
        if checkpoint and (checkpoint.due or (stop == total and checkpoint.exists)):
            checkpoint.write(stop, comparison, raw)
        if progress:
            progress(stop, total)
    _ask_again(run, workers, comparison, live, last)
    return comparison if reference in live else None


def hand_out(run: Run, workers: Workers, live: dict[str, Outcome], start: int, total: int) -> Tasks:
    """Give the next block to every source still there, the slowest first: what begins last decides when all are done.

    None is left to give if `start` is `total`.
    """
    if start >= total:
        return {}
    q = run.model.configurations.block(run.options.seed, start, min(start + BLOCK, total))
    order = sorted(live, key=lambda name: -live[name].running().seconds)
    tasks = {name: workers.submit(partial(live[name].running().raw, q)) for name in order}
    return {name: tasks[name] for name in live}


def _collect(tasks: Tasks, live: dict[str, Outcome], comparison: Comparison, where: str) -> Answers:
    """The answers; a source that has none is taken out, with the block it was given."""
    raw: Answers = {}
    for name, task in tasks.items():
        try:
            raw[name] = task.result()
        except Exception as error:  # an engine's failure is its result
            live[name].fail(error)
            live[name].reason += f" {where}"
            comparison.drop(name)
            del live[name]
    return raw


def _ask_again(run: Run, workers: Workers, comparison: Comparison, live: dict[str, Outcome], last: Answers) -> None:
    """Ask for the first and the last configuration again, alone and in the other order: an engine that keeps state differs."""
    if not last:
        return
    configurations, seed = run.model.configurations, run.options.seed
    index = len(configurations.fixed) + run.options.samples - 1
    first, final = (configurations.one(seed, i)[None, :] for i in (0, index))

    def again(outcome: Outcome) -> Array:
        outcome.running().raw(first)
        answer: Array = outcome.running().raw(final)[0]
        return answer

    tasks = {name: workers.submit(partial(again, outcome)) for name, outcome in live.items()}
    for name, T in _collect(tasks, live, comparison, f"(configuration {index}, asked for again)").items():
        with np.errstate(invalid="ignore"):
            difference = np.abs(T - last[name])
        comparison.validity[name].again = float(np.where(np.isfinite(difference), difference, 0.0).max(initial=0.0))
        comparison.validity[name].again_at = index
