"""What every engine is to the harness: joints, frames and a batch of placements, all by name.

An adapter uses its library as users do and repairs nothing. What a library does differently is recorded as a `Trait`.
"""

from __future__ import annotations

import importlib
import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from types import ModuleType
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from harness.description.dh import DHTable
from harness.description.packaged import Packaged
from harness.description.urdf import UrdfText
from harness.errors import EngineFailed, EngineUnavailable, nearest
from harness.se3 import Array

# What an engine is built on.
Description: TypeAlias = "DHTable | UrdfText | Packaged"


@dataclass(frozen=True)
class Trait:
    """Something an engine does differently from the URDF specification or from other engines.

    Attributes:
        key: short name of it, the same for every engine that does it.
        text: what the engine does, in one sentence.
        evidence: how it is known: the version and the case that shows it.
        lint: code of the URDF finding that makes it matter; None if it always matters.
    """

    key: str
    text: str
    evidence: str
    lint: str | None = None

    @property
    def version(self) -> str:
        """The library and its version, as the evidence names them first: `pinocchio 4.1.0`; empty if it names none."""
        match = re.search(r"[\w.-]+ [0-9]+(?:\.[0-9]+)+", self.evidence)
        return match[0] if match else ""


@dataclass(frozen=True)
class LintTrait(Trait):
    """A trait that a finding of the lint makes matter.

    Attributes:
        on: the type of joint with which it matters; empty if the type makes no difference.
    """

    on: str = ""


class Refusal(LintTrait):
    """The engine refuses a URDF with this finding."""


class Misreading(LintTrait):
    """The engine reads a URDF with this finding otherwise than the specification says."""


class Engine(ABC):
    """Forward kinematics of one description by one library.

    A subclass takes the description in its constructor: a `DHTable` if `source` starts with `dh:`, a `UrdfText` if it starts
    with `urdf:`, or what `takes` says. It sets `joints` and `frames` and implements `_placements`.
    Its module runs in environments that have little more than NumPy and the library. So it imports nothing else of third
    parties, and the library itself only in the constructor, through `library()`.

    Attributes:
        source: the engine's name, such as `urdf:pinocchio`.
        takes: `packaged` if it takes a robot that its library ships; empty for a table or a URDF.
        partial: the library omits some links, as its traits say. Every joint must still move at least one frame that it has.
        isolated: whether it runs in a process of its own.
        resolution: what its arithmetic is good for, [m] and [rad], if that is worse than float64. It is the tolerance of an
            engine that model.toml does not list.
        slow: a configuration takes it a millisecond or more, and it answers one after the other: it is tested at fewer.
        ignored_step: joint steps up to this may leave its answers as they were, as one of its traits says [rad or m].
        requirements: what pip installs for it.
        debian: packages of the system's own Python that it needs instead.
        imports: the modules that the `debian` packages bring.
        traits: what it does differently, with evidence.
        joints: names of its joints, in the library's order: the columns of q.
        frames: names of its frames, in the library's order.
    """

    source: str
    takes: ClassVar[Literal["", "packaged"]] = ""
    partial: bool = False
    isolated: ClassVar[bool] = True
    resolution: ClassVar[float] = 0.0
    slow: ClassVar[bool] = False
    ignored_step: ClassVar[float] = 0.0
    requirements: ClassVar[tuple[str, ...]] = ()
    debian: ClassVar[tuple[str, ...]] = ()
    imports: ClassVar[tuple[str, ...]] = ()
    traits: tuple[Trait, ...] = ()

    joints: tuple[str, ...]
    frames: tuple[str, ...]

    @abstractmethod
    def __init__(self, description: Any) -> None:
        """Build the library's model.

        Raises:
            EngineUnavailable: the library is not installed.
            EngineFailed: the library refuses the description.
        """

    @abstractmethod
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        """Placements for checked arguments; see `placements`."""

    def placements(self, q: Array, frames: Sequence[str]) -> Array:
        """Placement of each named frame in the library's own root frame.

        Args:
            q: joint values (N, n) float64, columns as `joints` [rad or m].
            frames: names of the frames.

        Returns:
            Placements (N, len(frames), 4, 4) float64 [m].

        Raises:
            ValueError: `q` has the wrong shape.
            KeyError: the engine does not have a frame.
            EngineFailed: the library failed, or gave a result of the wrong shape.
        """
        q = np.asarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[1] != len(self.joints):
            raise ValueError(f"{self.source}: expected q of shape (N, {len(self.joints)}), got {q.shape}")
        for frame in frames:
            if frame not in self.frames:
                raise KeyError(f"{self.source} has no frame {frame!r}; {nearest(frame, self.frames)}")
        T = np.asarray(self._placements(q, frames))
        expected = (q.shape[0], len(frames), 4, 4)
        if T.shape != expected or T.dtype != np.float64:
            raise EngineFailed(self.source, f"expected placements float64 {expected}, got {T.dtype} {T.shape}")
        return T

    @classmethod
    def versions(cls) -> dict[str, str]:
        """Installed version of each required distribution in this environment; those that are missing are left out."""
        versions = {}
        for requirement in cls.requirements:
            name = re.split(r"[^A-Za-z0-9._-]", requirement, maxsplit=1)[0]
            try:
                versions[name] = metadata.version(name)
            except metadata.PackageNotFoundError:
                continue
        return versions

    def installed(self) -> dict[str, str]:
        """Versions of the libraries this engine runs on."""
        return self.versions()

    @classmethod
    def library(cls, module: str) -> ModuleType:
        """Import a module of the library.

        Raises:
            EngineUnavailable: it cannot be imported.
        """
        try:
            return importlib.import_module(module)
        except ImportError as error:
            raise EngineUnavailable(cls.source, f"import {module} failed: {error}") from error
