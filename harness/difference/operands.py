"""One mechanism from a base to a tip, as `diff` and `identify` compare it: a DH table, or a chain of a URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.description.dh import DHTable
from harness.description.joints import complete, leader_of
from harness.description.urdf import MOVABLE, UNSUPPORTED, Urdf
from harness.description.urdf_lint import check
from harness.errors import InputError, UrdfError
from harness.kinematics.recipes import Recipe, TableRecipe, UrdfRecipe
from harness.theorem import descriptions as exact
from harness.theorem.chain import Chains

TIP = "tip"


@dataclass(frozen=True, kw_only=True)
class Operand:
    """One mechanism from a base to a tip: a DH table, or a chain of a URDF."""

    name: str
    joints: tuple[str, ...]
    prismatic: tuple[bool, ...]
    table: DHTable | None = None
    urdf: Urdf | None = None
    base: str = ""
    tip: str = ""

    @property
    def label(self) -> str:
        """What it is called in sentences."""
        return self.name if self.urdf is None else f"{self.name} ({self.base} to {self.tip})"

    def recipe(self, order: Sequence[str], names: Mapping[str, str], gauge: bool) -> Recipe:
        """Its mechanism in the joints `order`; names: its own joint for each of them. gauge: with base and tool parameters."""
        if self.table is not None:
            return TableRecipe(self.table, {TIP: ("tool", np.eye(4))})
        if self.urdf is None:
            raise ValueError("neither a table nor a URDF")
        units = np.eye(len(order))  # once: a row of its own for each joint would keep n matrices
        rows = {names[joint]: (units[i], 0.0) for i, joint in enumerate(order)}
        kinds = dict(zip(self.joints, self.prismatic, strict=True))
        slides = tuple(kinds[names[joint]] for joint in order)
        joints = complete(rows, self.urdf, len(order))
        return UrdfRecipe(
            urdf=self.urdf,
            base=self.base,
            frames={TIP: self.tip},
            joints=joints,
            model_joints=tuple(order),
            prismatic=slides,
            gauge=gauge,
        )

    def chains(self, order: Sequence[str], names: Mapping[str, str]) -> Chains:
        """Its chain with exact numbers, in the joints `order`; names: its own joint for each of them. Ends at `TIP`."""
        if self.table is not None:
            ends = (exact.of_matrix(self.table.base), exact.of_matrix(self.table.tool))
            chains = exact.of_table(self.table, {TIP: ("tool", ())}, *ends)
            return chains.asked(tuple(order), [self.table.joints.index(names[joint]) for joint in order])
        if self.urdf is None:
            raise ValueError("neither a table nor a URDF")
        units = np.eye(len(order))
        rows = {names[joint]: (units[i], 0.0) for i, joint in enumerate(order)}
        joints = complete(rows, self.urdf, len(order))
        return exact.of_urdf(self.urdf, self.base, {TIP: (self.tip, ())}, joints, order)


def of_table(table: DHTable, name: str) -> Operand:
    """The whole table as an operand. Raises InputError if nothing moves."""
    if not table.joints:
        raise InputError("expected at least one joint that moves, every row is fixed", where=name)
    return Operand(
        name=name, joints=table.joints, prismatic=tuple(table.kind(j) == "prismatic" for j in table.joints), table=table
    )


def of_urdf(urdf: Urdf, base: str | None = None, tip: str | None = None) -> Operand:
    """The chain from link `base` (default: the root) to link `tip` (default: the only leaf). Raises InputError, UrdfError."""
    check(urdf)
    path = urdf.path
    base, tip = base or urdf.roots[0], tip or only_leaf(urdf)
    for option, link in (("--base", base), ("--tip", tip)):
        urdf.require_link(link, option)
    chain = urdf.between(base, tip)
    for joint in chain:
        if joint.type in UNSUPPORTED:
            raise UrdfError(f"joint {joint.name!r} on the chain is {joint.type}", where=path, line=joint.line)
    leaders = {leader_of(urdf, joint).name: leader_of(urdf, joint) for joint in chain if joint.type in MOVABLE}
    if not leaders:
        raise InputError(f"nothing moves between {base!r} and {tip!r}", where=path, hint="choose --base and --tip")
    kinds = tuple(joint.type == "prismatic" for joint in leaders.values())
    return Operand(name=path.name, joints=tuple(leaders), prismatic=kinds, urdf=urdf, base=base, tip=tip)


def only_leaf(urdf: Urdf) -> str:
    """The link at the end, if there is one only. Raises InputError."""
    leaves = [link for link in urdf.links if not urdf.children(link)]
    if len(leaves) != 1:
        raise InputError(f"expected --tip: the file has {len(leaves)} leaves", where=urdf.path, hint=", ".join(leaves[:12]))
    return leaves[0]


def matched(a: Operand, b: Operand) -> dict[str, str]:
    """b's joint for each of a's: by name if the names are the same, else in order from the base. Raises InputError."""
    if len(a.joints) != len(b.joints):
        counts = f"{a.label} has {len(a.joints)} joints ({', '.join(a.joints)}), {b.label} has {len(b.joints)}"
        raise InputError(f"no two of one kind: {counts} ({', '.join(b.joints)})", hint="choose --base and --tip")
    names = dict(zip(a.joints, a.joints if set(a.joints) == set(b.joints) else b.joints, strict=True))
    kinds = [dict(zip(o.joints, o.prismatic, strict=True)) for o in (a, b)]
    for joint, other in names.items():
        if kinds[0][joint] != kinds[1][other]:
            slides, turns = (a.label, b.label) if kinds[0][joint] else (b.label, a.label)
            raise InputError(f"joint {joint!r} slides in {slides}, and turns in {turns}")
    return names


def named_after(nameless: Operand, other: Operand) -> Operand:
    """A table whose rows have no names of their own, with its joints called as the other operand calls them.

    It stays as it is if the counts differ.
    """
    table = nameless.table
    if table is None or len(table.joints) != len(table.rows) or len(table.joints) != len(other.joints):
        return nameless
    rows = tuple(replace(row, name=name) for row, name in zip(table.rows, other.joints, strict=True))
    return of_table(replace(table, rows=rows), nameless.name)
