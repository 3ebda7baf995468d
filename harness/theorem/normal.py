"""The normal form of a chain: constants between turns about z and slides along z, each driven in the positive sense.

    T(q) = C_0 M_1(q) C_1 ... M_n(q) C_n
An axis along -z, or a joint that a negative factor drives, is turned over by half a turn about x, which goes into the constants.
"""

from __future__ import annotations

from dataclasses import dataclass

import flint

from harness.theorem.balls import Matrix, aligned, identity
from harness.theorem.chain import Chains, Path, Row, Step


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """One moving step of a normal form.

    Attributes:
        parent: the one before it; None if it is the first.
        before: the constant transform (4, 4) between the two.
        turns: whether it turns about z; else it slides along z.
        row: by how much each joint drives it, (n,); the first factor that is not zero is positive.
        depth: how many motions come before it.
    """

    parent: Motion | None
    before: Matrix
    turns: bool
    row: Row
    depth: int

    @property
    def step(self) -> Step:
        """The motion as a step."""
        return Step(turns=self.turns, row=self.row)


@dataclass(frozen=True)
class Line:
    """One frame in normal form: its motions from the base, and the constant transform (4, 4) after the last one."""

    motions: tuple[Motion, ...]
    tail: Matrix


def normal(chains: Chains) -> dict[str, Line]:
    """Every frame of a description in normal form; frames that begin alike share their motions."""
    known: dict[Step, tuple[Motion, Matrix]] = {}
    return {name: _line(path, known) for name, path in chains.paths.items()}


def _line(path: Path, known: dict[Step, tuple[Motion, Matrix]]) -> Line:
    motions: list[Motion] = []
    constant = identity()
    for step in path:
        if not step.moves:
            constant = constant * step.constant
            continue
        if step not in known:
            known[step] = _motion(step, motions[-1] if motions else None, constant)
        motion, constant = known[step]
        motions.append(motion)
    return Line(tuple(motions), constant)


def _motion(step: Step, parent: Motion | None, before: Matrix) -> tuple[Motion, Matrix]:
    """A step as a motion about z, and the constant transform that follows it."""
    upright = step.upright()
    A = aligned(upright.axis)
    row = upright.row
    if next(x for x in row if x) < 0:
        A = A * flint.arb_mat([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])
        row = tuple(-x for x in row)
    depth = 0 if parent is None else parent.depth + 1
    before = before * upright.constant * A
    return Motion(parent=parent, before=before, turns=upright.turns, row=row, depth=depth), A.transpose()
