"""`crosscheck diff`: two mechanisms from base to tip, whether they are one, why not, and both tables side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness.cause.changes import GAUGE
from harness.cause.explain import Explanation, explain
from harness.cause.first_difference import first_difference
from harness.cause.probe import PARTS, Probe
from harness.cause.problem import Problem, State
from harness.certificate.certify import Sampled, certify, sample
from harness.certificate.interpolation import Axis
from harness.description.dh import Convention
from harness.difference.operands import TIP, Operand, matched
from harness.kinematics.invariants import Matching, match
from harness.kinematics.mechanism import Mechanism
from harness.kinematics.recipes import Recipe
from harness.kinematics.side_by_side import Side, canonical_side
from harness.se3 import Array

GRID = 4096
SLIDE = 0.5  # m, range of prismatic joints


@dataclass(frozen=True, kw_only=True)
class Diff:
    """What was found. errors, bound: largest discrepancy seen, and proven for all configurations (None if not), [m], [rad]."""

    a: Operand
    b: Operand
    joints: dict[str, str]
    errors: tuple[float, float]
    bound: tuple[float, float] | None
    same: bool
    explanation: Explanation | None
    unexplained: str
    convention: Convention
    tables: tuple[Side, Side]
    matching: Matching | None


def diff(a: Operand, b: Operand, tolerance: tuple[float, float]) -> Diff:
    """Compare two mechanisms. Raises InputError if they do not have the same number and kinds of joints."""
    names = matched(a, b)
    first = a if a.table is not None or b.table is None else b  # repairs are tried on a table first
    if first is a:
        problem = _problem(a, b, names, tolerance)
    else:
        problem = _problem(b, a, {theirs: ours for ours, theirs in names.items()}, tolerance)
    start = State.start(problem)
    same = start.agrees()
    found = None if same else explain(problem)
    mechanism = _mechanism(problem.a)
    unexplained = "" if same or found else first_difference(problem, mechanism.joints, mechanism.prismatic)
    errors = [max(x) for x in zip(*(start.errors(part) for part in PARTS), strict=True)]
    recipes = (problem.a, problem.b) if first is a else (problem.b, problem.a)
    convention: Convention = next((o.table.convention for o in (a, b) if o.table is not None), "standard")
    tables = [canonical_side(_mechanism(recipe), convention, TIP) for recipe in recipes]
    # What is compared modulo base and tool is between the axes: standard rows say it for either convention.
    standard = [canonical_side(_mechanism(recipe), "standard", TIP).rows for recipe in recipes]
    matching = match(standard[0], standard[1]) if all(standard) else None
    bound = _bound(problem)
    return Diff(
        a=a,
        b=b,
        joints=names,
        errors=(errors[0], errors[1]),
        bound=bound,
        same=same,
        explanation=found,
        unexplained=unexplained,
        convention=convention,
        tables=(tables[0], tables[1]),
        matching=matching,
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


def _bound(problem: Problem) -> tuple[float, float] | None:
    """Proven for every angle (prismatic joints within half a metre); None for long chains and where joints are coupled."""
    mechanism = _mechanism(problem.a)
    axes = [Axis(False, 1, -SLIDE, SLIDE) if slides else Axis(True, 1, 0.0, 2.0 * math.pi) for slides in mechanism.prismatic]
    if math.prod(axis.count for axis in axes) > GRID:
        return None
    sampled = []
    for recipe in (problem.a, problem.b):
        sampled.append(_sampled(_mechanism(recipe), axes))
    if not all(s.holds for s in sampled):
        return None
    bounds = certify(sampled[0], sampled[1], axes)
    return float(bounds.position[0]), float(bounds.rotation[0])


def _sampled(mechanism: Mechanism, axes: list[Axis]) -> Sampled:
    def evaluate(q: Array) -> Array:
        return np.ascontiguousarray(np.swapaxes(mechanism.placements(q, (TIP,))[:, :, :3, :], -1, -2))

    return sample(evaluate, axes, np.random.default_rng(0))


def remarks(found: Diff) -> list[str]:
    """What the changed lengths have in common: another unit, or digits that were left off."""
    if found.explanation is None:
        return []
    groups = [[c for c in (change, *others) if c.kind == "parameter" and c.unit == "m" and not c.parameter.startswith(GAUGE)]
              for change, others in zip(found.explanation.changes, found.explanation.equivalents, strict=True)]  # fmt: skip
    lengths = [next((c for c in group if c.before != 0.0), group[0]) for group in groups if group]
    if len(lengths) < 2:
        return []
    said = []
    ratios = sorted(1.0 + c.size / c.before for c in lengths if min(abs(c.before), abs(c.before + c.size)) > 1e-6)
    middle = ratios[len(ratios) // 2] if ratios else 1.0
    if len(ratios) >= 3 and ratios[-1] < 1.1 * ratios[0] and abs(math.log(abs(middle))) > math.log(1.5):
        said.append(
            f"{len(ratios)} lengths are {ratios[0]:.3g} to {ratios[-1]:.3g} times as large in one as in the other: another unit"
        )
    rounded = [c for c in lengths if abs(c.size) <= 0.5001 * 10.0 ** -_decimals(c.before)]
    if len(rounded) >= 2:
        largest = max(abs(c.size) for c in rounded) * 1e3
        count = f"{len(rounded)} of {len(lengths)} lengths"
        said.append(f"{count} differ only beyond the digits given, by at most {largest:.3g} mm: rounded there")
    return said


def _decimals(x: float) -> int:
    """Digits behind the point of the shortest text that reads back as x."""
    text = f"{x:.12f}".rstrip("0")
    return len(text.partition(".")[2])
