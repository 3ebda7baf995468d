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

from harness.theorem.balls import direction, precision
from harness.theorem.chain import Chains, Path, Step
from harness.theorem.polynomial import Polynomial, Terms, subtract
from harness.theorem.scales import scales_of

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


def equal(a: Chains, b: Chains) -> dict[str, bool | None]:
    """For each frame that both have, whether both are the same function; None where the numbers do not let it be decided."""
    scales = scales_of((a, b))
    return {name: _equal((a.paths[name], b.paths[name]), scales) for name in a.paths if name in b.paths}


def _equal(paths: tuple[Path, Path], scales: tuple[int, ...]) -> bool | None:
    if any(sum(step.turns and step.moves for step in path) > MOST_JOINTS for path in paths):
        return None
    field = field_of(paths)
    if field is None or field.bits > MOST_BITS:
        return None
    with precision(field.bits + 4 * MARGIN):
        separation = flint.arb(2) ** -field.bits
        one, other = (_terms(path, scales) for path in paths)
        numbers = [x for terms in map(subtract, one, other) for values in terms.values() for x in values]
        if all(x.abs_upper() < separation for x in numbers):
            return True
        return False if any(x.abs_lower() > 0 for x in numbers) else None


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
