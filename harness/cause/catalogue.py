"""The structural repairs that are tried: mistakes that people make with joints, units, conventions, frames and constants.

Each is an edit of one description, or of what its owner does with it; the change of numbers is `refine`'s and `fit`'s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np

from harness.cause.changes import Change
from harness.cause.problem import End, State
from harness.description.dh import Convention, DHRow
from harness.description.values import find_truncation
from harness.kinematics.recipes import Recipe, TableRecipe, UrdfRecipe, mixed

CUT = (3.14, 3.1416, 3.14159, 3.141593, 3.1415927, 3.14159265)
DEGREES = 180.0 / math.pi


def structural_repairs(state: State) -> Iterator[State]:
    """Every structural repair of both sides, one at a time."""
    yield from (state.edited(change, a, state.b) for change, a in _of_joints(state))
    yield from (state.edited(change, a, state.b) for change, a in _of_recipe(state.a, "a", state.problem.labels[0], state))
    yield from (state.edited(change, state.a, b) for change, b in _of_recipe(state.b, "b", state.problem.labels[1], state))
    source, reference = state.problem.sources[1], state.problem.sources[0]
    text = f"{source} gives inverse transforms: its placements are those of the base in the frame, seen from {reference}"
    if not state.inverse:
        yield state.edited(Change(kind="inverse", side="source", text=text), state.a, state.b, inverse=True)


def fine_repairs(state: State) -> Iterator[State]:
    """Those repairs that may explain a small difference: pi cut short, float32."""
    yield from (state.edited(change, a, state.b) for change, a in _of_digits(state.a, state.problem.labels[0], "a"))
    yield from (state.edited(change, state.a, b) for change, b in _of_digits(state.b, state.problem.labels[1], "b"))


def _of_joints(state: State) -> Iterator[tuple[Change, Recipe]]:
    """What the source does with q: signs, order, couplings, degrees. The reference is made to do the same: it takes P q for q."""
    if state.a is None:
        return
    mechanism, source = state.a.mechanism, state.problem.sources[1]
    joints, slides = mechanism.joints, mechanism.prismatic
    n = len(joints)
    for i, joint in enumerate(joints):
        P = np.eye(n)
        P[i, i] = -1.0
        text = f"{joint} turns the other way in {source}: its sign is flipped"
        yield Change(kind="sign", side="between", subject=joint, text=text), mixed(state.a, P)
    few = () if state.problem.budget.pairs_left_out else range(n)
    for i in few:
        for j in range(i + 1, n):
            if slides[i] == slides[j]:
                P = np.eye(n)
                P[[i, j]] = P[[j, i]]
                text = f"{joints[i]} and {joints[j]} are exchanged in {source}: the joint order differs"
                yield Change(kind="order", side="between", subject=joints[i], parameter=joints[j], text=text), mixed(state.a, P)
    if n > 2:
        text = f"the joints are in reverse order in {source}"
        yield (
            Change(kind="order", side="between", subject="all", parameter="reversed", text=text),
            mixed(state.a, np.eye(n)[::-1]),
        )
    for i, j in permutations(few, 2):
        for factor in (1.0, -1.0):
            P = np.eye(n)
            P[i, j] = factor
            sign = "+" if factor > 0 else "-"
            text = f"{joints[i]} is coupled in {source}: it moves by {joints[i]} {sign} {joints[j]}"
            yield (
                Change(kind="coupling", side="between", subject=joints[i], parameter=joints[j], size=factor, text=text),
                mixed(state.a, P),
            )
    turns = ~np.array(slides, dtype=bool)
    if turns.any():
        for factor, how in (
            (1.0 / DEGREES, "reads radians as degrees: its joint values are 57.3 times too small"),
            (DEGREES, "reads degrees as radians: its joint values are 57.3 times too large"),
        ):
            text = f"degrees: {source} {how}"
            yield (
                Change(kind="degrees", side="source", subject="q", size=factor, text=text),
                mixed(state.a, np.diag(np.where(turns, factor, 1.0))),
            )


def _of_recipe(recipe: Recipe | None, end: End, label: str, state: State) -> Iterator[tuple[Change, Recipe]]:
    """Units, and what only a table or only a URDF can have wrong."""
    if recipe is None:
        return
    for factor, unit in ((1000.0, "metres where millimetres are meant"), (0.001, "millimetres where metres are meant")):
        change = Change(kind="millimetres", side=end, size=factor, text=f"lengths of {label} are in {unit}: a factor of 1000")
        yield change, _scaled(recipe, factor, 1.0)
    for factor, unit in ((DEGREES, "radians where degrees are meant"), (1.0 / DEGREES, "degrees where radians are meant")):
        change = Change(kind="degrees", side=end, subject="description", size=factor, text=f"angles of {label} are in {unit}")
        yield change, _scaled(recipe, 1.0, factor)
    if isinstance(recipe, TableRecipe):
        yield from _of_table(recipe, end, label, state.problem.sources[1])
    else:
        yield from _of_urdf(recipe, end, label, state.problem.sources[0])
    yield from _of_digits(recipe, label, end)


def _scaled(recipe: Recipe, length: float, angle: float) -> Recipe:
    """Every length and angle of a description in another unit; the mapping's offsets are not the description's."""
    scaled = _numbers(recipe, lambda x, turns: x * (angle if turns else length))
    if not isinstance(scaled, TableRecipe):
        return scaled
    transforms = [T.copy() for T in (scaled.table.base, scaled.table.tool)]
    for T in transforms:
        T[:3, 3] *= length
    return replace(scaled, table=replace(scaled.table, base=transforms[0], tool=transforms[1]))


def _of_table(recipe: TableRecipe, end: End, label: str, source: str) -> Iterator[tuple[Change, Recipe]]:
    """The other convention, the product in reverse order, the tool left out."""
    table = recipe.table
    other: Convention = "modified" if table.convention == "standard" else "standard"
    text = f"convention: {label} reads its rows as {table.convention} DH; as {other} DH they agree"
    yield Change(kind="convention", side=end, text=text), replace(recipe, table=replace(table, convention=other))
    if not recipe.backwards:
        text = f"{source} multiplies in reverse order: T = A T instead of T A"
        yield Change(kind="reversed", side="source", text=text), replace(recipe, backwards=True)
    if not np.array_equal(table.tool, np.eye(4)):
        text = f"tool: {source} leaves the tool transform of {label} out"
        yield (
            Change(kind="tool left out", side=end, subject="tool", text=text),
            replace(recipe, table=replace(table, tool=np.eye(4))),
        )
    last = table.rows[-1]
    if last.kind == "fixed" and (last.a or last.d or last.alpha or last.theta):
        bare = DHRow(name=last.name, kind=last.kind, a=0.0, alpha=0.0, d=0.0, theta=0.0)
        text = f"tool: {source} leaves the last row of {label}, {last.name}, out"
        yield (
            Change(kind="tool left out", side=end, subject=last.name, text=text),
            replace(recipe, table=replace(table, rows=(*table.rows[:-1], bare))),
        )


def _of_urdf(recipe: UrdfRecipe, end: End, label: str, other: str) -> Iterator[tuple[Change, Recipe]]:
    """Another axis of one joint, the tool's joint left out."""
    for joint in recipe.urdf.joint_list:
        if joint.name not in recipe.joints.names or joint.type == "fixed":
            continue
        for k, letter in enumerate("xyz"):
            axis = tuple(1.0 if i == k else 0.0 for i in range(3))
            if joint.axis is not None and np.allclose(np.abs(joint.axis), axis):
                continue
            written = "no axis, which means x" if joint.axis is None else f"axis {' '.join(f'{x:g}' for x in joint.axis)}"
            for sign in (1.0, -1.0):
                text = f"axis of {joint.name}: {label} has {written}; with {'-' if sign < 0 else ''}{letter} it agrees"
                change = Change(kind="axis", side=end, subject=joint.name, parameter=letter, size=sign, text=text)
                yield change, recipe.with_joint(joint.name, axis=tuple(sign * x for x in axis))

    for joint in recipe.urdf.joint_list:
        at_the_end = joint.type == "fixed" and not recipe.urdf.children(joint.child) and joint.child in recipe.frames.values()
        if at_the_end and any((*joint.xyz, *joint.rpy)):
            text = f"tool: {other} leaves out what {label} has behind the arm, the origin of {joint.name}"
            zero = (0.0, 0.0, 0.0)
            yield (
                Change(kind="tool left out", side=end, subject=joint.name, text=text),
                recipe.with_joint(joint.name, xyz=zero, rpy=zero),
            )


def _of_digits(recipe: Recipe | None, label: str, end: End) -> Iterator[tuple[Change, Recipe]]:
    """Multiples of pi written out, or cut short; numbers kept as float32."""
    if recipe is None:
        return
    exact, cut = _angles(recipe, _uncut)
    if cut:
        text = f"truncated pi: {label} writes {', '.join(cut[:3])} where a multiple of pi is meant"
        yield Change(kind="truncated pi", side=end, text=text), exact
    for pi in CUT:
        short, which = _angles(recipe, lambda x, pi=pi: _cut(x, pi))  # type: ignore[misc]
        if which:
            text = f"truncated pi: with pi cut to {pi:g} in {label} both agree"
            yield Change(kind="truncated pi", side=end, size=pi, text=text), short
    text = f"float32: with the numbers of {label} rounded to float32 both agree"
    yield Change(kind="float32", side=end, size=32.0, text=text), _numbers(recipe, lambda x, angle: float(np.float32(x)))
    numbers: list[float] = []
    exact_there = _numbers(recipe, lambda x, angle: numbers.append(x) or _written_out(x, angle))  # type: ignore[func-returns-value]
    if numbers and all(float(np.float32(x)) == x for x in numbers):
        text = f"float32: the numbers of {label} are float32; written out in full they agree"
        yield Change(kind="float32", side=end, size=64.0, text=text), exact_there


def _written_out(x: float, angle: bool) -> float:
    """The number that was meant by a float32: a multiple of pi / 12, or the shortest decimal that rounds to it."""
    single = np.float32(x)
    multiple = round(x / (math.pi / 12)) * math.pi / 12
    return multiple if angle and multiple and np.float32(multiple) == single else float(str(single))


def _uncut(x: float) -> float:
    """The multiple of pi that was meant by an angle written with too few digits; else the angle itself."""
    truncation = find_truncation(repr(x))
    return x if truncation is None else math.copysign(_nearest_multiple(x), x)


def _nearest_multiple(x: float) -> float:
    return min((abs(round(x / (math.pi / m)) * math.pi / m) for m in (1, 2, 4, 3, 6)), key=lambda y: abs(y - abs(x)))


def _cut(x: float, pi: float) -> float:
    """A multiple of pi / 12 with another value of pi; any other angle itself."""
    twelfths = round(x / (math.pi / 12))
    return twelfths * pi / 12 if twelfths and abs(x - twelfths * math.pi / 12) < 1e-14 else x


def _numbers(recipe: Recipe, edit: Callable[[float, bool], float]) -> Recipe:
    """A description with every number changed: x becomes edit(x, whether x is an angle)."""
    if isinstance(recipe, TableRecipe):
        rows = tuple(
            replace(r, a=edit(r.a, False), d=edit(r.d, False), alpha=edit(r.alpha, True), theta=edit(r.theta, True))
            for r in recipe.table.rows
        )
        return replace(recipe, table=replace(recipe.table, rows=rows))
    joints = tuple(
        replace(j, xyz=tuple(edit(x, False) for x in j.xyz), rpy=tuple(edit(x, True) for x in j.rpy))
        for j in recipe.urdf.joint_list
    )
    return replace(recipe, urdf=replace(recipe.urdf, joint_list=joints))


def _angles(recipe: Recipe, change: Callable[[float], float]) -> tuple[Recipe, list[str]]:
    """A description with every angle changed, and the angles that become another number, as text."""
    edited_angles: list[str] = []

    def edit(x: float, angle: bool) -> float:
        y = change(x) if angle else x
        if y != x:
            edited_angles.append(repr(x))
        return y

    edited = _numbers(recipe, edit)
    return edited, list(dict.fromkeys(edited_angles))
