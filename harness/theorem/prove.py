"""How far two descriptions can be apart, at every configuration: a theorem about their numbers.

Three bounds hold, and the smallest counts. `joints`: joint by joint, by constants. `coefficients`: both chains multiplied out,
from the sizes of what is left; joints before the first difference drop out. `grid`: the same polynomial on a fine grid.
docs/theory.md has the proofs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from harness.se3 import Array, chord_angle
from harness.theorem.balls import PRECISION, precision
from harness.theorem.chain import Chains
from harness.theorem.coefficients import Coefficients
from harness.theorem.lower import At
from harness.theorem.pair import Pair, sliding
from harness.theorem.rotation import rotation_difference
from harness.theorem.sharp import Top, highest, random_starts, sharpened

Method: TypeAlias = Literal["constant", "joints", "coefficients", "grid"]

RATIO, EXACT = 1.1, 1.001


@dataclass(frozen=True, kw_only=True)
class FrameBound:
    """What is proven of one frame.

    Attributes:
        position, rotation: no configuration has a larger discrepancy [m], [rad].
        position_found, rotation_found: some configuration has at least this one; evaluated in ball arithmetic.
        slope: by how much the position's discrepancy can grow with each metre of slide, within the range or beyond [m/m];
            None for chains of many joints that are not the same.
        method: how the position's bound was found; `constant` if the discrepancy is the same at every configuration.
        worst: the configurations of the two, (2, n) [rad or m].
    """

    position: float
    rotation: float
    position_found: float
    rotation_found: float
    slope: float | None
    method: Method
    worst: Array


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How hard to look for a sharp bound.

    Attributes:
        above: bounds below are not sharpened [m, rad].
        nodes: of the largest grid; 0: none.
    """

    above: float = 1e-9
    nodes: int = 400_000


def prove(a: Chains, b: Chains, ranges: Array, effort: Effort | None = None, bits: int = PRECISION) -> dict[str, FrameBound]:
    """Bounds on the discrepancy of two descriptions at each frame that both have.

    A frame is left out if a joint slides something before it and has no range, or if its chains have too many terms.

    Args:
        a: one description.
        b: the other, with the same joints.
        ranges: lower and upper end of each joint, (n, 2) [m]; only those of joints that slide something
            count, and all others are equal ends.
        effort: how hard to look for a sharp bound.
        bits: precision of the balls.
    """
    with precision(bits):
        pair = Pair.of(a, b, np.asarray(ranges, dtype=float))
        names = [name for name in pair.names if _is_bounded(pair, name)]
        proven = {name: _frame(pair, name, effort or Effort()) for name in names}
        return {name: bound for name, bound in proven.items() if math.isfinite(bound.position + bound.rotation)}


def _is_bounded(pair: Pair, name: str) -> bool:
    """Whether every joint that slides something on the way to a frame has a range."""
    slides = sliding(pair.a[name]) | sliding(pair.b[name])
    return all(pair.ranges[j, 0] < pair.ranges[j, 1] for j in slides)


@dataclass(frozen=True)
class _Part:
    """One of both bounds: the position's, or the rotation's as a chord."""

    upper: float
    found: Top
    method: Method

    @property
    def is_exact(self) -> bool:
        """Whether the bound is what was found, to a thousandth."""
        return self.method == "constant" or self.upper <= EXACT * self.found.value

    @property
    def is_sharp(self) -> bool:
        """Whether the bound is no more than a tenth above what was found."""
        return self.method == "constant" or self.upper <= RATIO * self.found.value


def _frame(pair: Pair, name: str, effort: Effort) -> FrameBound:
    rough, constant = pair.by_joints(name)
    seen = [(at.q, at.seen(pair.a[name], pair.b[name])) for at in pair.tries]
    parts = []
    for i in range(2):
        q, largest = max(seen, key=lambda entry, i=i: entry[1][i])  # type: ignore[misc]
        parts.append(_Part(rough[i], Top(largest[i], q), "constant" if constant[i] else "joints"))
    functions = None if all(part.is_exact for part in parts) else pair.multiplied_out(name)
    if functions is not None:
        parts = [part if part.is_exact else _better(part, f) for part, f in zip(parts, functions, strict=True)]
        if effort.nodes:
            parts = [_sharp(pair, name, part, f, effort) for part, f in zip(parts, (functions[0], None), strict=True)]
    seen += [(q, At(q).seen(pair.a[name], pair.b[name])) for q in (pair.inside(part.found.q) for part in parts)]
    best = [max(seen, key=lambda entry, i=i: entry[1][i]) for i in range(2)]  # type: ignore[misc]
    if best[0][1].position > parts[0].upper or best[1][1].chord > parts[1].upper:
        raise ArithmeticError(f"a bound at {name!r} lies below what was found")  # a fault of the proof: never told as proven
    return FrameBound(
        position=parts[0].upper,
        rotation=float(chord_angle(np.array(parts[1].upper))),
        position_found=best[0][1].position,
        rotation_found=float(chord_angle(np.array(best[1][1].chord))),
        slope=_slope(pair, name, functions),
        method=parts[0].method,
        worst=np.stack([q for q, _ in best]),
    )


def _slope(pair: Pair, name: str, functions: tuple[Coefficients, Coefficients] | None) -> float | None:
    """By constants where both have the same joints, which leaves nothing out; else from the coefficients."""
    by_joints = pair.slope(name)
    return by_joints if by_joints is not None else functions and functions[0].slope()


def _better(part: _Part, function: Coefficients) -> _Part:
    """With the bound that the coefficients give, and the largest value that climbing finds."""
    top = max(part.found, highest(function, random_starts(function)), key=lambda t: t.value)
    bound = function.bound()
    return _Part(bound, top, "coefficients") if bound < part.upper else replace(part, found=top)


def _sharp(pair: Pair, name: str, part: _Part, function: Coefficients | None, effort: Effort) -> _Part:
    """With the bound of the grid, if the one so far is large and loose. `function`: None for the rotation."""
    if part.upper <= effort.above or part.is_sharp:
        return part
    if function is None:
        function = rotation_difference(pair, name)
        if function is None:
            return part
        part = _better(part, function)
        if part.is_sharp:
            return part
    bound, top = sharpened(function, part.found, effort.nodes)
    return _Part(bound, top, "grid") if bound < part.upper else replace(part, found=top)
