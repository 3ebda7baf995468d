"""Mutants that are no single number: joints, units, conventions, frames, tools, digits, and what a controller does wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from lxml import etree

from harness import se3
from harness.description.dh import DHRow
from harness.description.model import RobotModel
from harness.mutation.mutant import Cause, Fault, Mutant, with_frames, with_row, with_rows
from harness.mutation.numbers import with_urdf
from harness.se3 import Array

# (a number, whether it is an angle) to the number that is written instead.
EditNumber: TypeAlias = Callable[[float, bool], float]

OFFSETS = ((math.pi / 2, "pi/2"), (math.radians(1.0), "1 deg"))
SHORT_PI = 3.1416
SAME_ANGLE = 1e-8  # rad: a URDF's own digits of pi are few


def of_joints(model: RobotModel) -> Iterator[Mutant]:
    """Signs, zero offsets, neighbours exchanged, couplings: on the table's side, and in the map to the URDF's joints."""
    table, moving = model.table, [i for i, row in enumerate(model.table.rows) if row.kind != "fixed"]
    for n, i in enumerate(moving):
        row = table.rows[i]
        if row.kind == "revolute":
            for size, text in OFFSETS:
                cause = Cause("parameter", row.name, "theta", -size)
                yield Mutant(
                    name=f"{row.name} offset by {text}",
                    side="table",
                    operator="offset",
                    model=with_row(model, i, theta=row.theta + size),
                    causes=(cause,),
                )
        yield from _of_map(model, n)
    for i, j in pairwise(moving):
        one, other = table.rows[i], table.rows[j]
        if one.kind == other.kind:
            rows = list(table.rows)
            rows[i], rows[j] = replace(one, name=other.name), replace(other, name=one.name)
            swapped = _reordered(with_rows(model, rows), model)
            yield Mutant(
                name=f"{one.name} and {other.name} exchanged",
                side="table",
                operator="order",
                model=swapped,
                causes=(Cause("order", one.name, other.name),),
            )


def _reordered(mutated: RobotModel, model: RobotModel) -> RobotModel:
    """The map to the URDF's joints, its columns in the order of the mutant's joints."""
    if model.urdf_joints is None:
        return mutated
    columns = [model.table.joints.index(name) for name in mutated.table.joints]
    return replace(mutated, urdf_joints=replace(model.urdf_joints, A=model.urdf_joints.A[:, columns]))


def _of_map(model: RobotModel, n: int) -> Iterator[Mutant]:
    joints, own = model.urdf_joints, model.table.joints
    if joints is None:
        return
    row = int(np.flatnonzero(joints.A[:, n])[0])
    name = own[n]
    A = joints.A.copy()
    A[row] *= -1.0
    cause = Cause("sign", name)
    yield Mutant(
        name=f"{name} sign in the mapping",
        side="mapping",
        operator="joint sign",
        model=replace(model, urdf_joints=replace(joints, A=A)),
        causes=(cause,),
    )
    if model.table.kind(name) != "revolute":
        return
    for size, text in OFFSETS:
        b = joints.b.copy()
        b[row] += size
        cause = Cause("parameter", joints.names[row], "zero", -size)
        mutated = replace(model, urdf_joints=replace(joints, b=b))
        yield Mutant(
            name=f"{name} offset by {text} in the mapping", side="mapping", operator="offset", model=mutated, causes=(cause,)
        )
    if n > 0 and model.table.kind(own[n - 1]) == "revolute":
        A = joints.A.copy()
        A[row, n - 1] += A[row, n]
        mutated = replace(model, urdf_joints=replace(joints, A=A))
        yield Mutant(
            name=f"{name} coupled to {own[n - 1]}",
            side="mapping",
            operator="coupling",
            model=mutated,
            causes=(Cause("coupling", name, own[n - 1]),),
        )


def of_whole(model: RobotModel) -> Iterator[Mutant]:
    """Convention, degrees, millimetres, float32, 3.1416: on the table, and on the URDF."""
    table = model.table
    other = "modified" if table.convention == "standard" else "standard"
    yield Mutant(
        name="rows read as the other convention",
        side="table",
        operator="convention",
        model=with_rows(model, table.rows, convention=other),
        causes=(Cause("convention"),),
    )

    def lengths(r: DHRow) -> DHRow:
        return replace(r, a=r.a * 1e3, d=r.d * 1e3)

    T = [M.copy() for M in (table.base, table.tool)]
    for M in T:
        M[:3, 3] *= 1e3
    cause = (Cause("millimetres"),)
    yield Mutant(
        name="table in millimetres",
        side="table",
        operator="millimetres",
        model=with_rows(model, [lengths(r) for r in table.rows], base=T[0], tool=T[1]),
        causes=cause,
    )
    yield _rows(model, "table in degrees", "degrees", lambda x, angle: math.degrees(x) if angle else x, Cause("degrees"))
    yield _rows(model, "table as float32", "float32", lambda x, angle: float(np.float32(x)), Cause("float32"))
    yield _rows(model, "table with pi = 3.1416", "3.1416", _with_short_pi, Cause("truncated pi"))
    if model.urdf is not None:
        yield _origins(
            model, "URDF in millimetres", "millimetres", lambda x, angle: x if angle else x * 1e3, Cause("millimetres")
        )
        yield _origins(model, "URDF in degrees", "degrees", lambda x, angle: math.degrees(x) if angle else x, Cause("degrees"))
        yield _origins(model, "URDF as float32", "float32", lambda x, angle: float(np.float32(x)), Cause("float32"))
        yield _origins(model, "URDF with pi = 3.1416", "3.1416", _with_short_pi, Cause("truncated pi"))


def _with_short_pi(x: float, angle: bool) -> float:
    """A multiple of pi / 12 with 3.1416 for pi; any other number as it is."""
    twelfths = round(x / (math.pi / 12)) if angle else 0
    return twelfths * SHORT_PI / 12 if twelfths and abs(x - twelfths * math.pi / 12) < SAME_ANGLE else x


def _rows(model: RobotModel, name: str, operator: str, edit: EditNumber, cause: Cause) -> Mutant:
    """Every number of the table's rows edited."""
    rows = [
        replace(r, a=edit(r.a, False), d=edit(r.d, False), alpha=edit(r.alpha, True), theta=edit(r.theta, True))
        for r in model.table.rows
    ]
    return Mutant(name=name, side="table", operator=operator, model=with_rows(model, rows), causes=(cause,))


def _origins(model: RobotModel, name: str, operator: str, edit: EditNumber, cause: Cause) -> Mutant:
    """Every number of the URDF's origins edited."""
    if model.urdf is None:
        raise ValueError("expected a model with a URDF")
    robot = etree.fromstring(model.urdf.text.encode())
    for origin in robot.iter("origin"):
        for attribute, angle in (("xyz", False), ("rpy", True)):
            if text := origin.get(attribute):
                origin.set(attribute, " ".join(repr(edit(float(word), angle)) for word in text.split()))
    return Mutant(name=name, side="urdf", operator=operator, model=with_urdf(model, robot), causes=(cause,))


def of_tool(model: RobotModel) -> Iterator[Mutant]:
    """The tool left out; where there is none, one of 150 mm that the other side does not know."""
    table, last = model.table, model.table.rows[-1]
    if not np.array_equal(table.tool, np.eye(4)):
        missing = with_rows(model, table.rows, tool=np.eye(4))
        yield Mutant(
            name="tool missing",
            side="table",
            operator="tool missing",
            model=missing,
            causes=(Cause("tool left out"), *_as_one_number(table.tool)),
        )
    elif last.kind == "fixed" and last.d:
        mutated = with_row(model, len(table.rows) - 1, d=0.0)
        yield Mutant(
            name="tool missing",
            side="table",
            operator="tool missing",
            model=mutated,
            causes=(Cause("parameter", last.name, "d", last.d),),
        )
    else:
        label = str(len(table.rows))
        frames = [replace(f, dh="tool") if f.dh == label else f for f in model.frames.frames]
        longer = with_frames(with_rows(model, table.rows, tool=se3.translation((0.0, 0.0, 0.15))), frames)
        yield Mutant(
            name="a tool of 150 mm on one side",
            side="table",
            operator="tool missing",
            model=longer,
            causes=(Cause("tool left out"),),
        )


def _as_one_number(tool: Array) -> list[Cause]:
    """The one number of a tool that is a move along, or a turn about, one axis: naming it names the tool."""
    roll, pitch, yaw = se3.to_rpy(tool)
    moves = [("move x", tool[0, 3]), ("move y", tool[1, 3]), ("move z", tool[2, 3])]
    numbers = [(name, float(x)) for name, x in (*moves, ("turn x", roll), ("turn y", pitch), ("turn z", yaw)) if x]
    return [Cause("parameter", "tool", name, x) for name, x in numbers] if len(numbers) == 1 else []


def of_controllers(model: RobotModel) -> Iterator[Mutant]:
    """What an implementation does wrong with the right table: run as a program of its own."""
    faults: tuple[tuple[Fault, Cause], ...] = (
        ("degrees", Cause("degrees", "q")),
        ("inverse", Cause("inverse")),
        ("reversed", Cause("reversed")),
    )
    for fault, cause in faults:
        yield Mutant(name=f"controller: {fault}", side="controller", operator=fault, model=model, causes=(cause,), fault=fault)
