"""Which noise floor a discrepancy is the size of, so that a tolerance means something.

Sizes measured on real files (1 m arms): float64 FK 1e-15 to 1e-14; a URDF that writes pi/2 as 1.57079632679 5e-12, as
1.570796327 1e-10 to 6e-10; float32 parameters 1e-8 to 1e-7; 1.5708 4e-6 and 3.1416 7e-6 m per m.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NoiseClass:
    """A band of discrepancies: up to `limit`, in m per m of reach or in rad."""

    key: str
    limit: float
    text: str


CLASSES = (
    NoiseClass("float64", 1e-13, "float64 rounding"),
    NoiseClass("pi-12-digits", 3e-11, "pi written with 12 digits (1.57079632679)"),
    NoiseClass("pi-10-digits", 3e-9, "pi written with 10 digits (1.570796327)"),
    NoiseClass("float32", 5e-7, "float32 parameters"),
    NoiseClass("pi-5-digits", 5e-5, "pi written with 5 digits (1.5708, 3.1416)"),
    NoiseClass("model", float("inf"), "above every noise floor: the models differ"),
)


def classify(position: float, rotation: float, reach: float) -> NoiseClass:
    """Class of a discrepancy of `position` [m] and `rotation` [rad] on an arm of this reach [m], the larger of the two."""
    size = max(position / max(reach, 1e-3), rotation)
    return next(c for c in CLASSES if size <= c.limit)
