"""Numbers as they are written: a float64 to compute with, and the exact number behind it.

`0.089159` is a rational number, `pi/2` a rational multiple of pi; the float64 next to either is neither. What is proven of
two descriptions speaks of the exact numbers.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from typing import NamedTuple

# A decimal exponent beyond these is read as the float64 next to it: zero, or too large for a description.
LARGEST_EXPONENT = 400
LONGEST_NUMBER = 1_000  # characters
PARTS = (12, 16, 180)  # of half a turn

_DECIMAL = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE](?P<exponent>[+-]?[0-9]+))?")


class Exact(NamedTuple):
    """The number `rational + of_pi * pi`."""

    rational: Fraction = Fraction(0)
    of_pi: Fraction = Fraction(0)

    def scaled(self, factor: Fraction) -> Exact:
        """The number times a rational."""
        return Exact(self.rational * factor, self.of_pi * factor)

    def plus(self, other: Exact) -> Exact:
        """The sum of two."""
        return Exact(self.rational + other.rational, self.of_pi + other.of_pi)

    @property
    def is_zero(self) -> bool:
        """Whether it is 0: pi is irrational, so only if both parts are."""
        return not self.rational and not self.of_pi


ZERO = Exact()


class Written(float):
    """A float64 that knows the exact number it was written as.

    Arithmetic gives a plain float again: what was computed was written nowhere.

    Attributes:
        exact: the number as written.
    """

    exact: Exact

    def __new__(cls, value: float, exact: Exact) -> Written:
        """`value` is the float64 next to `exact`."""
        number = super().__new__(cls, value)
        number.exact = exact
        return number

    def __getnewargs__(self) -> tuple[float, Exact]:  # type: ignore[override]
        """For copies and pickles."""
        return float(self), self.exact


def is_decimal(text: str) -> bool:
    """Whether a text is a decimal number as every format here writes one: no `1_0`, no `inf`, no digits of other scripts."""
    return len(text) <= LONGEST_NUMBER and _DECIMAL.fullmatch(text) is not None


def decimal(text: str) -> float:
    """The float64 next to a decimal, with the exact number.

    Raises:
        ValueError: it is no decimal.
    """
    match = _DECIMAL.fullmatch(text) if len(text) <= LONGEST_NUMBER else None
    if match is None:
        raise ValueError(f"expected a decimal number, got {text[:60]!r}")
    value = float(text)
    if not math.isfinite(value) or len(match["exponent"] or "") > 5 or abs(int(match["exponent"] or 0)) > LARGEST_EXPONENT:
        return value
    return Written(value, Exact(Fraction(text)))


def multiple_of_pi(times: Fraction) -> float:
    """The float64 next to a rational multiple of pi, with the exact number."""
    # As `k * pi / m` is computed elsewhere: the same float64 for the same text.
    return Written(float(times.numerator) * math.pi / float(times.denominator), Exact(of_pi=times))


def length_of(value: float) -> Exact:
    """The exact number behind a length or a factor: as written; a plain float64 is its shortest decimal."""
    return value.exact if isinstance(value, Written) else Exact(Fraction(repr(float(value))))


def angle_of(value: float) -> Exact:
    """The exact number behind an angle: as written.

    A plain float64 has lost its text. If it is the one next to a multiple of pi/16 or of a degree, up to four turns, it means
    that multiple: model files write `pi/2`, programs `math.pi / 2`. Any other is its shortest decimal.
    """
    if isinstance(value, Written):
        return value.exact
    for parts in PARTS:
        count = round(value / math.pi * parts)
        times = Fraction(count, parts)
        if 0 < abs(count) <= 8 * parts and value in (times.numerator * math.pi / times.denominator, count * (math.pi / parts)):
            return Exact(of_pi=times)
    return Exact(Fraction(repr(float(value))))
