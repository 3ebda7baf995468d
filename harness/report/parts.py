"""What every part of a document is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from harness.writing import LONGEST_ROBOT_NAME, RESERVED, ROBOT_NAME


def _not_reserved(name: str) -> str:
    """The name of a robot itself. Raises ValueError if a file of the reports' folder has it."""
    if name.lower() in RESERVED:
        raise ValueError(f"expected a name other than {', '.join(RESERVED)}")
    return name


NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, lt=2**63)]
Configuration = list[Finite]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Rotation = Annotated[list[Vector], Field(min_length=3, max_length=3)]
_Row = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Matrix = Annotated[list[_Row], Field(min_length=4, max_length=4)]
RobotName = Annotated[str, Field(pattern=ROBOT_NAME, max_length=LONGEST_ROBOT_NAME), AfterValidator(_not_reserved)]


class Part(BaseModel):
    """Base of all parts: immutable, no unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)
