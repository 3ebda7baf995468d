"""What every part of a document is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from harness.digits import anchored, coordinate, discrepancy, lower_bound, upper_bound
from harness.writing import LONGEST_ROBOT_NAME, RESERVED, ROBOT_NAME


def _not_reserved(name: str) -> str:
    """The name of a robot itself. Raises ValueError if a file of the reports' folder has it."""
    if name.lower() in RESERVED:
        raise ValueError(f"expected a name other than {', '.join(RESERVED)}")
    return name


# Computed numbers, written to the digits that mean something.
Discrepancy = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(discrepancy)]
UpperBound = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(upper_bound)]
LowerBound = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(lower_bound)]
Coordinate = Annotated[float, Field(allow_inf_nan=False), AfterValidator(coordinate)]

# Numbers as somebody has written them, and those that are exact.
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, lt=2**63)]
Configuration = list[Finite]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Rotation = Annotated[list[Vector], Field(min_length=3, max_length=3)]
_Row = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
Matrix = Annotated[list[_Row], Field(min_length=4, max_length=4)]
_FineRow = Annotated[list[Finite], Field(min_length=4, max_length=4)]
FineMatrix = Annotated[list[_FineRow], Field(min_length=4, max_length=4)]  # one of two that stand side by side


def anchor(reference: list[list[float]], other: list[list[float]]) -> None:
    """Write two placements of one frame so that the difference between them is as fine as a discrepancy, in place."""
    for i, row in enumerate(reference):
        for j, entry in enumerate(row):
            row[j], other[i][j] = anchored(entry, other[i][j])


RobotName = Annotated[str, Field(pattern=ROBOT_NAME, max_length=LONGEST_ROBOT_NAME), AfterValidator(_not_reserved)]


class Part(BaseModel):
    """Base of all parts: immutable, no unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)
