"""Begins a run where an interrupted one has ended, if its checkpoint fits and every engine still answers as it did."""

from __future__ import annotations

from harness.comparison.state import restore
from harness.run.checkpoint import Checkpoint, State, digest_of, reinstate
from harness.run.outcome import Run
from harness.run.streaming import BLOCK, Answers, Begun, hand_out, new_comparison, total_of
from harness.workers.pool import Workers


class AnswersChangedError(Exception):
    """An engine answers otherwise than before the interruption. The engines have been asked, and must be started anew."""


def resume(run: Run, workers: Workers, checkpoint: Checkpoint) -> Begun | None:
    """Where to go on; None if the run begins from the start.

    run: every engine is loaded, and nothing was compared. Sources that had failed before the interruption are taken out again.
    workers: those of the engines.
    checkpoint: the run's own.

    Raises AnswersChangedError.
    """
    state = checkpoint.read()
    if state is None:
        return None
    comparison, total = new_comparison(run), total_of(run)
    for name in state.failures:
        comparison.drop(name)
    try:
        if not 0 < state.next <= total or (state.next % BLOCK and state.next != total):
            raise ValueError(f"its end at configuration {state.next} cannot be")
        if {*state.answers} != {*comparison.views} or run.reference.name not in comparison.views:
            raise ValueError("its sources cannot be")
        restore(comparison, state.comparison, state.next)
    except ValueError as why:
        checkpoint.drop(str(why))
        return None
    last = _last_answers(run, workers, checkpoint, state)
    for outcome in run.outcomes:
        if outcome.name in state.failures:
            reinstate(outcome, state.failures[outcome.name])
    checkpoint.continued(state.next, total)
    return Begun(comparison=comparison, next=state.next, last=last)


def _last_answers(run: Run, workers: Workers, checkpoint: Checkpoint, state: State) -> Answers:
    """Ask for the last block again: by source, its last answer. Raises AnswersChangedError if not all answers are the same."""
    start = (state.next - 1) // BLOCK * BLOCK
    asked = {o.name: o for o in run.outcomes if o.name in state.answers}
    tasks = hand_out(run, workers, asked, start, state.next)
    last, changed = {}, []
    for name, task in tasks.items():  # all of them: none may be at work when the engines are started anew
        try:
            T = task.result()
            last[name] = T[-1].copy()
            same = digest_of(T) == state.answers[name]
        except Exception:  # an engine that fails now had not failed then
            same = False
        changed += [] if same else [name]
    if changed:
        checkpoint.drop(f"{', '.join(changed)} answers otherwise than before")
        raise AnswersChangedError
    return last
