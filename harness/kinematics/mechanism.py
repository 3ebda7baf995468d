"""A mechanism as a tree of elementary factors, each with a named parameter: what a repair edits, and a fit differentiates.

Every description becomes the same thing: turns about and moves along x, y and z, some by a constant, some by a joint. A DH row
is four of them, a URDF joint seven. Changing the value v of one factor by delta moves all frames after it by a rigid motion:
    T_f(v + delta) = exp(delta xi) T_f(v),   xi = Ad(T_k) e_k   for the placement T_k of the factor
since a factor commutes with itself. So the twist xi (6,), linear part first, is the exact derivative of every placement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness import se3
from harness.se3 import Array

Mask: TypeAlias = NDArray[np.bool_]

AXES = {"x": 0, "y": 1, "z": 2}


class Parameter(NamedTuple):
    """A number of a description.

    owner: whose it is: a joint's name, `base` or `tool`.
    name: which number: `d`, `origin x`, ...
    unit: `m` or `rad`.
    """

    owner: str
    name: str
    unit: Literal["m", "rad"]


@dataclass(frozen=True, kw_only=True)
class Factor:
    """A turn about an axis, or a move along it, by value + row . q; or a constant transform.

    parent: index of the factor before it; -1 for the base frame.
    turns: whether it turns; else it moves.
    axis: `x`, `y` or `z`.
    value: the constant amount [rad or m].
    row: by how much it changes with each joint, (n,); None if no joint changes it.
    parameter: the number of the description that `value` is; None if it is none.
    sign: -1 if the factor is the inverse of what the parameter describes, as for a URDF joint passed from child to parent.
    T: the constant transform (4, 4); None for a turn or a move.
    """

    parent: int
    turns: bool = False
    axis: str = "z"
    value: float = 0.0
    row: tuple[float, ...] | None = None
    parameter: Parameter | None = None
    sign: float = 1.0
    T: Array | None = None

    @property
    def idle(self) -> bool:
        """Whether it changes nothing: a turn or a move by zero."""
        return self.T is None and self.row is None and self.value == 0.0


@dataclass(frozen=True)
class Mechanism:
    """A tree of factors.

    joints, prismatic: name of each joint, and whether it slides.
    factors: the factors; parents come before their children.
    frames: for each frame the index of the factor that ends at it; -1 for the base frame.
    """

    joints: tuple[str, ...]
    prismatic: tuple[bool, ...]
    factors: tuple[Factor, ...]
    frames: Mapping[str, int]

    def placements(self, q: Array, names: Sequence[str] | None = None) -> Array:
        """Placements in the base frame, (N, F, 4, 4) [m].

        q: configurations (N, n) [rad or m].
        names: the F frames; None for all, in the order of `frames`.
        """
        ends = [self.frames[name] for name in (self.frames if names is None else names)]
        kept, last = set(ends), {factor.parent: k for k, factor in enumerate(self.factors)}
        T: dict[int, Array] = {-1: np.tile(np.eye(4), (len(q), 1, 1))}
        for k, factor in enumerate(self.factors):
            before = T[factor.parent]
            T[k] = before if factor.idle else _step(before, factor, q)
            if last[factor.parent] == k and factor.parent not in kept:
                del T[factor.parent]  # a chain of a thousand joints has ten thousand factors
        return np.moveaxis(np.stack([T[end] for end in ends]), 0, 1) if ends else np.empty((len(q), 0, 4, 4))

    def _all(self, q: Array) -> Array:
        """Placement of the end of every factor, the base first: (len(factors) + 1, N, 4, 4)."""
        T = np.empty((len(self.factors) + 1, len(q), 4, 4))
        T[0] = np.eye(4)
        for k, factor in enumerate(self.factors, start=1):
            before = T[factor.parent + 1]
            T[k] = before if factor.idle else _step(before, factor, q)
        return T

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter, in the order of the factors."""
        return tuple(dict.fromkeys(f.parameter for f in self.factors if f.parameter is not None))

    def twists(self, q: Array, names: Sequence[str]) -> tuple[Array, Array, Mask]:
        """Placements of the named frames (N, F, 4, 4), the twist of each parameter (K, N, 6), and the frames it moves (K, F)."""
        T = self._all(q)
        xi = np.zeros((len(self.parameters), len(q), 6))
        moves = np.zeros((len(self.parameters), len(names)), dtype=bool)
        slot = {parameter: k for k, parameter in enumerate(self.parameters)}
        above = [self._above(self.frames[name]) for name in names]
        for index, factor in enumerate(self.factors):
            if factor.parameter is None:
                continue
            k, before = slot[factor.parameter], T[factor.parent + 1]
            axis = before[:, :3, AXES[factor.axis]] * factor.sign
            if factor.turns:
                xi[k, :, :3], xi[k, :, 3:] = np.cross(before[:, :3, 3], axis), axis
            else:
                xi[k, :, :3] = axis
            moves[k] |= [index in factors for factors in above]
        at = [self.frames[name] + 1 for name in names]
        return np.moveaxis(T[at], 0, 1), xi, moves

    def _above(self, end: int) -> set[int]:
        """A factor and all before it on the way from the base; the base, index -1, has none."""
        out = set()
        while end >= 0:
            out.add(end)
            end = self.factors[end].parent
        return out

    def value(self, parameter: Parameter) -> float:
        """The parameter's value [m or rad]."""
        factor = next(f for f in self.factors if f.parameter == parameter)
        return factor.sign * factor.value

    def edited(self, edit: Callable[[Factor], Factor]) -> Mechanism:
        """The mechanism with every factor replaced."""
        return replace(self, factors=tuple(edit(factor) for factor in self.factors))

    def shifted(self, changes: Mapping[Parameter, float]) -> Mechanism:
        """Parameters changed by so much [m or rad]."""

        def edit(f: Factor) -> Factor:
            delta = changes.get(f.parameter, 0.0) if f.parameter else 0.0
            return replace(f, value=f.value + f.sign * delta) if delta else f

        return self.edited(edit)

    def driven(self, P: Array) -> Mechanism:
        """The mechanism asked at P q instead of q. P: (n, n)."""
        return self.edited(lambda f: f if f.row is None else replace(f, row=tuple(np.dot(f.row, P))))

    def ended(self, offsets: Mapping[str, Array]) -> Mechanism:
        """The mechanism with frames moved by constant transforms. offsets: for each such frame the transform (4, 4)."""
        factors, frames = list(self.factors), dict(self.frames)
        for name, Y in offsets.items():
            factors.append(Factor(parent=frames[name], T=Y))
            frames[name] = len(factors) - 1
        return replace(self, factors=tuple(factors), frames=frames)


def _step(before: Array, factor: Factor, q: Array) -> Array:
    """Placements (N, 4, 4) of the factor's end, from those of its start. Only two columns or the origin change."""
    if factor.T is not None:
        return np.asarray(before @ factor.T)
    after = before.copy()
    k = AXES[factor.axis]
    amount = np.full(len(q), factor.value) if factor.row is None else q @ np.array(factor.row) + factor.value
    if not factor.turns:
        after[:, :3, 3] += before[:, :3, k] * amount[:, None]
        return after
    i, j = (k + 1) % 3, (k + 2) % 3
    if factor.row is None:
        s, c = se3.sincos(factor.value)
        after[:, :3, i] = before[:, :3, i] * c + before[:, :3, j] * s
        after[:, :3, j] = before[:, :3, j] * c - before[:, :3, i] * s
        return after
    s_, c_ = np.sin(amount)[:, None], np.cos(amount)[:, None]
    after[:, :3, i] = before[:, :3, i] * c_ + before[:, :3, j] * s_
    after[:, :3, j] = before[:, :3, j] * c_ - before[:, :3, i] * s_
    return after
