"""model.toml as written: provenance, tolerances, sources, accepted deviations."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import Literal

from pydantic import Field, field_validator, model_validator

from harness.description.dh import Convention
from harness.description.values import Angle, Length, Name, Names, Number, Strict, Text, Transform
from harness.writing import LONGEST_ROBOT_NAME, RESERVED, ROBOT_NAME


class Provenance(Strict):
    """Where the numbers of dh.csv come from: document, page, date of the document, and a note."""

    document: Text = Field(min_length=1)
    page: Text = ""
    date: Text = ""
    note: Text = ""


class Tolerance(Strict):
    """Largest discrepancy that counts as agreement.

    Attributes:
        position: distance of origins [m].
        rotation: angle between orientations [rad].
    """

    position: Length = Field(gt=0)
    rotation: Angle = Field(gt=0)


class SourceEntry(Strict):
    """One `[[source]]`. Any source that runs must agree.

    Attributes:
        name: source name, such as `urdf:pinocchio`, or a name of the user's for a command.
        required: whether it must run.
        tolerance: its own tolerance, if it is not the model's.
        command: a program of the user's that speaks the worker protocol, run in the model's folder. `{model}` in it is that
            folder. It is given the URDF if the name begins with `urdf:`, else the DH table.
    """

    name: Name = Field(pattern=r"^[A-Za-z][^\s\"]*$")
    required: bool = True
    tolerance: Tolerance | None = None
    command: list[Text] | None = Field(default=None, min_length=1)

    @model_validator(mode="after")
    def _an_engine_or_a_command(self) -> SourceEntry:
        if self.command is None and ":" not in self.name:
            raise ValueError(f"expected the name of an engine such as dh:pinocchio, or a command, got {self.name!r} alone")
        return self


class AcceptedEntry(Strict):
    """One `[[accepted]]` deviation: the largest discrepancy of each of its sources at each of its frames.

    Attributes:
        source: one or more sources. A pattern such as `urdf:*` is allowed: what is wrong in the URDF is wrong in every engine.
        frame: one or more mapped frames.
        position: largest discrepancy [m]; 0 means that the position must be within tolerance.
        rotation: largest discrepancy [rad]; 0 means that the rotation must be within tolerance.
        within: how far `position` and `rotation` may be off, as a part of themselves.
        cause: the numbers that explain it: joint, then parameter, then the change that repairs it [m or rad]. An explanation
            by anything else, or by more, means that the deviation has changed.
        reason: why it is accepted.
    """

    source: Names
    frame: Names
    position: Length = Field(default=0.0, ge=0)
    rotation: Angle = Field(default=0.0, ge=0)
    within: Number = Field(default=0.02, gt=0, lt=1)
    cause: dict[Name, dict[Name, Number]] = {}
    reason: Text = Field(min_length=1)

    @model_validator(mode="after")
    def _deviates(self) -> AcceptedEntry:
        if self.position == 0.0 and self.rotation == 0.0:
            raise ValueError("expected the size of the deviation: position, rotation or both")
        return self

    @property
    def sources(self) -> list[str]:
        """The sources as a list."""
        return [self.source] if isinstance(self.source, str) else self.source

    def covers(self, source: str) -> bool:
        """Whether this entry is about the source."""
        return any(fnmatchcase(source, pattern) for pattern in self.sources)

    @property
    def frames(self) -> list[str]:
        """The frames as a list."""
        return [self.frame] if isinstance(self.frame, str) else self.frame


class UrdfEntry(Strict):
    """`[urdf]`: where the URDF is.

    Attributes:
        file: a file under urdf/, or inside `package`.
        package: an installed distribution; None for a file under urdf/.
    """

    file: Name = Field(min_length=1)
    package: str | None = Field(default=None, pattern=r"^[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9])?$", max_length=200)


class ModelFile(Strict):
    """model.toml."""

    name: str = Field(pattern=ROBOT_NAME, max_length=LONGEST_ROBOT_NAME)
    description: Text = Field(min_length=1)
    convention: Convention
    provenance: Provenance
    tolerance: Tolerance
    gate: Literal["sampled", "certified"] = "sampled"
    base: Transform | None = None
    tool: Transform | None = None
    urdf: UrdfEntry | None = None
    source: list[SourceEntry] = Field(min_length=1)
    accepted: list[AcceptedEntry] = []

    @field_validator("name")
    @classmethod
    def _not_reserved(cls, name: str) -> str:
        if name.lower() in RESERVED:
            raise ValueError(f"expected a name other than {', '.join(RESERVED)}: those files are taken in the reports' folder")
        return name
