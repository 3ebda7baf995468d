"""Explains a disagreement of a run: what both sources showed, and their descriptions, handed to the search for a repair."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from harness.cause import fit
from harness.cause.changes import Change
from harness.cause.explain import discrepancy, explain
from harness.cause.first_difference import first_difference
from harness.cause.probe import PARTS, Probe
from harness.cause.problem import FAITHFUL, Problem, State
from harness.description.model import RobotModel
from harness.engines.registry import kind_of
from harness.kinematics.descriptions import X_AXIS, Z_AXIS, Reading
from harness.kinematics.recipes import Recipe, TableRecipe, UrdfRecipe
from harness.run.binding import Bound
from harness.run.outcome import Explained, Run
from harness.se3 import Array

ROUNDING = 2.0**-46  # of a length: 64 units in the last place, for a product of a dozen transforms
SHARED = 0.5  # of the tolerance: what another source's repair may leave of this one


def problem_of(
    model: RobotModel, offsets: Mapping[str, Array], reference: Bound, source: Bound, tolerance: tuple[float, float]
) -> Problem:
    """What a search needs to know about a source that disagrees with its reference."""
    known = [i for i in reference.view.available if i in source.view.available]
    law = model.configurations
    probe = Probe.within(law.lower, law.upper, [not turns for turns in law.revolute])
    both = [bound.mapped(probe.q) for bound in (reference, source)]
    T_a, T_b = (np.stack([T[i] for i in known], axis=1) for T in both)
    frames = [model.frames.frames[i] for i in known]
    names = tuple(f.name for f in frames)
    kinds = [kind_of(bound.engine.source) for bound in (reference, source)]
    # Lengths in millimetres taken for metres come with a thousand times the rounding: a right repair leaves that.
    largest = max(float(np.nan_to_num(np.abs(T[..., :3, 3])).max(initial=0.0)) for T in (T_a, T_b))
    tolerance = (max(tolerance[0], ROUNDING * largest), tolerance[1])
    recipes = []
    for bound, kind, T in zip((reference, source), kinds, (T_a, T_b), strict=True):
        packaged = bound.engine.takes == "packaged"
        candidates = [] if packaged else list(recipes_of(model, kind, names, offsets))
        recipes.append(_faithful(candidates, probe.q, names, T, tolerance))
    rigid = frozenset(f.name for f in frames if f.relation == "rigid") if kinds[0] != kinds[1] else frozenset()
    if kinds == ["dh", "dh"]:
        recipes[1] = None  # one table: what differs is what is done with it
    offsets_after = {names[i]: source.view.offsets[k] for i, k in enumerate(known)}
    labels = ["dh.csv" if kind == "dh" else "the URDF" for kind in kinds]
    engines = (reference.engine.source, source.engine.source)
    # Two descriptions that are read as they should be differ themselves; else it is the engine that does.
    sources = [label if recipe else name for label, recipe, name in zip(labels, recipes, engines, strict=True)]
    return Problem(
        a=recipes[0],
        b=recipes[1],
        names=names,
        rigid=rigid,
        probe=probe,
        observed=probe.observed(T_a, T_b),
        tolerance=tolerance,
        offsets_after=offsets_after,
        labels=(labels[0], labels[1]),
        sources=(sources[0], sources[1]),
        engines=engines,
    )


def recipes_of(model: RobotModel, kind: str, names: tuple[str, ...], offsets: Mapping[str, Array]) -> Iterator[Recipe]:
    """The description, in every way in which a source of this kind may read it."""
    frames = {f.name: f for f in model.frames.frames if f.name in names}
    if kind == "dh" or model.urdf is None or model.urdf_joints is None:
        known = {n: offsets.get(n, np.eye(4)) if f.offset is None else f.offset for n, f in frames.items()}
        yield TableRecipe(model.table, {n: (f.dh, known[n]) for n, f in frames.items()})
        return
    prismatic = tuple(model.table.kind(j) == "prismatic" for j in model.table.joints)
    links = {n: f.urdf or "" for n, f in frames.items()}
    plain = UrdfRecipe(
        urdf=model.urdf,
        base=model.frames.base.urdf or "",
        frames=links,
        joints=model.urdf_joints,
        model_joints=model.table.joints,
        prismatic=prismatic,
    )
    codes = {finding.code for finding in model.findings}
    for axis in (X_AXIS, Z_AXIS) if "missing-axis" in codes else (X_AXIS,):
        for stretched in (False, True) if "unnormalised-axis" in codes else (False,):
            for mimic in (True, False) if model.urdf_joints.followers else (True,):
                for float32 in (False, True):
                    yield replace(plain, reading=Reading(axis, stretched, mimic, float32))


def _faithful(
    candidates: list[Recipe], q: Array, names: tuple[str, ...], T: Array, tolerance: tuple[float, float]
) -> Recipe | None:
    """The first recipe that gives what the source gave, to a part of the tolerance; None if none does."""
    for recipe in candidates:
        errors = fit.errors(recipe.mechanism.placements(q, names), T)
        if all(error <= FAITHFUL * limit for error, limit in zip(errors, tolerance, strict=True)):
            return recipe
    return None


def explain_all(run: Run) -> None:
    """Why each source that is outside tolerance is; those that show the same as one before share its explanation."""
    solved: list[tuple[Problem, Explained]] = []
    every = range(len(run.model.frames.frames))
    for outcome in run.compared:
        tolerance = run.tolerance(outcome)
        if run.discrepancies().worst(outcome.name, tolerance, every) is None:
            continue
        try:
            problem = problem_of(run.model, run.rigid_transforms, run.reference.running(), outcome.running(), tolerance)
        except Exception as error:  # an engine's failure is its result; the comparison stands without its cause
            outcome.explained = Explained(unexplained=f"{outcome.name} failed: {type(error).__name__}: {error}")
            continue
        shared = (_of_another(known, one, problem) for one, known in solved)
        mine = next((known for known in shared if known is not None), None)
        if mine is None:
            mine = explained(problem, run.model)
            solved.append((problem, mine))
        outcome.explained = mine


def explained(problem: Problem, model: RobotModel) -> Explained:
    """The repair that explains the difference, or where the two part."""
    explanation = explain(problem)
    if explanation is not None:
        return Explained(explanation)
    prismatic = tuple(model.table.kind(j) == "prismatic" for j in model.table.joints)
    return Explained(unexplained=first_difference(problem, model.table.joints, prismatic))


def _of_another(known: Explained, one: Problem, other: Problem) -> Explained | None:
    """The explanation of one source as that of another that showed the same; None if that does not follow.

    What the repair leaves of one, and what the other is off that one, bound what it leaves of the other.
    """
    kinds = [problem.engines[1].split(":")[0] for problem in (one, other)]
    e = known.explanation
    if e is None or one.names != other.names or kinds[0] != kinds[1] or one.sources != other.sources:
        return None
    apart = [
        max(pair) for pair in zip(*(fit.errors(one.observed[part].b, other.observed[part].b) for part in PARTS), strict=True)
    ]
    residual = (e.after[0] + apart[0], e.after[1] + apart[1])
    if not all(x <= SHARED * limit for x, limit in zip(residual, other.tolerance, strict=True)):
        return None
    old, new = one.engines[1], other.engines[1]

    def named(change: Change) -> Change:
        return replace(change, text=change.text.replace(old, new))

    changes, others = tuple(map(named, e.changes)), tuple(tuple(map(named, slot)) for slot in e.equivalents)
    before = discrepancy(State.start(other))
    return Explained(replace(e, changes=changes, equivalents=others, before=before, after=residual))
