"""Numbers as a person would have written them: pi and its simple fractions, lengths without the last digits' noise."""

from __future__ import annotations

import math

import numpy as np

from harness import se3

ANGLE_NOISE = 5e-10  # what a URDF with ten digits of pi leaves
LENGTH_NOISE = 2e-11


def tidy_angle(x: float) -> float:
    """The multiple of pi/12 within 5e-10 rad of `x`, else `x`; never -0."""
    exact = round(x / (math.pi / 12)) * math.pi / 12
    return (exact if abs(x - exact) < ANGLE_NOISE else x) + 0.0


def tidy_length(x: float) -> float:
    """`x` rounded to nine decimals if that moves it by less than 2e-11 m, else `x`; never -0."""
    rounded = round(x, 9)
    return (rounded if abs(x - rounded) < LENGTH_NOISE else x) + 0.0


def angle_text(x: float) -> str:
    """`pi/2`, `-3*pi/4`, `0`, or the shortest text that reads back as exactly `x`."""
    for over in (1, 2, 3, 4, 6, 12):
        times = round(x / (math.pi / over))
        if times != 0 and abs(times) <= 2 * over and x == times * math.pi / over and math.gcd(times, over) == 1:
            head = ("-" if times < 0 else "") + ("pi" if abs(times) == 1 else f"{abs(times)}*pi")
            return head + (f"/{over}" if over > 1 else "")
    return number_text(x)


def number_text(x: float) -> str:
    """The shortest text that reads back as exactly `x`; whole numbers without a point."""
    return str(int(x)) if x == int(x) and abs(x) < 1e6 else repr(float(x))


def transform_toml(T: se3.Array) -> dict[str, str]:
    """`xyz` and `rpy` of a transform as TOML arrays, leaving out what is zero."""
    xyz = [tidy_length(float(x)) for x in T[:3, 3]]
    rpy = [tidy_angle(x) for x in se3.to_rpy(T)]
    out = {}
    if any(xyz):
        out["xyz"] = "[" + ", ".join(number_text(x) for x in xyz) + "]"
    if any(rpy):
        texts = [angle_text(x) for x in rpy]
        out["rpy"] = "[" + ", ".join(f'"{t}"' if "pi" in t else t for t in texts) + "]"
    return out


def tidy_transform(T: se3.Array) -> se3.Array:
    """The transform that `transform_toml` writes."""
    return se3.from_xyz_rpy([tidy_length(float(x)) for x in T[:3, 3]], [tidy_angle(x) for x in se3.to_rpy(T)])


def is_identity(T: se3.Array) -> bool:
    """Whether nothing is left of a transform once it is tidied."""
    return bool(np.array_equal(tidy_transform(T), np.eye(4)))
