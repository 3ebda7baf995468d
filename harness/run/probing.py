"""Tests every source of a run against its own description: asked in a full block, alone, in small steps, again, far away."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from functools import partial

import numpy as np

from harness.comparison.compare import HUGE
from harness.comparison.components import components, discrepancies, mapped
from harness.engines.registry import adapter_of, kind_of
from harness.run.binding import Bound
from harness.run.described import Described, described
from harness.run.outcome import Certified, Outcome, Run
from harness.run.probes import AGAIN, SLOW_BLOCK, SUBSET, Block, Box, Mask, Probes, draw
from harness.run.seen import Answers, Seen
from harness.run.streaming import total_of
from harness.run.tested import Tested
from harness.se3 import Array
from harness.workers.pool import Workers
from harness.workers.process import ProcessEngine
from harness.workers.protocol import MAX_BLOCK

CELLS = 20_000  # placements compared at a time
ALONE, LATER = "alone", "looked at later, after others were asked for"
PACKAGED = "it computes from a robot that its library ships, which no file of this model describes"


class ProbeError(Exception):
    """What an engine raised while it was asked probes of a kind."""

    def __init__(self, kind: str, error: Exception) -> None:
        super().__init__(str(error))
        self.kind, self.error = kind, error


def probe_all(run: Run, workers: Workers) -> None:
    """Test every source that runs. One that raises where it must answer is taken out, as in the comparison."""
    configurations = run.model.configurations
    compared = configurations.block(run.options.seed, 0, min(SUBSET, total_of(run)))
    descriptions = {kind: described(run.model, kind, run.rigid_transforms) for kind in ("dh", "urdf")}
    names = [frame.name for frame in run.model.frames.frames]
    running = [o for o in run.outcomes if o.bound is not None and o.bound.view.available and not _died(o.bound)]
    sizes = {o.name: SLOW_BLOCK if _is_slow(o) else MAX_BLOCK for o in running}
    probes = {rows: draw(run.model, compared, run.options.probe_seed, rows) for rows in {*sizes.values()}}
    tasks: list[tuple[Outcome, Future[Tested]]] = []
    for outcome in sorted(running, key=lambda o: -o.running().seconds):  # what begins last decides when all are done
        trial = _Trial(outcome, descriptions[kind_of(outcome.name)], names, probes[sizes[outcome.name]])
        tasks.append((outcome, workers.submit(trial.tested)))
    for outcome, task in tasks:
        try:
            outcome.tested = task.result()
        except ProbeError as failure:
            run.take_out(outcome, failure.error, f"(tested against its own description: {failure.kind})")
    for outcome in run.compared:
        _withdraw(run, outcome)


def _died(bound: Bound) -> bool:
    """Whether the process of an engine has come to an end."""
    return isinstance(bound.engine, ProcessEngine) and bool(bound.engine.died)


def _is_slow(outcome: Outcome) -> bool:
    """Whether its adapter says so; a program of the user's has none."""
    return not outcome.planned.command and adapter_of(outcome.name).slow


def _withdraw(run: Run, outcome: Outcome) -> None:
    """No bound stands for a source if it, or the reference, was seen not to be what the bound takes it for."""
    if outcome.certified is None or outcome.certified.bounds is None:
        return
    for one in (outcome, run.reference):
        tolerance, tested = one.planned.tolerance, one.tested
        validity = run.discrepancies().validity[one.name]
        reason = ""
        if validity.stateful or (tested is not None and tested.keeps_state):
            reason = f"{one.name} keeps state: its answers depend on what is asked before or beside them"
        elif tested is not None and tested.invalid:
            reason = f"{one.name} gives placements that are not finite"
        elif tested is not None and any(
            f.position > tolerance.position or f.rotation > tolerance.rotation for f in tested.frames
        ):
            reason = f"{one.name} does not compute what its description says, as its test has shown"
        if reason:
            outcome.certified = Certified(reason=reason)


class _Asker:
    """Asks an engine as a run does. What it refuses beyond the limits comes back as NaN, and is not asked again.

    refused: why it has refused; empty as long as it has not.
    """

    def __init__(self, bound: Bound, box: Box) -> None:
        self._bound, self._box = bound, box
        self.refused = ""

    def ask(self, q: Array) -> tuple[Array, Mask]:
        """Raw placements at q (N, n), and which of them were asked for, (N,). Raises what the engine raises within limits."""
        inside = self._box.inside(q)
        if inside.all() or not self.refused:
            try:
                return self._bound.raw(q), np.ones(len(q), dtype=bool)
            except Exception as error:  # an engine may refuse what is beyond its limits
                if inside.all() or _died(self._bound):
                    raise
                self.refused = str(getattr(error, "reason", "") or f"{type(error).__name__}: {error}")
        T = np.full((len(q), len(self._bound.frames), 4, 4), np.nan)
        if inside.any():  # a block of the same size, others in place of those that are not asked
            rows = np.where(inside, np.arange(len(q)), np.resize(np.flatnonzero(inside), len(q)))
            T[inside] = self._bound.raw(q[rows])[inside]
        return T, inside


class _Trial:
    """One source under test."""

    def __init__(self, outcome: Outcome, own: Described, names: list[str], probes: Probes) -> None:
        bound, tolerance = outcome.running(), outcome.planned.tolerance
        self._bound, self._probes = bound, probes
        adapter = None if outcome.planned.command else adapter_of(outcome.name)
        self._packaged = adapter is not None and adapter.takes == "packaged"
        self._ignored = adapter.ignored_step if adapter else 0.0
        self._own, self._names = own, [names[i] for i in bound.view.available]
        self._asker = _Asker(bound, probes.box)
        self._seen = Seen(bound.view.available, probes.box, (tolerance.position, tolerance.rotation))
        self._held: list[tuple[Block, Callable[[], Array]]] = []

    def tested(self) -> Tested:
        """Ask everything. Raises ProbeError."""
        singles = self._probes.singles
        repeated = {q.tobytes() for q in singles.q}
        for block in self._probes.blocks:
            T, asked = self._ask(block.kinds[-1], block.q)
            self._take(block, T, asked, f"in a block of {len(block.q)}", repeated)
            rows = [i for i, q in enumerate(block.q) if q.tobytes() in repeated]
            self._hold(_rows(block, rows), partial(T.__getitem__, rows))
        self._ask_alone(singles)
        # What was off in a block is asked alone: is it the configuration, or how it is asked?
        if doubtful := [q for q in self._seen.doubtful() if q.tobytes() not in repeated]:
            self._ask_alone(Block(np.array(doubtful), (AGAIN,) * len(doubtful)))
        for block, answers in self._held:
            for part in _parts(block, self._names):
                self._seen.look_again(self._answers(_rows(block, part), answers()[part], None, LATER))
        reason = PACKAGED if self._packaged else ""
        return self._seen.tested("" if self._packaged else self._own.kind, reason, self._asker.refused, self._ignored)

    def _hold(self, block: Block, answers: Callable[[], Array]) -> None:
        """Keep what an engine gave, to look at it once more. An engine in a process of its own cannot reach it."""
        if not isinstance(self._bound.engine, ProcessEngine):
            self._held.append((block, answers))

    def _ask(self, kind: str, q: Array) -> tuple[Array, Mask]:
        self._seen.call(kind)
        try:
            return self._asker.ask(q)
        except Exception as error:  # an engine's failure is its result
            raise ProbeError(kind, error) from error

    def _ask_alone(self, block: Block) -> None:
        """Ask one configuration after the other, and compare when all are there."""
        given, copies, asked = [], [], np.zeros(len(block.q), dtype=bool)
        for i, kind in enumerate(block.kinds):
            T, is_asked = self._ask(kind, block.q[i : i + 1])
            given.append(T)
            copies.append(T.copy())
            asked[i] = is_asked[0]
        self._take(block, np.concatenate(copies), asked, ALONE, {q.tobytes() for q in block.q})
        self._hold(block, partial(np.concatenate, given))

    def _take(self, block: Block, T: Array, asked: Mask, way: str, repeated: set[bytes]) -> None:
        """Compare answers T (N, F, 4, 4) with the description, part by part, and take note of them."""
        for part in _parts(block, self._names):
            self._seen.take(self._answers(_rows(block, part), T[part], asked[part], way), repeated)

    def _answers(self, block: Block, T: Array, asked: Mask | None, way: str) -> Answers:
        with np.errstate(invalid="ignore", over="ignore"):
            placed = mapped(components(T), self._bound.view)
            placed = np.where(np.abs(placed) < HUGE, placed, np.nan)
            off = None if self._packaged else np.stack(discrepancies(self._own.placements(block.q, self._names), placed))
        limit = self._own.allowance(block.q)
        return Answers(
            q=block.q,
            kinds=np.array(block.kinds),
            way=way,
            placed=placed,
            off=off,
            limit=limit,
            allowed=limit + self._ignored * self._own.gain,
            asked=np.ones(len(block.q), dtype=bool) if asked is None else asked,
        )


def _rows(block: Block, rows: Sequence[int]) -> Block:
    return Block(block.q[rows], tuple(block.kinds[i] for i in rows))


def _parts(block: Block, names: Sequence[str]) -> Iterator[list[int]]:
    """The rows of a block, in parts of so many placements."""
    size = max(1, CELLS // max(1, len(names)))
    for start in range(0, len(block.q), size):
        yield list(range(start, min(start + size, len(block.q))))
