"""Two chains aligned as well as base, tool, joint signs and zero offsets allow: a start for fitting the rest."""

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
from harness.kinematics.screws import Screws, chain_screws, fit_gauge
from harness.se3 import Array

PARALLEL = 1e-3  # sine of the angle below which two axes count as parallel
NOTHING = 1e-9  # m or rad: a smaller change is left out


def aligned(state: State) -> State | None:
    """The state with signs, zero offsets, base and tool of `a` fitted to `b`.

    None if either side is no chain of unit screws, if `a` has no model, or if something is changed already.
    """
    a = state.a
    if a is None or state.shifts or state.inverse:
        return None
    prismatic, names = list(a.mechanism.prismatic), list(a.mechanism.joints)
    observed = state.problem.observed["check"]
    forms = [_canonical_form(T, prismatic, names, state) for T in (observed.a, observed.b)]
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
    return _with_base_and_tool(state.shifted(zeros), prismatic)


def _tip_screws(T_check: Array, prismatic: list[bool], state: State) -> Screws:
    """Joint screws of the chain up to the last fitted frame, from placements at the part "check" of the probe."""
    problem = state.problem
    return chain_screws(problem.probe.stepped(T_check)[:, problem.fitted_frames[-1]], prismatic)


def _canonical_form(T_check: Array, prismatic: list[bool], names: list[str], state: State) -> Canonical | None:
    """Canonical parameters of one side's chain; None if it is no chain of unit screws."""
    try:
        return canonical(_tip_screws(T_check, prismatic, state), prismatic, "standard", names, PARALLEL)
    except ValueError:
        return None


def _with_base_and_tool(state: State, prismatic: list[bool]) -> State:
    """The state with base and tool fitted, as six numbers each."""
    problem = state.problem
    T_a, T_b = state.placements("check")
    S_a, S_b = (_tip_screws(T, prismatic, state).S for T in (T_a, T_b))
    X = fit_gauge(S_a, S_b).T_b_a
    tip = problem.fitted_frames[-1]
    Y = fit.fit_constant_offset((X @ T_a)[:, tip : tip + 1], T_b[:, tip : tip + 1])[0]
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
