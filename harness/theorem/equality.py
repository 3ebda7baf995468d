"""Whether two descriptions are one function: decided, not measured, where their numbers allow it.

If all lengths are rational and all angles rational multiples of pi, every coefficient of the difference is an algebraic number c
of a real cyclotomic field of degree d, with Delta c an algebraic integer. Its conjugates are coefficients of chains with the same
lengths and other angles, so none is above 2 B, B the sum of the lengths or 1. The product of the conjugates of Delta c is a whole
number. So c = 0, or
    |c| >= 1 / (Delta (2 B Delta)^(d - 1)).
A ball that is smaller than that is zero. docs/theory.md has the details.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import flint
import numpy as np

from harness.theorem.balls import direction, precision
from harness.theorem.chain import Chains, Path, Step
from harness.theorem.pair import Pair
from harness.theorem.polynomial import Polynomial, Terms, subtract

MOST_BITS = 16_000
MOST_JOINTS = 8  # that turn: 3281 terms at a high precision
MARGIN = 64  # bits of a ball's radius below the separation


@dataclass(frozen=True)
class Field:
    """Where the coefficients of a difference lie.

    Attributes:
        degree: d, of the real cyclotomic field.
        denominator: Delta.
        size: 2 B.
    """

    degree: int
    denominator: int
    size: Fraction

    @property
    def bits(self) -> int:
        """log2 of 1 / separation, rounded up."""
        top = math.ceil(self.size)
        return self.degree * (self.denominator.bit_length() + top.bit_length() + 1)


def equal(a: Chains, b: Chains) -> dict[str, bool]:
    """For each frame that both have, whether both are the same function: False if they are not, or if it cannot be decided."""
    names = [name for name in a.paths if name in b.paths]
    fields = {name: field_of((a.paths[name], b.paths[name])) for name in names}
    decidable = {name: field for name, field in fields.items() if field is not None and field.bits <= MOST_BITS}
    if not decidable:
        return dict.fromkeys(names, False)
    bits = max(field.bits for field in decidable.values())
    with precision(bits + 4 * MARGIN):
        both = [c.only(decidable) for c in (a, b)]
        pair = Pair.of(both[0], both[1], np.zeros((len(a.joints), 2)))
        return {name: name in decidable and _equal(pair, both, name, decidable[name]) for name in names}


def _equal(pair: Pair, both: list[Chains], name: str, field: Field) -> bool:
    """Joint by joint, by constants, if both have the same joints; else both chains are multiplied out."""
    separation = flint.arb(2) ** -field.bits
    end = pair.deviations[name]
    if end is not None:
        E, joints = end.E, len(end.residuals)
        left = [x for residual in end.residuals for x in residual.entries]
        left += [E[i, j] - int(i == j) for i in range(3) for j in range(4)]
        # All together they bound every coefficient, carried by the lengths of the chain at most.
        return all(x.abs_upper() * (64 * (joints + 1) * math.ceil(field.size + 1)) < separation for x in left)
    paths = [chains.paths[name] for chains in both]
    if any(sum(step.turns and step.moves for step in path) > MOST_JOINTS for path in paths):
        return False
    one, other = (_terms(path, pair.scales) for path in paths)
    numbers = [x for terms in map(subtract, one, other) for values in terms.values() for x in values]
    return all(x.abs_upper() < separation for x in numbers)


def _terms(path: Path, scales: tuple[int, ...]) -> tuple[Terms, Terms]:
    polynomial = Polynomial.one(scales)
    for step in path:
        polynomial.then(step)
    return polynomial.finished()


def field_of(paths: tuple[Path, Path]) -> Field | None:
    """Where the coefficients of two chains' difference lie; None if they are no such numbers."""
    steps = [step for path in paths for step in path]
    if not all(_is_exact(step) for step in steps):
        return None
    order = math.lcm(4, *(2 * step.amount.of_pi.denominator for step in steps if step.turns))
    lengths = [abs(step.amount.rational) for step in steps if not step.turns]
    factors = [x for step in steps if not step.turns for x in step.row]
    # Twice a cosine is an algebraic integer: every turn that is not by right angles brings one factor 1/2.
    halves = max(sum(_halves(step) for step in path) for path in paths)
    scale = math.lcm(1, *(x.denominator for x in (*lengths, *factors)))
    size = 2 * max(Fraction(1), sum(lengths, Fraction(0)) + sum((abs(x) for x in factors), Fraction(0)))
    return Field(_totient(order) // 2, scale * 2**halves, size)


def _is_exact(step: Step) -> bool:
    if step.T is not None or direction(step.axis)[0] < 0:
        return False
    return not (step.amount.rational if step.turns else step.amount.of_pi)


def _halves(step: Step) -> int:
    if not step.turns:
        return 0
    return int(step.moves) + int(step.amount.of_pi.denominator > 2)


def _totient(n: int) -> int:
    """Euler's function."""
    return int(flint.fmpz(n).euler_phi())
