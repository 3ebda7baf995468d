"""A description as chains of elementary steps with exact numbers: what the theorem multiplies out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TypeAlias

from harness.description.written import ZERO, Exact
from harness.theorem.balls import Axis, Matrix, Z, direction, inverse, moved, turned

Row: TypeAlias = tuple[Fraction, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """A turn about an axis, or a move along it, by `amount + row . q`; or a constant transform.

    Attributes:
        turns: whether it turns; else it moves.
        axis: of any length; its direction counts.
        amount: the constant part [rad or m].
        row: by how much it changes with each joint, (n,); empty if no joint changes it.
        T: the constant transform (4, 4); None for a turn or a move.
    """

    turns: bool = False
    axis: Axis = Z
    amount: Exact = ZERO
    row: Row = ()
    T: Matrix | None = None

    @property
    def moves(self) -> bool:
        """Whether a joint changes it."""
        return any(self.row)

    @property
    def constant(self) -> Matrix:
        """Its transform (4, 4) at q = 0."""
        if self.T is not None:
            return self.T
        return (turned if self.turns else moved)(self.axis, self.amount)

    def inverted(self) -> Step:
        """The step back."""
        if self.T is not None:
            return replace(self, T=inverse(self.T))
        return replace(self, amount=self.amount.scaled(Fraction(-1)), row=tuple(-x for x in self.row))

    def upright(self) -> Step:
        """The same motion about +x, +y or +z if its axis is along one of them, either way."""
        along, sign = direction(self.axis)
        if along < 0 or sign > 0:
            return self
        a, b, c = self.axis
        return replace(self.inverted(), axis=(-a, -b, -c))


Path: TypeAlias = tuple[Step, ...]


@dataclass(frozen=True)
class Chains:
    """One description: from the base frame to each named frame, as a function of the model's joints.

    Attributes:
        joints: names of the joints, in the order of q.
        paths: for each frame its steps, from the base. Frames that begin alike share the same steps.
    """

    joints: tuple[str, ...]
    paths: Mapping[str, Path]

    def only(self, names: Iterable[str]) -> Chains:
        """The description at some of its frames."""
        return Chains(self.joints, {name: self.paths[name] for name in names})

    def slides(self, joint: int) -> bool:
        """Whether a joint, by its index, slides something, whatever else it does."""
        return any(not step.turns and step.row and step.row[joint] for path in self.paths.values() for step in path)

    def asked(self, joints: tuple[str, ...], own: Sequence[int]) -> Chains:
        """The description as a function of joints in another order, or of other names.

        Args:
            joints: the names, (n,).
            own: for each of them the index of this description's joint, (n,).
        """
        if list(own) == list(range(len(own))):
            return Chains(joints, self.paths)
        known: dict[Step, Step] = {}
        for path in self.paths.values():
            for step in path:
                row = tuple(step.row[i] for i in own) if step.row else ()
                known.setdefault(step, replace(step, row=row))
        return Chains(joints, {name: tuple(known[step] for step in path) for name, path in self.paths.items()})
