"""What a cross-check is asked for, and what it has found before it becomes a report."""

from __future__ import annotations

from dataclasses import dataclass, field

from harness.analysis.compare import Comparison
from harness.description.model import RobotModel
from harness.engines.registry import REFERENCE
from harness.errors import InputError
from harness.se3 import Array
from harness.sources import Bound, Participant


@dataclass(frozen=True)
class Options:
    """What a cross-check is asked to do. `sources` empty: those of model.toml. `command` is shown as how to reproduce."""

    samples: int = 2000
    seed: int = 0
    sources: tuple[str, ...] = ()
    reference: str = REFERENCE
    command: str = ""

    def __post_init__(self) -> None:
        """Refuse impossible numbers. Raises InputError."""
        if self.samples < 0:
            raise InputError(f"expected samples >= 0, got {self.samples}")
        if not 0 <= self.seed < 2**64:
            raise InputError(f"expected 0 <= seed < 2^64, got {self.seed}")


@dataclass(frozen=True)
class Reproduced:
    """The shrunk worst configuration of a source: mapped frame, q (n,), errors [m], [rad], both placements (4, 4)."""

    frame: int
    q: Array
    position: float
    rotation: float
    T_reference: Array
    T_source: Array


@dataclass
class Results:
    """Everything a run found. `comparison` is None if the reference did not run; `in_house` is always there."""

    model: RobotModel
    options: Options
    participants: list[Participant]
    offsets: dict[str, Array] = field(default_factory=dict)
    measured_from: str = ""
    in_house: Bound | None = None
    comparison: Comparison | None = None
    reproduced: dict[str, Reproduced] = field(default_factory=dict)
    seconds: float = 0.0
