"""One mutant put through the gate: what it should have done, what it did, and whether the cause was named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

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
    """Cross-check the mutant; one trial for each source. known: what explains the original."""
    named = (NAMES[mutant.fault],) if mutant.fault else (*sources, *(s for s in mutant.extra if s not in sources))
    workers.model = mutant.model
    commands = ((named[0], (str(mutant.fault),)),) if mutant.fault else ()
    chosen = () if mutant.fault else named
    options = Options(
        samples=SAMPLES, seed=0, sources=chosen, workers=commands, certify=bool(original.file.accepted), in_process=True
    )
    model = mutant.model
    if mutant.fault:  # the program alone
        model = replace(model, file=model.file.model_copy(update={"source": []}))
    try:
        report = crosscheck(model, options, None, workers)
    except CrosscheckError as error:
        return [Trial.of(mutant, original.name, source, "refused", str(error)) for source in named]
    by_name = {s.name: s for s in report.sources}
    return [_judged(mutant, original, by_name[source], effect_of(mutant, original, source), known) for source in named]


def _judged(mutant: Mutant, original: RobotModel, source: doc.Source, effect: Effect, known: Sequence[reasons.Change]) -> Trial:
    trial = Trial.of(mutant, original.name, source.name, "", "")
    largest = float(max(effect.position_change.max(initial=0.0), effect.rotation_change.max(initial=0.0)))
    trial = trial.model_copy(update={"effect": largest})
    if source.status != "ran":
        return trial.model_copy(update={"outcome": "refused", "note": source.reason})
    flagged = source.verdict.disagrees
    if largest <= NOTHING or mutant.equivalent:
        if mutant.equivalent and largest > NOTHING:
            return trial.model_copy(update={"outcome": "missed", "note": f"not equivalent after all: {largest:.2g}"})
        return trial.model_copy(update={"outcome": "false alarm" if flagged else "left alone"})
    if not flagged:
        floor = _floor(effect, original, source)
        return trial.model_copy(update={"outcome": "missed" if floor is None else "below the floor", "note": floor or ""})
    told, named = _cause(mutant, source, known)
    return trial.model_copy(update={"outcome": "caught", "cause_named": named, "told": told})


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
    """What was told, and whether the first group names the cause, with joint and size, and nothing beside what was known."""
    found = source.explanation
    if found is None or not found.changes:
        return (found.unexplained if found else "nothing"), False
    told = " and ".join(change.text for change in found.changes)
    # A number that was off before is off by both.
    before = {(one.subject, one.parameter): one.size for change in known for one in (change, *change.equivalents)}
    causes = [c if c.size is None else replace(c, size=c.size + before.get((c.subject, c.parameter), 0.0)) for c in mutant.causes]
    hit = any(cause.named_by(said) for cause in causes for change in found.changes for said in (change, *change.equivalents))
    return told, hit and len(found.changes) <= 1 + len(known)
