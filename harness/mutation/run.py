"""Runs the mutants of all robots over the cores: each process makes its own, by number."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from harness.description.model import RobotModel, load_model
from harness.engines.registry import adapter_of
from harness.errors import EngineFailed, EngineUnavailable
from harness.mutation.controller import FaultyWorkers
from harness.mutation.mutant import Mutant
from harness.mutation.score import MutationScore, Trial, score
from harness.mutation.trial import SAMPLES, mutants_of, try_out
from harness.report.explanation import Change
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck
from harness.workers.environments import THREAD_VARIABLES, where

SOURCES = ("urdf:pinocchio", "urdf:pytorch-kinematics")
CHUNK = 12

Progress = Callable[[int, int], None]


@lru_cache(maxsize=1)
def _prepared(folder: Path) -> tuple[RobotModel, list[Mutant]]:
    model = load_model(folder)
    return model, list(mutants_of(model))


@lru_cache(maxsize=1)
def _workers() -> FaultyWorkers:
    return FaultyWorkers()


@lru_cache(maxsize=1)
def _known(folder: Path, source: str) -> list[Change]:
    """The changes that explain the accepted deviations of the original."""
    model = _prepared(folder)[0]
    if not model.file.accepted:
        return []
    report = crosscheck(
        model, Options(samples=SAMPLES, seed=0, sources=(source,), certify=False, in_process=True), None, _workers()
    )
    explanation = report.sources[-1].explanation
    return explanation.changes if explanation else []


def _chunk(folder: Path, indices: Sequence[int], sources: Sequence[str]) -> list[Trial]:
    """Some mutants of one robot."""
    model, mutants = _prepared(folder)
    known = _known(folder, sources[0]) if sources else []
    return [trial for i in indices for trial in try_out(mutants[i], model, sources, _workers(), known)]


def present(sources: Sequence[str]) -> tuple[list[str], list[str]]:
    """Which of the sources can run here, in this environment; and why not the others."""
    here, absent = [], []
    for source in sources:
        adapter = adapter_of(source)
        try:
            where(adapter)
            here.append(source)
        except EngineUnavailable as error:
            absent.append(str(error))
    return here, absent


def run_mutants(
    folders: Sequence[Path], sources: Sequence[str], every: int, jobs: int, progress: Progress | None
) -> MutationScore:
    """Every `every`-th mutant of each robot, in `jobs` processes (0: one a core)."""
    started = time.perf_counter()
    here, absent = present(sources)
    tasks = []
    for folder in folders:
        count = len(_prepared(folder)[1])
        chosen = range(0, count, every)
        tasks += [(folder, list(chosen[k : k + CHUNK]), here) for k in range(0, len(chosen), CHUNK)]
    done = _over_the_cores(tasks, jobs or os.cpu_count() or 1, progress)
    return score([trial for trials in done for trial in trials], every, round(time.perf_counter() - started, 1), absent)


Task: TypeAlias = "tuple[Path, list[int], list[str]]"


def _over_the_cores(tasks: Sequence[Task], jobs: int, progress: Progress | None) -> list[list[Trial]]:
    """The trials of each task. Whatever ends it early, an interrupt say, ends its processes too."""
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    # Interrupted twice, nothing is tidied up: that Python then frees what is left over is nothing to be warned of.
    os.environ.setdefault("PYTHONWARNINGS", "ignore::UserWarning:multiprocessing.resource_tracker")
    done: dict[int, list[Trial]] = {}
    total, finished = sum(len(task[1]) for task in tasks), 0
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _end_with_parent)
    try:
        with _without_interrupts():
            futures = {pool.submit(_chunk, *task): k for k, task in enumerate(tasks)}
        for future in as_completed(futures):
            done[futures[future]] = future.result()
            finished += len(tasks[futures[future]][1])
            if progress:
                progress(finished, total)
    except BrokenProcessPool:
        raise EngineFailed("mutants", "a process that tried them was killed, or crashed in a library") from None
    finally:
        if finished < total:
            for process in multiprocessing.active_children():
                process.kill()
        pool.shutdown(cancel_futures=True)
    return [done[k] for k in sorted(done)]


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Processes started in it never see a Ctrl-C: the one that started them ends them. Its own comes afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """Watch the process that started this one. When it is gone, killed say, nobody wants the result."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
