"""The digits to which computed numbers are written: those that mean something.

Rounding errors of a placement are about 1e-16 m, and which ones they are depends on the processor. `harness.kernels` tells the
libraries to do the same on all of them; a library that cannot be told, or was imported before, does not. So a number is written
to what it means: a discrepancy by `discrepancy`, a proven bound by `upper_bound`, what is proven to occur by `lower_bound`, a
coordinate by `coordinate`. The types of
the report document do it. Of configurations whose discrepancies are written alike, the first is the worst one.

A number that lies between two written ones may still become either: see docs/theory.md.
"""

from __future__ import annotations

import math
from bisect import bisect

import numpy as np

from harness.se3 import Array

# Decimals of a discrepancy: below the first size, from there on, and above the second. Half a turn is resolved to 3e-8 rad only.
DECIMALS = (14, 13, 6)
CHANGES = (1e-12, 3.0)
COORDINATE = 12  # decimals of a coordinate, an angle, a parameter
MEASURED = 1e-13
ANCHOR = 10  # decimals of a placement beside which another one stands


def discrepancy(x: float) -> float:
    """A discrepancy [m, rad or 1], x >= 0, to the nearest 1e-14; from 1e-12 on 1e-13, from 3 on 1e-6. 0: rounding alone."""
    return round(x, DECIMALS[bisect(CHANGES, x)])


def as_fine_as(x: float, largest: float) -> float:
    """A mean of discrepancies, to the decimals of the largest of them: they are not known better."""
    return round(x, DECIMALS[bisect(CHANGES, largest)])


def upper_bound(x: float) -> float:
    """A proven bound [m or rad], x >= 0, to nine significant digits, upwards: it stays a bound."""
    return _significant(x, 9, up=True)


def lower_bound(x: float) -> float:
    """A discrepancy that is proven to occur [m or rad], x >= 0, to six significant digits, downwards."""
    return _significant(x, 6, up=False)


def measured_bounds(lower: float, upper: float) -> tuple[float, float]:
    """Both of a frame whose offset an engine has measured, to 1e-13 outwards: the offset is not known better."""
    if not math.isfinite(upper):
        return lower, upper
    low, high = (round(f(x / MEASURED) * MEASURED, 13) for f, x in ((math.floor, lower), (math.ceil, upper)))
    return low, high


def _significant(x: float, digits: int, up: bool) -> float:
    if not 1e-290 < x < math.inf:
        return x
    exponent = digits - 1 - math.floor(math.log10(x))
    written = float(f"{x:.{digits - 1}e}")
    if (written < x) if up else (written > x):
        written = float(f"{written + (1 if up else -1) * 10.0**-exponent:.{digits - 1}e}")
    return written


def first_of_largest(values: Array) -> int:
    """Index of the first of the largest values (N,): those that differ from the largest by less than 1e-9 of it count as it."""
    return int(np.argmax(values >= values.max() * (1.0 - 1e-9)))


def coordinate(x: float) -> float:
    """A coordinate, an angle, a parameter [m, rad or 1] to the nearest 1e-12."""
    return round(x, COORDINATE) + 0.0  # not -0.0


def anchored(reference: float, other: float) -> tuple[float, float]:
    """The same entry of two placements: the reference to the nearest 1e-10, the other one by its difference from it.

    So what is between them is written as finely as a discrepancy, and both do not depend on rounding.
    """
    written, apart = round(reference, ANCHOR) + 0.0, other - reference
    there = written + (discrepancy(apart) if apart >= 0.0 else -discrepancy(-apart))
    return written, round(there, DECIMALS[0]) + 0.0


def steps(values: Array) -> Array:
    """Discrepancies as `discrepancy` writes them, in units of 1e-14; of the same shape."""
    scale = decimal_scale(values)
    return np.asarray(np.rint(values * scale) * (10.0 ** DECIMALS[0] / scale))


def decimal_scale(values: Array) -> Array:
    """What makes a whole number of a discrepancy as it is written: 1e14, 1e13 or 1e6; of the same shape."""
    return np.asarray(10.0 ** np.array(DECIMALS)[np.searchsorted(CHANGES, values, side="right")])
