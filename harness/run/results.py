"""What a run has found, before it becomes a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from harness.cause.explain import Explanation
from harness.certificate.certify import Bounds
from harness.comparison.compare import Comparison
from harness.description.model import RobotModel
from harness.run.binding import Bound
from harness.run.options import Options
from harness.run.plan import Participant
from harness.se3 import Array


@dataclass(frozen=True, kw_only=True)
class Reproduced:
    """The shrunk worst configuration of a source: mapped frame, q (n,), errors [m], [rad], both placements (4, 4)."""

    frame: int
    q: Array
    position: float
    rotation: float
    T_reference: Array
    T_source: Array


@dataclass(frozen=True, kw_only=True)
class Certified:
    """A source's certificate against the reference, or why it has none (`reason`).

    form: `grid` or `links`; nodes: configurations evaluated; residuals: how far each engine is from its own interpolant,
    limit: how far rounding explains; frames: indices of the mapped frames certified; found: largest discrepancies seen.
    """

    reason: str = ""
    form: str = ""
    nodes: int = 0
    residual: float = 0.0
    reference_residual: float = 0.0
    limit: float = 0.0
    frames: Sequence[int] = ()
    bounds: Bounds | None = None
    position_found: Array | None = None
    rotation_found: Array | None = None


@dataclass(frozen=True)
class Explained:
    """Why a source disagrees: the repair that was found, or what is known of the difference without one."""

    explanation: Explanation | None = None
    unexplained: str = ""


@dataclass(frozen=True)
class Posed:
    """The configuration where a source is furthest off, over its tolerance, and the frame; both placements of each common one."""

    index: int
    frame: int
    placements: dict[int, tuple[Array, Array]]


@dataclass(kw_only=True)
class Results:
    """Everything a run found. `comparison` is None if the reference did not run; `in_house` is always there."""

    model: RobotModel
    options: Options
    participants: list[Participant]
    offsets: dict[str, Array] = field(default_factory=dict)
    measured_from: dict[str, str] = field(default_factory=dict)
    in_house: Bound | None = None
    comparison: Comparison | None = None
    reproduced: dict[str, Reproduced] = field(default_factory=dict)
    posed: dict[str, Posed] = field(default_factory=dict)
    certified: dict[str, Certified] = field(default_factory=dict)
    explained: dict[str, Explained] = field(default_factory=dict)
    seconds: float = 0.0
    loaded_in: float = 0.0
