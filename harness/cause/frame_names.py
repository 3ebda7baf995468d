"""Repairs of the mapping and of how a URDF is read: another link, another DH frame, the specification's defaults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from harness import se3
from harness.cause import fit
from harness.cause.changes import Change
from harness.cause.problem import State
from harness.kinematics.descriptions import SPECIFIED, of_table
from harness.kinematics.recipes import TableRecipe, UrdfRecipe, asked
from harness.se3 import Array

SAME = 1e-9
COMPARED = 8  # to compare two batches of placements takes as long as so many factors


def mapping_repairs(state: State) -> Iterator[State]:
    """Other links and DH frames, and the specified reading, one at a time."""
    b = state.b
    if isinstance(b, UrdfRecipe):
        yield from _read_as_specified(state, b)
        links = _links(state, b)
        yield from _other_base(state, b, links)
        yield from _other_links(state, b, links)
    if isinstance(state.a, TableRecipe):
        yield from _other_labels(state, state.a)


def _read_as_specified(state: State, b: UrdfRecipe) -> Iterator[State]:
    """The URDF read as the specification says, one deviation of the engine at a time."""
    source, reading = state.problem.engines[1], b.reading
    if reading.default_axis != SPECIFIED.default_axis:
        bare = [j.name for j in b.urdf.joint_list if j.axis is None and j.name in b.joints.names]
        text = f"axis default: {source} takes the missing axis of {', '.join(bare)} for z; the specification says x"
        change = Change(kind="axis default", side="source", subject=", ".join(bare), text=text)
        yield state.edited(change, state.a, replace(b, reading=replace(reading, default_axis=SPECIFIED.default_axis)))
    if reading.stretched:
        text = f"axis length: {source} multiplies the travel of prismatic joints by the length of their axis"
        change = Change(kind="axis length", side="source", text=text)
        yield state.edited(change, state.a, replace(b, reading=replace(reading, stretched=False)))
    if not reading.mimic:
        names = ", ".join(b.joints.followers)
        change = Change(
            kind="mimic",
            side="source",
            subject=names,
            text=f"mimic: {source} leaves {names} at zero, which should follow its leader",
        )
        yield state.edited(change, state.a, replace(b, reading=replace(reading, mimic=True)))
    if reading.float32:
        change = Change(kind="float32", side="source", text=f"float32: {source} keeps joint origins as float32")
        yield state.edited(change, state.a, replace(b, reading=replace(reading, float32=False)))


def _links(state: State, b: UrdfRecipe) -> dict[str, Array]:
    """Placements (N, 4, 4) of every link that hangs together with the base."""
    names = {name: name for name in b.urdf.links}
    q = state.problem.observed["fit"].q
    mechanism = asked(b.bare(b.base, names), b.P)
    state.problem.budget.spend(len(mechanism.factors), len(q))
    T = mechanism.placements(q)
    return dict(zip(names, np.moveaxis(T, 1, 0), strict=True))


def _constant(T: Array) -> bool:
    """Whether placements (N, 4, 4) are the same at all configurations."""
    return bool(np.ptp(T, axis=0).max(initial=0.0) < SAME)


def _differ(T_a: Array, T_b: Array) -> bool:
    return bool(np.abs(T_a - T_b).max(initial=0.0) > SAME)


def _exchanged(frames: Mapping[str, str], one: str, other: str) -> dict[str, str]:
    """The mapping with two links exchanged."""
    swap = {one: other, other: one}
    return {name: swap.get(link, link) for name, link in frames.items()}


def _other_base(state: State, b: UrdfRecipe, links: Mapping[str, Array]) -> Iterator[State]:
    """Placements in another link that never moves relative to the base link."""
    eye = np.broadcast_to(np.eye(4), links[b.base].shape)
    for link, T in links.items():
        if link != b.base and _constant(T) and _differ(T, eye):
            text = f"base frame: with placements in {link} instead of {b.base} both agree"
            change = Change(kind="base frame", side="between", subject=b.base, parameter=link, text=text)
            yield state.edited(change, state.a, replace(b, base=link, frames=_exchanged(b.frames, b.base, link)))


def _other_links(state: State, b: UrdfRecipe, links: Mapping[str, Array]) -> Iterator[State]:
    """Frames that ride on the same body at another place, and any link that is just where the reference has the frame."""
    T_a, T_b = state.now
    for i in state.problem.fitted_frames:
        name = state.problem.names[i]
        here = b.frames.get(name)
        if here is None or here == b.base:
            continue
        off = max(fit.errors(T_a[:, i : i + 1], T_b[:, i : i + 1])) > max(state.problem.tolerance)
        state.problem.budget.spend(COMPARED * len(links) if off else 1, len(T_a))
        for link, T in links.items():
            if not off or link == here or not _differ(T, links[here]):
                continue
            fits = max(fit.errors(T, T_a[:, i])) <= max(state.problem.tolerance)
            if not fits and not _constant(se3.inverse(links[here]) @ T):
                continue
            text = f"frame {name}: {link} is meant where {here} is mapped"
            change = Change(kind="frame", side="between", subject=name, parameter=link, text=text)
            yield state.edited(change, state.a, replace(b, frames={**b.frames, name: link}))
            if link in b.frames.values():
                pair = sorted((name, next(n for n, at in b.frames.items() if at == link)))
                both = f"{b.frames[pair[0]]} and {b.frames[pair[1]]}"
                text = f"frames {pair[0]} and {pair[1]}: their links {both} are exchanged"
                change = Change(kind="frame", side="between", subject=pair[0], parameter=pair[1], text=text)
                yield state.edited(change, state.a, replace(b, frames=_exchanged(b.frames, here, link)))


def _other_labels(state: State, a: TableRecipe) -> Iterator[State]:
    """Another DH frame that is just where the source has the frame."""
    T_a, T_b = state.now
    off = [
        i
        for i in state.problem.fitted_frames
        if max(fit.errors(T_a[:, i : i + 1], T_b[:, i : i + 1])) > max(state.problem.tolerance)
    ]
    if not off or a.backwards:
        return
    labels = {label: (label, np.eye(4)) for label in a.table.frames}
    state.problem.budget.spend(COMPARED * len(labels) * (1 + len(off)), len(T_a))
    placed = asked(of_table(a.table, labels), a.P).placements(state.problem.observed["fit"].q)
    for i in off:
        name = state.problem.names[i]
        here, offset = a.frames[name]
        for k, label in enumerate(labels):
            if label != here and max(fit.errors(placed[:, k] @ offset, T_b[:, i])) <= max(state.problem.tolerance):
                text = f"frame {name}: DH frame {label} is meant where {here} is mapped"
                change = Change(kind="frame", side="between", subject=name, parameter=label, text=text)
                yield state.edited(change, replace(a, frames={**a.frames, name: (label, offset)}), state.b)
