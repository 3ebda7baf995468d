"""What became of each source of a run, before it becomes a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from harness.cause.explain import Explanation
from harness.comparison.compare import Comparison
from harness.description.dh import DHTable
from harness.description.model import RobotModel
from harness.errors import EngineFailed, EngineUnavailable
from harness.run.binding import Bound
from harness.run.options import Options
from harness.run.plan import Planned, pair_tolerance
from harness.run.rigid import Offset, transforms
from harness.run.tested import Tested
from harness.se3 import Array
from harness.theorem.prove import FrameBound
from harness.theorem.statement import Theorem

Status: TypeAlias = Literal["ran", "not run", "failed"]


@dataclass(frozen=True, kw_only=True)
class Reproduced:
    """The shrunk worst configuration of a source.

    frame: index of the mapped frame.
    q: (n,) in model order.
    position, rotation: the discrepancy there [m], [rad].
    T_reference, T_source: both placements of the frame, (4, 4).
    """

    frame: int
    q: Array
    position: float
    rotation: float
    T_reference: Array
    T_source: Array


@dataclass(frozen=True)
class Worst:
    """Where a source is furthest off, in parts of its tolerance.

    index: number of the configuration.
    frame: index of the mapped frame.
    placements: both placements (4, 4) of each common frame, reference first, by frame index.
    """

    index: int
    frame: int
    placements: dict[int, tuple[Array, Array]]


@dataclass(frozen=True, kw_only=True)
class Certified:
    """What is proven of the descriptions that a source and the reference read, or why it does not count (`reason`).

    frames: indices of the mapped frames.
    bounds: the proven bounds there; None if nothing counts.
    """

    reason: str = ""
    frames: Sequence[int] = ()
    bounds: tuple[FrameBound, ...] | None = None


@dataclass(frozen=True)
class Explained:
    """Why a source disagrees: the repair that works, or what is known of the difference without one."""

    explanation: Explanation | None = None
    unexplained: str = ""


@dataclass(kw_only=True)
class Outcome:
    """One planned source and everything that became of it.

    planned: what was asked of it.
    status: `ran` until it fails.
    reason, install: why it does not run, and the line that installs it.
    bound: its engine; None once it does not run.
    reproduced, worst, certified, explained, tested: what the phases of the run gave; None where they had nothing to say.
    """

    planned: Planned
    status: Status = "ran"
    reason: str = ""
    install: str = ""
    bound: Bound | None = None
    reproduced: Reproduced | None = None
    worst: Worst | None = None
    certified: Certified | None = None
    explained: Explained | None = None
    tested: Tested | None = None

    @property
    def name(self) -> str:
        """Source name."""
        return self.planned.name

    def running(self) -> Bound:
        """Its engine. Raises RuntimeError if it does not run."""
        if self.bound is None:
            raise RuntimeError(f"{self.name} is not bound")
        return self.bound

    def fail(self, error: Exception) -> None:
        """Take the source out and keep why. What third-party code raises is its result, not the end of the run.

        What the source gave before goes with it: a partial result is no result.
        """
        self.bound = self.reproduced = self.worst = self.certified = self.explained = self.tested = None
        self.status = "not run" if isinstance(error, EngineUnavailable) else "failed"
        self.reason = error.reason if isinstance(error, EngineUnavailable | EngineFailed) else f"{type(error).__name__}: {error}"
        self.install = (error.install or "") if isinstance(error, EngineUnavailable) else ""


def rounding_needed(table: DHTable) -> float:
    """What two right evaluations of a table in float64 may differ by [m]: 4 (n + 2) u (1 + sum |a| + |d|).

    Of an arm of ordinary lengths that is some 1e-14 m. Nearly parallel axes give a and d of kilometres that cancel.
    """
    lengths = sum(abs(row.a) + abs(row.d) for row in table.rows)
    return 4.0 * (len(table.rows) + 2) * 2.0**-53 * (1.0 + lengths)


@dataclass(kw_only=True)
class Run:
    """One robot model cross-checked.

    model: the robot model.
    options: what was asked.
    reference: the source that the others are compared with.
    others: every other planned source, in order.
    in_house: the in-house FK, bound to the model.
    offsets: the measured offsets of rigid frames.
    comparison: discrepancies of all sources; None if the reference does not run.
    theorem: what is proven of the table and the URDF; None if nothing was to be.
    seconds, loaded_in: time of the whole run, and until every engine was there [s].
    """

    model: RobotModel
    options: Options
    reference: Outcome
    others: tuple[Outcome, ...]
    in_house: Bound
    offsets: dict[str, Offset] = field(default_factory=dict)
    comparison: Comparison | None = None
    theorem: Theorem | None = None
    seconds: float = 0.0
    loaded_in: float = 0.0

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """The reference, then all others."""
        return self.reference, *self.others

    @property
    def compared(self) -> list[Outcome]:
        """The others that run, if the reference does: those of which discrepancies are known."""
        if self.comparison is None or self.reference.bound is None:
            return []
        return [o for o in self.others if o.bound is not None and o.name in self.comparison.position]

    @property
    def rigid_transforms(self) -> dict[str, Array]:
        """The measured offsets T_dh_frame (4, 4) of rigid frames, by frame name."""
        return transforms(self.offsets)

    def tolerance(self, outcome: Outcome) -> tuple[float, float]:
        """Tolerance [m], [rad] of a source against the reference. Not below what float64 needs for lengths that cancel."""
        position, rotation = pair_tolerance(outcome.planned, self.reference.planned)
        return max(position, rounding_needed(self.model.table)), rotation

    def take_out(self, outcome: Outcome, error: Exception, where: str = "") -> None:
        """Take out a source that failed after it was compared.

        error: what it raised.
        where: when it did, for the reason.
        """
        outcome.fail(error)
        outcome.reason = f"{outcome.reason} {where}".rstrip()
        if outcome is self.reference:
            self.comparison = None
        elif self.comparison is not None:
            self.comparison.drop(outcome.name)

    def discrepancies(self) -> Comparison:
        """The comparison. Raises RuntimeError if the reference does not run."""
        if self.comparison is None:
            raise RuntimeError(f"nothing was compared: {self.reference.name} does not run")
        return self.comparison
