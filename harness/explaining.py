"""Explains a disagreement of a run: what both sources showed, and their descriptions, handed to the search for a repair."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from harness.analysis import fit
from harness.analysis.descriptions import SPECIFIED, X_AXIS, Z_AXIS
from harness.analysis.explain import Explanation, explain
from harness.analysis.problem import FAITHFUL, Problem, Seen
from harness.analysis.recipes import Recipe, TableRecipe, UrdfRecipe
from harness.binding import Bound
from harness.description.model import RobotModel
from harness.engines.registry import kind_of
from harness.se3 import Array

FITTED, CHECKED = 16, 48


def problem_of(
    model: RobotModel, offsets: Mapping[str, Array], reference: Bound, source: Bound, tolerance: tuple[float, float]
) -> Problem:
    """What a search needs to know about a source that disagrees with its reference."""
    known = [i for i in reference.view.available if i in source.view.available]
    q = configurations(model)
    both = [bound.mapped(q) for bound in (reference, source)]
    T_a, T_b = (np.stack([T[i] for i in known], axis=1) for T in both)
    frames = [model.frames.frames[i] for i in known]
    names = tuple(f.name for f in frames)
    parts = (Seen(q[:FITTED], T_a[:FITTED], T_b[:FITTED]), Seen(q[FITTED:], T_a[FITTED:], T_b[FITTED:]))
    kinds = [kind_of(bound.engine.source) for bound in (reference, source)]
    recipes = []
    for bound, kind, T in zip((reference, source), kinds, (T_a, T_b), strict=True):
        packaged = bound.engine.takes == "packaged"
        candidates = [] if packaged else list(_recipes(model, kind, names, offsets))
        recipes.append(_faithful(candidates, q, names, T, tolerance))
    rigid = frozenset(f.name for f in frames if f.relation == "rigid") if kinds[0] != kinds[1] else frozenset()
    if kinds == ["dh", "dh"]:
        recipes[1] = None  # one table: what differs is what is done with it
    labels = tuple("dh.csv" if kind == "dh" else "the URDF" for kind in kinds)
    return Problem(
        recipes[0], recipes[1], names, rigid, *parts, tolerance,
        (labels[0], labels[1]), (reference.engine.source, source.engine.source),
    )  # fmt: skip


def configurations(model: RobotModel) -> Array:
    """Where both sources are asked, (N, n): random within limits, then zero and one finite step of each joint."""
    rng = np.random.default_rng(0)
    law = model.configurations
    q = rng.uniform(law.lower, law.upper, (FITTED + CHECKED, len(law.lower)))
    steps = np.diag(np.where(law.revolute, 1.0, 0.1))
    return np.concatenate([q, np.zeros((1, len(law.lower))), steps])


def _recipes(model: RobotModel, kind: str, names: tuple[str, ...], offsets: Mapping[str, Array]) -> Iterator[Recipe]:
    """The description, in every way in which a source of this kind may read it."""
    frames = {f.name: f for f in model.frames.frames if f.name in names}
    if kind == "dh" or model.urdf is None or model.urdf_joints is None:
        known = {n: offsets.get(n, np.eye(4)) if f.offset is None else f.offset for n, f in frames.items()}
        yield TableRecipe(model.table, {n: (f.dh, known[n]) for n, f in frames.items()})
        return
    prismatic = tuple(model.table.kind(j) == "prismatic" for j in model.table.joints)
    links = {n: f.urdf or "" for n, f in frames.items()}
    plain = UrdfRecipe(model.urdf, model.frames.base.urdf or "", links, model.urdf_joints, model.table.joints, prismatic)
    codes = {finding.code for finding in model.findings}
    for axis in (X_AXIS, Z_AXIS) if "missing-axis" in codes else (X_AXIS,):
        for stretched in (False, True) if "unnormalised-axis" in codes else (False,):
            for mimic in (True, False) if model.urdf_joints.followers else (True,):
                for float32 in (False, True):
                    yield replace(
                        plain, reading=replace(SPECIFIED, default_axis=axis, stretched=stretched, mimic=mimic, float32=float32)
                    )


def _faithful(
    candidates: list[Recipe], q: Array, names: tuple[str, ...], T: Array, tolerance: tuple[float, float]
) -> Recipe | None:
    """The recipe that gives what the source gave, nearer than a part of the tolerance; None if there is none."""
    best, least = None, np.inf
    for recipe in candidates:
        ratio = max(e / t for e, t in zip(fit.errors(recipe.mechanism.placements(q, names), T), tolerance, strict=True))
        if ratio < 0.5 * least and ratio <= FAITHFUL:
            best, least = recipe, ratio
    return best


def explained(
    model: RobotModel, offsets: Mapping[str, Array], reference: Bound, source: Bound, tolerance: tuple[float, float]
) -> Explanation | None:
    """Why the source disagrees; None if nothing was found."""
    return explain(problem_of(model, offsets, reference, source, tolerance))
