"""One mutant put through the gate: what it should have done, what it did, and whether the cause was named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from harness.description.model import RobotModel
from harness.errors import CrosscheckError
from harness.mutation.controller import NAMES, FaultyWorkers
from harness.mutation.effect import Effect, effect_of
from harness.mutation.equivalent import equivalents, with_follower
from harness.mutation.faults import of_controllers, of_joints, of_tool, of_whole
from harness.mutation.mutant import Mutant
from harness.mutation.numbers import of_table, of_urdf
from harness.mutation.score import Trial
from harness.mutation.structure import of_axes, of_frames
from harness.report import document as doc
from harness.report import explanation as reasons
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck
from harness.verdict.deviations import deviation_on_file

SAMPLES = 200
NOTHING = 1e-13  # an effect below is none: rounding of the models


def mutants_of(model: RobotModel) -> Iterator[Mutant]:
    """All mutants of a robot model, in a fixed order."""
    for make in (of_table, of_urdf, of_joints, of_axes, of_whole, of_frames, of_tool, of_controllers, with_follower, equivalents):
        yield from make(model)


def try_out(
    mutant: Mutant, original: RobotModel, sources: Sequence[str], workers: FaultyWorkers, known: Sequence[reasons.Change]
) -> list[Trial]:
    """Cross-check one mutant.

    Args:
        mutant: the mutant; a controller with a fault is run alone, without the other sources.
        original: the model it was made from.
        sources: names of the sources that are asked.
        workers: start the controller that has the mutant's fault.
        known: the changes that explain the original's own accepted deviations.

    Returns:
        One trial for each source.
    """
    named = (NAMES[mutant.fault],) if mutant.fault else (*sources, *(s for s in mutant.extra if s not in sources))
    workers.model = mutant.model
    commands = ((named[0], (str(mutant.fault),)),) if mutant.fault else ()
    options = Options(
        samples=SAMPLES,
        seed=0,
        sources=named,
        workers=commands,
        certify=bool(original.file.accepted),
        probe=False,  # the engines are those of every other trial
        in_process=True,
    )
    try:
        report = crosscheck(mutant.model, options, None, workers)
    except CrosscheckError as error:
        return [Trial.of(mutant, source, "refused", note=str(error)) for source in named]
    by_name = {s.name: s for s in report.sources}
    return [_judged(mutant, original, by_name[source], effect_of(mutant, original, source), known) for source in named]


def _judged(mutant: Mutant, original: RobotModel, source: doc.Source, effect: Effect, known: Sequence[reasons.Change]) -> Trial:
    """The trial of a mutant at one source: whether it was flagged, and whether it should have been."""
    largest = float(max(effect.position_change.max(initial=0.0), effect.rotation_change.max(initial=0.0)))
    trial = partial(Trial.of, mutant, source.name, effect=largest)
    if source.status != "ran":
        return trial("refused", note=source.reason)
    flagged = source.verdict.disagrees
    if mutant.equivalent and largest > NOTHING:
        return trial("missed", note=f"not equivalent after all: {largest:.2g}")
    if mutant.equivalent or largest <= NOTHING:
        return trial("false alarm" if flagged else "left alone")
    if not flagged:
        floor = _floor(effect, original, source)
        return trial("missed" if floor is None else "below the floor", note=floor or "")
    text, named = _cause(mutant, source, known)
    return trial("caught", cause_named=named, told=text)


def _floor(effect: Effect, original: RobotModel, source: doc.Source) -> str | None:
    """Why the gate cannot see it: below the tolerance of the source, or within the margin of accepted deviations."""
    limits, hidden = source.tolerance, False
    for i, frame in enumerate(effect.frames):
        on_file = deviation_on_file(original, source.name, "dh:numpy", frame)
        margins = (
            (0.0, 0.0) if on_file is None else (on_file[0].within * on_file[0].position, on_file[0].within * on_file[0].rotation)
        )
        if on_file is None and (effect.position[i] > limits.position or effect.rotation[i] > limits.rotation):
            return None
        if effect.position_change[i] > limits.position + margins[0] or effect.rotation_change[i] > limits.rotation + margins[1]:
            return None
        hidden |= on_file is not None and effect.position_change[i] > limits.position
    floor = f"tolerance {limits.position:g} m, {limits.rotation:g} rad"
    return f"within the margin of an accepted deviation, and {floor}" if hidden else floor


def _cause(mutant: Mutant, source: doc.Source, known: Sequence[reasons.Change]) -> tuple[str, bool]:
    """The explanation as text, and whether it names the cause.

    It names the cause if one of its changes is the mutant's, with joint and size, and if it has at most one change more than
    the original's own.
    """
    explanation = source.explanation
    if explanation is None or not explanation.changes:
        return (explanation.unexplained if explanation else "nothing"), False
    # A number that was off before is off by both.
    known_sizes = {(one.subject, one.parameter): one.size for change in known for one in (change, *change.equivalents)}
    causes = [
        cause if cause.size is None else replace(cause, size=cause.size + known_sizes.get((cause.subject, cause.parameter), 0.0))
        for cause in mutant.causes
    ]
    named = any(
        cause.named_by(one) for cause in causes for change in explanation.changes for one in (change, *change.equivalents)
    )
    text = " and ".join(change.text for change in explanation.changes)
    return text, named and len(explanation.changes) <= 1 + len(known)
