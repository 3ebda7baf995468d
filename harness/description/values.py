"""Numbers and transforms as model files write them, and the constants people truncate.

`pi`, `-pi/2`, `3*pi/4` are accepted so that pi is never truncated on paper; every other expression is refused.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from harness import se3
from harness.description.written import LONGEST_NUMBER, decimal, is_decimal, multiple_of_pi
from harness.errors import ModelFileError

# What a description can hold. Beyond these, float64 has no micrometre left, and sums and products overflow.
LARGEST_LENGTH = 1e9  # [m]
LARGEST_ANGLE = 1e6  # [rad]
LARGEST_NUMBER = 1e9  # of anything else, and of what may be either
LONGEST_NAME = 1000  # characters
LONGEST_TEXT = 100_000  # characters

_PI = re.compile(r"(?P<sign>[+-]?)\s*(?:(?P<times>[1-9]\d*)\s*\*\s*)?pi(?:\s*/\s*(?P<over>[1-9]\d*))?")
_NOT_FINITE = re.compile(r"[+-]?(?:inf|infinity|nan)", re.IGNORECASE)
_SHOWN = 60  # characters of a value in a message


def shown(value: object) -> str:
    """A value for a message: as Python writes it, cut short if it is long. Integers that cannot be written are counted."""
    if isinstance(value, int) and abs(value) >= 10**_SHOWN:
        digits = int(value.bit_length() * math.log10(2)) + 1
        return f"an integer of about {digits} digits"
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of more than 4300 digits inside a list; a list too deep
        return f"a {type(value).__name__} that is too large to be shown"
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}... ({len(text)} characters)"


def parse_number(value: object, largest: float = LARGEST_NUMBER, unit: str = "") -> float:
    """A finite float from a number or a text such as `0.089159`, `-pi/2`.

    Args:
        value: what was written.
        largest: largest size that is accepted.
        unit: its unit, for the message.

    Raises:
        ValueError: it is none, or too large. The text says what was expected.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"expected a number or a multiple of pi, got {shown(value)}")
    try:
        number = _from_text(value.strip()) if isinstance(value, str) else float(value)
    except OverflowError:  # an integer beyond float64
        raise ValueError(_too_large(value, largest, unit)) from None
    if not math.isfinite(number):
        raise ValueError(f"expected a finite number, got {shown(value)}")
    if abs(number) > largest:
        raise ValueError(_too_large(value, largest, unit))
    return number


def _too_large(value: object, largest: float, unit: str) -> str:
    return f"expected at most {largest:g}{unit and ' '}{unit} in size, got {shown(value)}"


def _from_text(text: str) -> float:
    """A float from text; it may be infinite. Raises ValueError."""
    if len(text) > LONGEST_NUMBER:
        raise ValueError(f"expected a number of at most {LONGEST_NUMBER} characters, got {len(text)}")
    if match := _PI.fullmatch(text):
        times = Fraction(int(match["times"] or 1), int(match["over"] or 1))
        return multiple_of_pi(-times if match["sign"] == "-" else times)
    if is_decimal(text):
        return decimal(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text)
    raise ValueError(f"expected a number or a multiple of pi such as 'pi/2' or '3*pi/4', got {shown(text)}")


def checked_angle(value: float, path: Path, key: str) -> float:
    """An angle [rad] whose unit only other files tell: the angle itself. Raises ModelFileError if it is too large."""
    try:
        return parse_number(value, LARGEST_ANGLE, "rad")
    except ValueError as error:
        raise ModelFileError(str(error), where=path, key=key) from None


def check_text(text: str, longest: int = LONGEST_TEXT) -> str:
    """The text itself. Raises ValueError if it is too long, or holds a NUL character, which no path and no URDF can hold."""
    if len(text) > longest:
        raise ValueError(f"expected at most {longest} characters, got {len(text)}")
    if "\0" in text:
        raise ValueError(f"expected a text without NUL characters, got {shown(text)}")
    return text


def check_names(names: str | list[str]) -> str | list[str]:
    """One name or several, themselves. Raises ValueError if one cannot be a name."""
    for name in [names] if isinstance(names, str) else names:
        check_text(name, LONGEST_NAME)
    return names


def check_label(value: int | str) -> int | str:
    """A DH frame's label itself. Raises ValueError if it cannot be one."""
    if isinstance(value, int) and abs(value) > LARGEST_NUMBER:
        raise ValueError(f"expected base, a small number, or tool, got {shown(value)}")
    return value if isinstance(value, int) else check_text(value, LONGEST_NAME)


Number = Annotated[float, BeforeValidator(parse_number)]
Length = Annotated[float, BeforeValidator(partial(parse_number, largest=LARGEST_LENGTH, unit="m"))]
Angle = Annotated[float, BeforeValidator(partial(parse_number, largest=LARGEST_ANGLE, unit="rad"))]
Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]
Lengths3 = Annotated[list[Length], Field(min_length=3, max_length=3)]
Angles3 = Annotated[list[Angle], Field(min_length=3, max_length=3)]
Text = Annotated[str, AfterValidator(check_text)]
Name = Annotated[str, AfterValidator(partial(check_text, longest=LONGEST_NAME))]
Names = Annotated[str | list[str], AfterValidator(check_names)]
Label = Annotated[int | str, AfterValidator(check_label)]


class Strict(BaseModel):
    """Base of every table in a model file: unknown keys are errors, nothing is coerced."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Transform(Strict):
    """A constant transform in a file: `xyz` [m] and `rpy` [rad], both optional, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz: Lengths3 = [0.0, 0.0, 0.0]
    rpy: Angles3 = [0.0, 0.0, 0.0]

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
