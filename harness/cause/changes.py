"""What a repair changes, in words and numbers, and which of several equivalent wordings is the plainest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from harness.kinematics.mechanism import Parameter

# a: the reference's description; b: the source's; between: the mapping; source: what the source does with its description.
Unit: TypeAlias = Literal["m", "rad", ""]
Side: TypeAlias = Literal["a", "b", "between", "source"]

GAUGE = ("move ", "turn ")  # the numbers of a base or a tool that no file has

# The first is said first. Parameters are ranked by `_parameter_rank`.
_PLAIN = (
    "base frame", "tool left out", "frame", "mimic", "axis default", "axis length", "truncated pi", "float32", "convention",
    "reversed", "inverse", "degrees", "millimetres", "sign", "order", "coupling", "axis",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Change:
    """One change that a repair makes.

    kind: `parameter`, or what the catalogue calls it.
    side: what is changed.
    subject: the joint or frame, or `base`, `tool`.
    parameter: which number.
    size: by how much the number is changed.
    before: its value on file.
    unit: of both, `m` or `rad`; empty if the change is none of a number.
    text: the change in words.
    """

    kind: str
    side: Side
    subject: str = ""
    parameter: str = ""
    size: float = 0.0
    before: float = 0.0
    unit: Unit = ""
    text: str = ""

    @property
    def key(self) -> tuple[str, str, str, str, float]:
        """What is changed, whatever the size of a number's change."""
        return self.kind, self.side, self.subject, self.parameter, 0.0 if self.kind == "parameter" else self.size

    @property
    def rank(self) -> tuple[float, str, str]:
        """Order of plainness: smaller is plainer."""
        plain = _PLAIN.index(self.kind) if self.kind in _PLAIN else len(_PLAIN) + self._parameter_rank()
        return plain, self.subject, self.parameter

    def _parameter_rank(self) -> float:
        """Quarter turns of base or tool, then numbers on file, those that were not zero first, then other bases and tools."""
        if self.parameter.startswith(GAUGE):
            quarters = self.size / (math.pi / 2)
            return 0.0 if self.unit == "rad" and abs(quarters - round(quarters)) < 1e-6 else 4.0
        likely = 1.0 if self.before != 0.0 else 2.0
        return likely + (0.0 if self.side == "a" else 0.5)


def of_parameter(
    side: Side, parameter: Parameter, size: float, before: float, label: str, wanted_by: str, resolution: float = 0.0
) -> Change:
    """The change of one number of a description.

    side, parameter: whose number, and which.
    size: by how much it is changed [m or rad].
    before: its value on file [m or rad].
    label: the description's name.
    wanted_by: who would then agree.
    resolution: digits below it are not printed: it is what the repair leaves [m, rad].
    """
    unit, digits = parameter.unit, min(12, max(3, math.floor(-math.log10(4.0 * resolution)))) if resolution > 0 else 12
    by = amount(round(size, digits), unit)
    if parameter.name.startswith(GAUGE):
        verb, axis = parameter.name.split()
        how = f"turned by {by} about {axis}" if verb == "turn" else f"moved by {by} along {axis}"
        text = f"{parameter.owner}: {wanted_by} has it {how}"
    else:
        here, there = value(before, unit, 12), value(before + size, unit, digits)
        # A table has no `origin z`: of a number of b it is said what would fit a, not that it stood there.
        other = f"{there} in {wanted_by}" if side == "a" else f"{there} would fit {wanted_by}"
        text = f"{parameter.name} of {parameter.owner}: {here} in {label}, {other} ({by})"
    return Change(
        kind="parameter",
        side=side,
        subject=parameter.owner,
        parameter=parameter.name,
        size=size,
        before=before,
        unit=unit,
        text=text,
    )


def amount(x: float, unit: str) -> str:
    """`+0.301 mm`, `-1 deg`; below a micrometre or a microradian in m and rad."""
    if unit == "m":
        return f"{x * 1e3:+.6g} mm" if abs(x) >= 1e-6 else f"{x:+.4g} m"
    return f"{math.degrees(x):+.6g} deg" if abs(x) >= 1e-6 else f"{x:+.4g} rad"


def value(x: float, unit: str, digits: int) -> str:
    """`0.089159 m`, `90 deg`: without whole turns, rounded to so many digits of a metre or radian."""
    if unit == "m":
        return f"{round(x, digits) + 0.0:.9g} m"
    return f"{round(math.degrees(math.remainder(x, 2.0 * math.pi)), max(1, digits - 2)) + 0.0:.9g} deg"
