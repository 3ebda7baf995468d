"""The report document: typed once; JSON Schema is generated from these types and every format is rendered from them.

Units are metres and radians. Everything that varies between two equal runs (times, versions, host) is in `environment`.
Computed numbers are written to the digits that mean something, so that the rest does not depend on the processor: their types
do that, see `harness.digits`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from harness.digits import coordinate
from harness.report.explanation import Explanation
from harness.report.model_parts import SideBySide, Trees
from harness.report.notebook import html_lines, html_table, text_table
from harness.report.parts import (
    Configuration,
    Count,
    Finite,
    Matrix,
    NonNegative,
    Part,
    RobotName,
)
from harness.report.pose import Pose
from harness.report.proof_parts import Certificate, Theorem
from harness.report.regression import Regression
from harness.report.results import Lint, PairResult, PublishedResult
from harness.report.source_parts import FrameResult, Reproducer, Tolerance, TraitNote, Validity
from harness.report.tested_parts import Tested
from harness.report.text import metres, plain, radians
from harness.report.verdicts import SourceVerdict

WORDS = {0: "PASS", 1: "FAIL", 3: "INCOMPLETE"}


def _require_different(names: Iterable[str], what: str) -> None:
    """Raise ValueError if two are the same."""
    counts = Counter(names)
    if (twice := next((name for name, count in counts.items() if count > 1), None)) is not None:
        raise ValueError(f"it has {counts[twice]} {what} called {twice!r}")


def _require(names: Iterable[str], known: set[str], what: str) -> None:
    """Raise ValueError unless all names are known."""
    if (unknown := next((name for name in names if name not in known), None)) is not None:
        raise ValueError(f"it speaks of a {what} that it does not have, {unknown!r}")


class Source(Part):
    """One source: whether it ran, what it was given, and how it compares.

    read_in: the frame its placements were read in, if it lacks the base frame; absent: mapped frames it does not have, and
    was not compared at. floor: what rounding alone may change in its discrepancies between two versions of a library [m, rad].
    """

    name: str
    required: bool
    reference: bool = False
    status: Literal["ran", "not run", "failed"]
    verdict: SourceVerdict
    reason: str = ""
    install: str = ""
    tolerance: Tolerance
    floor: NonNegative = 0.0
    joints: list[str] = []
    mimic: str = ""
    held: list[str] = []
    read_in: str = ""
    absent: list[str] = []
    traits: list[TraitNote] = []
    validity: Validity | None = None
    frames: list[FrameResult] = []
    worst_frame: str = ""
    first_disagreeing_frame: str = ""
    noise: str = ""
    noise_text: str = ""
    explained_by: list[str] = []
    explanation: Explanation | None = None
    reproducer: Reproducer | None = None
    pose: Pose | None = None
    certificate: Certificate | None = None
    tested: Tested | None = None

    @model_validator(mode="after")
    def _has_its_worst_frame(self) -> Source:
        if self.frames and self.worst_frame not in (f.frame for f in self.frames):
            raise ValueError(f"{self.name}: the worst frame, {self.worst_frame!r}, is none of its frames")
        return self

    @property
    def passes(self) -> bool:
        """Whether its verdict is a good one."""
        return self.verdict.passes

    def places(self) -> Iterator[str]:
        """Every mapped frame it speaks of."""
        yield from (f.frame for f in self.frames)
        yield from (f.frame for f in self.pose.frames) if self.pose else ()
        yield from (f.frame for f in self.certificate.frames) if self.certificate else ()
        yield from (spot.frame for spot in self.tested.spots) if self.tested else ()

    def configurations(self) -> Iterator[Configuration]:
        """Every configuration it speaks of."""
        statistics = (s for f in self.frames for s in (f.position, f.rotation))
        at = [self.pose and self.pose.at, *(s.worst for s in statistics)]
        at += [self.validity.first, self.validity.again_at] if self.validity else []
        yield from (place.q for place in at if place)
        yield from (self.reproducer.q,) if self.reproducer else ()
        yield from (spot.q for spot in self.tested.spots) if self.tested else ()

    def cells(self) -> list[str]:
        """Name, verdict, worst frame and the largest discrepancies there; the reason, if nothing was compared."""
        if not self.frames:
            return [self.name, str(self.verdict), plain(self.reason), "", ""]
        worst = self.worst
        return [self.name, str(self.verdict), worst.frame, metres(worst.position.max), radians(worst.rotation.max)]

    @property
    def worst(self) -> FrameResult:
        """The frame that is furthest off, over the tolerance. Raises StopIteration if none was compared."""
        return next(f for f in self.frames if f.frame == self.worst_frame)


class Frame(Part):
    """One mapped frame. `offset` is T_dh_frame: declared, or if rigid the mean over a lattice of 1021 configurations."""

    name: str
    dh: str
    urdf: str | None
    relation: Literal["identical", "declared", "rigid"]
    of: str | None = None
    offset: Matrix | None = None
    measured_from: str = ""


class Robot(Part):
    """The robot model the report is about. Placements are expressed in the frame `base`."""

    name: RobotName
    description: str
    convention: Literal["standard", "modified"]
    provenance: dict[str, str]
    base: str
    joints: list[str]
    lower: list[Finite]
    upper: list[Finite]
    reach: Annotated[NonNegative, AfterValidator(coordinate)]
    hashes: dict[str, str]

    @model_validator(mode="after")
    def _limits_of_each_joint(self) -> Robot:
        if not len(self.joints) == len(self.lower) == len(self.upper):
            raise ValueError(f"expected a lower and an upper limit of each of {len(self.joints)} joints")
        return self


class Settings(Part):
    """What was asked for. `not_chosen`: sources of model.toml that the command line left out. `gate`: what decides, the
    configurations sampled, or also what is proven of the two descriptions. `fixed` and `samples` count configurations,
    `subset` those on which all pairs are compared. `probe_seed`: of the configurations at which each engine was tested
    against its own description."""

    reference: str
    sources: list[str]
    not_chosen: list[str] = []
    gate: Literal["sampled", "certified"] = "sampled"
    certify: bool = True
    fixed: Count
    samples: Count
    seed: int = Field(ge=0, lt=2**64)
    probe_seed: int = Field(default=0, ge=0, lt=2**64)
    subset: Count
    command: str


class GateVerdict(Part):
    """The gate: 0 agreement, 1 disagreement, 3 a required source is missing or failed. `reasons` says why, one a line."""

    exit_code: Literal[0, 1, 3]
    sentence: str
    reasons: list[str] = []

    @property
    def passes(self) -> bool:
        """Whether the robot passes the gate."""
        return self.exit_code == 0

    @property
    def word(self) -> str:
        """`PASS`, `FAIL` or `INCOMPLETE`: how every format begins."""
        return WORDS[self.exit_code]


class Environment(Part):
    """What varies: times [s], versions, machine. Nothing outside this block does.

    loading: until every engine was there. engine_seconds: inside each engine; waiting_seconds: until its answers were here.
    """

    created: str
    duration: NonNegative
    loading: NonNegative = 0.0
    engine_seconds: dict[str, NonNegative]
    waiting_seconds: dict[str, NonNegative] = {}
    versions: dict[str, dict[str, str]]
    harness: str
    python: str
    platform: str


class Report(Part):
    """The whole document."""

    format: Literal["fk-crosscheck report"] = "fk-crosscheck report"
    version: Literal["1.4"] = "1.4"
    robot: Robot
    settings: Settings
    verdict: GateVerdict
    sources: list[Source]
    frames: list[Frame]
    unmapped: list[str] = []
    trees: Trees = Trees()
    parameters: SideBySide | None = None
    pairs: list[PairResult]
    published: list[PublishedResult]
    theorem: Theorem | None = None
    lint: list[Lint]
    regression: Regression | None = None
    environment: Environment

    @model_validator(mode="after")
    def _speaks_of_what_it_has(self) -> Report:
        """What renders a document looks things up by name. What is not there is refused here, in one line."""
        _require_different((s.name for s in self.sources), "sources")
        _require_different((f.name for f in self.frames), "frames")
        sources, frames = {s.name for s in self.sources}, {f.name for f in self.frames}
        _require((name for pair in self.pairs for name in (pair.a, pair.b)), sources, "source")
        _require((place for source in self.sources for place in source.places()), frames, "frame")
        if self.theorem is not None:
            self.theorem.require(frames, len(self.robot.joints))
        if any(len(q) != len(self.robot.joints) for source in self.sources for q in source.configurations()):
            raise ValueError(f"expected {len(self.robot.joints)} joint values in each configuration")
        return self

    @property
    def passes(self) -> bool:
        """Whether the robot passes the gate: `assert report.passes, report`."""
        return self.verdict.passes

    def __str__(self) -> str:
        header, rows = self._table()
        return "\n".join([self._headline(), *text_table(header, rows), *self._causes()])

    def __repr__(self) -> str:
        return f"<Report {self._headline()}>"

    def _repr_html_(self) -> str:
        header, rows = self._table()
        return html_lines([self._headline(), *self._causes()]) + html_table(header, rows)

    def _headline(self) -> str:
        return plain(f"{self.verdict.word} {self.verdict.sentence}")

    def _table(self) -> tuple[list[str], list[list[str]]]:
        """A row a source: verdict, worst frame and largest discrepancies."""
        header = ["source", "verdict", "worst frame", "position", "rotation"]
        return header, [source.cells() for source in self.sources if not source.reference]

    def _causes(self) -> list[str]:
        """Why sources disagree, a line a change, each once."""
        changes = [c for s in self.sources if s.explanation and not s.passes for c in s.explanation.changes]
        return [plain(f"  why: {text}") for text in dict.fromkeys(change.text for change in changes)]
