"""Two chains laid on each other as well as base, tool, joint signs and zero offsets allow: a start for fitting the rest."""

from __future__ import annotations

import numpy as np

from harness import se3
from harness.cause import fit
from harness.cause.changes import Change
from harness.cause.problem import Knob, State
from harness.kinematics.canonical import Canonical, canonical
from harness.kinematics.invariants import match, zero_offsets
from harness.kinematics.mechanism import Parameter
from harness.kinematics.recipes import TableRecipe, mixed
from harness.kinematics.screws import chain_screws, fit_gauge
from harness.se3 import Array

PARALLEL = 1e-3
NOTHING = 1e-9


def aligned(state: State) -> State | None:
    """The state with signs, zero offsets, base and tool of `a` made to fit `b`; None if either is no chain of unit screws."""
    a = state.a
    if a is None or state.shifts or state.inverse:
        return None
    prismatic, names = list(a.mechanism.prismatic), list(a.mechanism.joints)
    forms = [_form(T, prismatic, names, state) for T in (state.problem.check.a, state.problem.check.b)]
    if forms[0] is None or forms[1] is None:
        return None
    rows = [form.rows for form in forms if form is not None]
    matching = match(rows[0], rows[1])
    for name, sign in zip(names, matching.signs, strict=True):
        if sign < 0 and state.a is not None:
            P = np.diag([-1.0 if n == name else 1.0 for n in names])
            text = f"{name} turns the other way in {state.problem.sources[1]}: its sign is flipped"
            state = state.edited(Change(kind="sign", side="between", subject=name, text=text), mixed(state.a, P), state.b)
    offsets = zero_offsets(rows[0], rows[1], matching)
    zeros = {}
    for name, slides, offset in zip(names, prismatic, offsets, strict=True):
        number = ("d" if slides else "theta") if isinstance(a, TableRecipe) else "zero"
        if abs(offset) > NOTHING:
            zeros[Knob("a", Parameter(name, number, "m" if slides else "rad"))] = offset
    return _based(state.shifted(zeros), prismatic)


def _steps(T: Array, count: int, state: State) -> Array:
    """Of the tip, the placements at zero and after each joint's step: the last rows of the check."""
    return np.asarray(T[-count - 1 :, state.problem.fitted[-1]])


def _form(T: Array, prismatic: list[bool], names: list[str], state: State) -> Canonical | None:
    try:
        return canonical(chain_screws(_steps(T, len(names), state), prismatic), prismatic, "standard", names, PARALLEL)
    except ValueError:
        return None


def _based(state: State, prismatic: list[bool]) -> State:
    """With base and tool fitted, as six numbers each."""
    n, problem = len(prismatic), state.problem
    T_a, T_b = state.placements(problem.check)
    screws = [chain_screws(_steps(T, n, state), prismatic).S for T in (T_a, T_b)]
    X = fit_gauge(screws[0], screws[1]).T_b_a
    tip = problem.fitted[-1]
    Y = fit.behind((X @ T_a)[:, tip : tip + 1], T_b[:, tip : tip + 1])[0]
    if isinstance(state.a, TableRecipe):
        base, tool = state.a.table.base, state.a.table.tool
        X, Y = se3.inverse(base) @ X @ base, tool @ Y @ se3.inverse(tool)
    known = set(state.a.mechanism.parameters) if state.a is not None else set()
    shifts = dict(state.shifts)
    for owner, T in (("base", X), ("tool", Y)):
        roll, pitch, yaw = se3.to_rpy(T)
        numbers = [*(Parameter(owner, f"move {k}", "m") for k in "xyz"), *(Parameter(owner, f"turn {k}", "rad") for k in "zyx")]
        for parameter, size in zip(numbers, (*T[:3, 3], yaw, pitch, roll), strict=True):
            if parameter in known and abs(size) > NOTHING:
                shifts[Knob("a", parameter)] = float(size)
    return state.shifted(shifts)
