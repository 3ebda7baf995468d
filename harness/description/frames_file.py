"""frames.toml as written: `[[frame]]`, `[joints.NAME]` and `[engine."SOURCE"]`."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from harness.description.values import Angles3, Label, Lengths3, Name, Number, Strict, Transform
from harness.se3 import Array


class FrameEntry(Strict):
    """One `[[frame]]` as written."""

    name: Name = Field(min_length=1)
    dh: Label | None = None
    urdf: Name | None = None
    of: Name | None = None
    xyz: Lengths3 | None = None
    rpy: Angles3 | None = None
    rigid: bool = False

    @model_validator(mode="after")
    def _one_meaning(self) -> FrameEntry:
        declared = self.xyz is not None or self.rpy is not None
        if (self.dh is None) == (self.of is None):
            raise ValueError("expected exactly one of 'dh' and 'of'")
        if self.rigid and (declared or self.of is not None):
            raise ValueError("'rigid' means the offset is measured: leave out xyz, rpy and of")
        if self.of is not None and not declared:
            raise ValueError("'of' needs the offset: xyz, rpy or both (zeros, if it is the same frame)")
        if self.urdf is None and (self.rigid or self.of is not None):
            raise ValueError("an entry with 'rigid' or 'of' needs 'urdf'")
        return self

    @property
    def transform(self) -> Transform | None:
        """The declared offset as it is written; None if none is."""
        if self.xyz is None and self.rpy is None:
            return None
        return Transform(xyz=self.xyz or [0.0] * 3, rpy=self.rpy or [0.0] * 3)

    @property
    def offset(self) -> Array:
        """The declared offset as (4, 4); identity if none is."""
        transform = self.transform
        return np.eye(4) if transform is None else transform.matrix()


class JointEntry(Strict):
    """One `[joints.NAME]`: q_urdf = sign * q[NAME] + sum(coupling[k] * q[k]) + offset; `urdf` defaults to NAME."""

    urdf: Name | None = None
    sign: Literal[-1, 1] = 1
    offset: Number = 0.0
    coupling: dict[Name, Number] = {}


class EngineNames(Strict):
    """Names of one engine. All are optional.

    base: the mapped frame in which its placements are read, if it lacks the base frame; frames: its name for a mapped frame;
    joints: its name for a joint; without: mapped frames it does not have; tip: the mapped frame that a library which builds one
    chain only is to end it at; robot: its own name for a packaged model.
    """

    base: Name | None = None
    frames: dict[Name, Name] = {}
    joints: dict[Name, Name] = {}
    without: list[Name] = []
    tip: Name | None = None
    robot: Name | None = Field(default=None, min_length=1)


class FramesFile(Strict):
    """frames.toml."""

    frame: list[FrameEntry] = Field(min_length=1)
    joints: dict[Name, JointEntry] = {}
    engine: dict[Name, EngineNames] = {}

    @field_validator("joints", mode="before")
    @classmethod
    def _short_form(cls, value: Any) -> Any:
        """`elbow = "elbow_joint"` is short for `elbow = {urdf = "elbow_joint"}`."""
        if isinstance(value, dict):
            return {k: {"urdf": v} if isinstance(v, str) else v for k, v in value.items()}
        return value
