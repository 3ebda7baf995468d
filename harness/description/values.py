"""Numbers and transforms as model files write them, and the constants people truncate.

`pi`, `-pi/2`, `3*pi/4` are accepted so that pi is never truncated on paper; every other expression is refused.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from harness import se3

# What a description can hold. Larger numbers are slips, and overflow as soon as they are multiplied.
LARGEST_LENGTH = 1e9  # [m]
LARGEST_ANGLE = 1e6  # [rad]

_PI = re.compile(r"(?P<sign>[+-]?)\s*(?:(?P<times>[1-9]\d*)\s*\*\s*)?pi(?:\s*/\s*(?P<over>[1-9]\d*))?")


def parse_number(value: object) -> float:
    """A finite float from a number or a text such as `0.089159`, `-pi/2`.

    Raises ValueError saying what was expected; angles [rad], lengths [m] are the caller's business.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"expected a number or a multiple of pi, got {value!r}")
    if isinstance(value, str):
        text = value.strip()
        if match := _PI.fullmatch(text):
            times, over = int(match["times"] or 1), int(match["over"] or 1)
            return (-1.0 if match["sign"] == "-" else 1.0) * times * math.pi / over
        try:
            number = float(text)
        except ValueError:
            raise ValueError(f"expected a number or a multiple of pi such as 'pi/2' or '3*pi/4', got {value!r}") from None
    else:
        number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"expected a finite number, got {value!r}")
    return number


Number = Annotated[float, BeforeValidator(parse_number)]
Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]


class Strict(BaseModel):
    """Base of every table in a model file: unknown keys are errors, nothing is coerced."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Transform(Strict):
    """A constant transform in a file: `xyz` [m] and `rpy` [rad], both optional, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz: Vector3 = [0.0, 0.0, 0.0]
    rpy: Vector3 = [0.0, 0.0, 0.0]

    @model_validator(mode="before")
    @classmethod
    def _not_empty(cls, data: Any) -> Any:
        if isinstance(data, dict) and not data:
            raise ValueError("expected xyz, rpy or both, got an empty table")
        return data

    def matrix(self) -> se3.Array:
        """The transform as (4, 4)."""
        return se3.from_xyz_rpy(self.xyz, self.rpy)


@dataclass(frozen=True)
class Truncation:
    """A written number that is a shortened multiple of pi: its text, the multiple's name, and the error [rad]."""

    text: str
    exact: str
    error: float


def find_truncation(text: str) -> Truncation | None:
    """Recognise `1.5708`, `3.14159265359`, ... : agrees with k*pi/m to its last digit, yet is not that double.

    Only decimals with enough digits to be no coincidence count: two for pi and pi/2, four for the finer fractions.
    """
    text = text.strip()
    digits = re.fullmatch(r"[+-]?\d*\.(\d+)", text)
    if digits is None or float(text) == 0.0:
        return None
    places, value = len(digits[1]), float(text)
    for over, least_places in ((1, 2), (2, 2), (4, 4), (3, 4), (6, 4)):
        times = round(value / (math.pi / over))
        exact = times * math.pi / over
        if times == 0 or abs(times) > 2 * over or places < least_places:
            continue
        error = abs(value - exact)
        if error <= 2 * math.ulp(exact):
            return None
        if error <= 1.001 * 10.0**-places:
            head = "-" if times < 0 else ""
            count = f"{abs(times)}*pi" if abs(times) != 1 else "pi"
            return Truncation(text, f"{head}{count}" + (f"/{over}" if over > 1 else ""), error)
    return None
