"""`crosscheck diff`: two mechanisms from base to tip, whether they are one, why not, and both tables side by side."""

from __future__ import annotations

import math

import numpy as np

from harness.cause.explain import explain
from harness.cause.first_difference import first_difference
from harness.cause.probe import PARTS, Probe
from harness.cause.problem import Problem, State
from harness.description.dh import Convention
from harness.difference.operands import TIP, Operand, matched
from harness.difference.result import Difference, Largest
from harness.kinematics.invariants import match
from harness.kinematics.mechanism import Mechanism
from harness.kinematics.recipes import Recipe
from harness.kinematics.side_by_side import canonical_side
from harness.theorem.statement import Theorem, theorem

SLIDE = 0.5  # m, range of prismatic joints


def diff(a: Operand, b: Operand, tolerance: tuple[float, float]) -> Difference:
    """Compare two mechanisms from base to tip.

    a, b: the operands.
    tolerance: what counts as agreement [m], [rad].

    Raises InputError if they do not have the same number and kinds of joints.
    """
    names = matched(a, b)
    first = a if a.table is not None or b.table is None else b  # repairs are tried on a table first
    if first is a:
        problem = _problem(a, b, names, tolerance)
    else:
        problem = _problem(b, a, {theirs: ours for ours, theirs in names.items()}, tolerance)
    start = State.start(problem)
    same = start.agrees()
    explanation = None if same else explain(problem)
    mechanism = _mechanism(problem.a)
    unexplained = "" if same or explanation else first_difference(problem, mechanism.joints, mechanism.prismatic)
    proven = _theorem(a, b, names)
    tip = proven.frames.get(TIP)
    errors = [max(x) for x in zip(*(start.errors(part) for part in PARTS), strict=True)]
    recipes = (problem.a, problem.b) if first is a else (problem.b, problem.a)
    convention: Convention = next((o.table.convention for o in (a, b) if o.table is not None), "standard")
    tables = [canonical_side(_mechanism(recipe), convention, TIP) for recipe in recipes]
    # What is compared modulo base and tool is between the axes: standard rows say it for either convention.
    same_convention = convention == "standard"
    standard = [
        t.rows if same_convention else canonical_side(_mechanism(r), "standard", TIP).rows
        for t, r in zip(tables, recipes, strict=True)
    ]
    return Difference(
        a=a,
        b=b,
        same=same,
        largest=Largest(max(errors[0], tip.position_found), max(errors[1], tip.rotation_found)) if tip else Largest(*errors),
        theorem=proven,
        tolerance=Largest(*tolerance),
        joints=names,
        explanation=explanation,
        unexplained=unexplained,
        convention=convention,
        tables=(tables[0], tables[1]),
        matching=match(standard[0], standard[1]) if all(standard) else None,
    )


def _mechanism(recipe: Recipe | None) -> Mechanism:
    if recipe is None:
        raise ValueError("both operands have a description")
    return recipe.mechanism


def _problem(a: Operand, b: Operand, names: dict[str, str], tolerance: tuple[float, float]) -> Problem:
    """names: b's joint for each of a's. Joints are called as a calls them."""
    both_urdf = a.table is None and b.table is None
    recipes = (a.recipe(a.joints, {j: j for j in a.joints}, both_urdf), b.recipe(a.joints, names, False))
    reach = np.where(a.prismatic, SLIDE, math.pi)  # whole turns, and half a metre either way
    probe = Probe.within(-reach, reach, a.prismatic)
    T_a, T_b = (recipe.mechanism.placements(probe.q, (TIP,)) for recipe in recipes)
    labels = (a.name, b.name) if a.name != b.name else (a.label, b.label)
    return Problem(
        a=recipes[0],
        b=recipes[1],
        names=(TIP,),
        rigid=frozenset(),
        probe=probe,
        observed=probe.observed(T_a, T_b),
        tolerance=tolerance,
        labels=labels,
        sources=labels,
        engines=labels,
    )


def _theorem(a: Operand, b: Operand, names: dict[str, str]) -> Theorem:
    """What is proven for every angle, and for prismatic joints within half a metre either way."""
    one, other = a.chains(a.joints, {j: j for j in a.joints}), b.chains(a.joints, names)
    ranges = {
        joint: (-SLIDE, SLIDE) if slides else (-math.pi, math.pi)  # one that turns and slides has a range too
        for j, (joint, slides) in enumerate(zip(a.joints, a.prismatic, strict=True))
        if slides or one.slides(j) or other.slides(j)
    }
    return theorem(one, other, ranges)
