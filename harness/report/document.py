"""The report document: typed once; JSON Schema is generated from these types and every format is rendered from them.

Units are metres and radians. Everything that varies between two equal runs (times, versions, host) is in `environment`.
"""

from __future__ import annotations

from typing import Literal

from harness.report.explanation import Explanation
from harness.report.parts import Configuration, Finite, Matrix, NonNegative, Part


class At(Part):
    """A configuration: its index (fixed first, then random), its name and q [rad or m]."""

    index: int
    label: str
    q: Configuration


class Statistics(Part):
    """Of one discrepancy, over all configurations. Quantiles are upper bounds, at most 15.5 % high; `decades` counts
    values by power of ten."""

    count: int
    max: NonNegative
    mean: NonNegative
    p50: NonNegative
    p95: NonNegative
    p99: NonNegative
    decades: dict[str, int]
    worst: At | None


class Tolerance(Part):
    """Largest discrepancy that counts as agreement."""

    position: NonNegative
    rotation: NonNegative


class Accepted(Part):
    """A deviation on file for this source and frame."""

    position: NonNegative
    rotation: NonNegative
    within: NonNegative
    reason: str


class FrameResult(Part):
    """One source at one mapped frame, against the reference."""

    frame: str
    verdict: Literal[
        "agrees", "disagrees", "accepted", "deviation changed", "deviation vanished", "not compared", "not certified"
    ]
    position: Statistics
    rotation: Statistics
    noise: str
    accepted: Accepted | None = None


class Reproducer(Part):
    """The worst configuration of a source, shrunk: joints set to zero while the frame still disagrees."""

    frame: str
    q: Configuration
    position: NonNegative
    rotation: NonNegative
    reference_placement: Matrix
    source_placement: Matrix


class TraitNote(Part):
    """A trait of an engine. `lint` is the URDF finding that makes it matter; `applies` says whether this URDF has it."""

    key: str
    text: str
    evidence: str
    lint: str
    applies: bool


class Validity(Part):
    """Placements checked for being placements: finite, last row 0 0 0 1, rotation in SO(3); and for depending on q alone:
    `again` is the largest change of an entry when a configuration, `again_at`, was asked for a second time."""

    checked: int
    invalid: int
    residual: NonNegative
    first: At | None = None
    first_frame: str = ""
    again: NonNegative = 0.0
    again_at: At | None = None


class FrameBound(Part):
    """For every configuration: no discrepancy at this frame is above `upper`; `found` is the largest one seen."""

    frame: str
    position_upper: NonNegative
    position_found: NonNegative
    rotation_upper: NonNegative
    rotation_found: NonNegative
    method: str


class Certificate(Part):
    """Agreement for every angle of every revolute joint, and every prismatic joint within its range; or why there is none.

    form: `grid` or `links`; nodes: configurations evaluated. residual, reference_residual: how far each engine is from the
    interpolant of its own values at random configurations; limit: how far rounding explains.
    """

    status: Literal["certified", "refused"]
    reason: str = ""
    form: str = ""
    nodes: int = 0
    residual: NonNegative | None = None
    reference_residual: NonNegative | None = None
    limit: NonNegative | None = None
    frames: list[FrameBound] = []


class Source(Part):
    """One source: whether it ran, what it was given, and how it compares.

    read_in: the frame its placements were read in, if it lacks the base frame; absent: mapped frames it does not have, and
    was not compared at.
    """

    name: str
    required: bool
    reference: bool = False
    status: Literal["ran", "not run", "failed"]
    verdict: Literal[
        "reference", "agrees", "agrees as accepted", "disagrees", "invalid placements", "keeps state", "not run", "failed"
    ]
    reason: str = ""
    install: str = ""
    tolerance: Tolerance
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
    certificate: Certificate | None = None


class Frame(Part):
    """One mapped frame. `offset` is T_dh_frame: declared, or if rigid the mean over all configurations (a lattice of 1021)."""

    name: str
    dh: str
    urdf: str | None
    relation: Literal["identical", "declared", "rigid"]
    of: str | None = None
    offset: Matrix | None = None
    measured_from: str = ""


class PairResult(Part):
    """Largest discrepancies of two sources over the subset of configurations."""

    a: str
    b: str
    position: NonNegative
    position_frame: str
    rotation: NonNegative
    rotation_frame: str


class PublishedResult(Part):
    """A published placement, as claimed and as computed by the in-house FK. Errors are largest entry differences."""

    configuration: str
    frame: str
    relative_to: str
    provenance: str
    status: Literal["holds", "wrong"]
    found: Literal["holds", "wrong"]
    reason: str
    claimed_position: list[Finite]
    claimed_rotation: Matrix | None
    computed: Matrix
    computed_rpy: list[Finite]
    tolerance: NonNegative
    rotation_tolerance: NonNegative
    position_error: NonNegative
    rotation_error: NonNegative | None


class Lint(Part):
    """A finding about the URDF, the table or the mapping."""

    code: str
    level: Literal["error", "warning", "note"]
    subject: str
    message: str


class Robot(Part):
    """The robot model the report is about. Placements are expressed in the frame `base`."""

    name: str
    description: str
    convention: Literal["standard", "modified"]
    provenance: dict[str, str]
    base: str
    joints: list[str]
    lower: list[Finite]
    upper: list[Finite]
    reach: NonNegative
    hashes: dict[str, str]


class Settings(Part):
    """What was asked for. `not_chosen`: sources of model.toml that the command line left out. `gate`: what decides, the
    configurations sampled or the certificate. `fixed` and `samples` count configurations, `subset` those on which all pairs
    are compared."""

    reference: str
    sources: list[str]
    not_chosen: list[str] = []
    gate: Literal["sampled", "certified"] = "sampled"
    certify: bool = True
    fixed: int
    samples: int
    seed: int
    subset: int
    command: str


class Verdict(Part):
    """The gate: 0 agreement, 1 disagreement, 3 a required source is missing or failed. `reasons` says why, one a line."""

    exit_code: Literal[0, 1, 3]
    sentence: str
    reasons: list[str] = []


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
    version: Literal["1.2"] = "1.2"
    robot: Robot
    settings: Settings
    verdict: Verdict
    sources: list[Source]
    frames: list[Frame]
    unmapped: list[str] = []
    pairs: list[PairResult]
    published: list[PublishedResult]
    lint: list[Lint]
    environment: Environment
