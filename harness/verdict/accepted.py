"""The numbers on file of one robot, `reports/accepted/<robot>.json`: taken from a report, and a later report compared with them.

Small and sorted, to be reviewed like code: largest discrepancies and proven bounds by source and frame, verdicts, inputs.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, Protocol

from pydantic import ValidationError

from harness.errors import InputError, command_line
from harness.reading import MODEL_BYTES, parsed_json, read_text
from harness.report.document import GateVerdict, Report, Robot, Settings, Source
from harness.report.parts import NonNegative, Part
from harness.report.regression import Changed, Moved, Quantity, Regression
from harness.report.results import PublishedResult

FOLDER = "accepted"
GATE = {0: "passes", 1: "fails", 3: "incomplete"}  # how the file calls the verdict
Pair = tuple[NonNegative, NonNegative]  # position [m], rotation [rad]
SEEN: tuple[Quantity, Quantity] = ("position", "rotation")
PROVEN: tuple[Quantity, Quantity] = ("position, for all q", "rotation, for all q")
UNITS: tuple[Literal["m", "rad"], ...] = ("m", "rad")


class Conditions(Part):
    """What must be the same for numbers to be comparable; fewer samples are a part of more."""

    reference: str
    fixed: int
    samples: int
    seed: int


class AcceptedSource(Part):
    """One source: its verdict, the largest discrepancies at each frame, and the bounds proven there, if any."""

    verdict: str
    frames: dict[str, Pair] = {}
    bounds: dict[str, Pair] = {}


class AcceptedNumbers(Part):
    """The whole file."""

    format: Literal["fk-crosscheck accepted"] = "fk-crosscheck accepted"
    version: Literal["1.0"] = "1.0"
    robot: str
    accepted: str
    verdict: str
    settings: Conditions
    inputs: dict[str, str]
    published: dict[str, str]
    sources: dict[str, AcceptedSource]


class Judged(Protocol):
    """What the numbers on file are compared with: a report, or what is about to become one."""

    @property
    def robot(self) -> Robot:
        """The robot model."""

    @property
    def settings(self) -> Settings:
        """What was asked."""

    @property
    def sources(self) -> list[Source]:
        """Every source."""

    @property
    def published(self) -> list[PublishedResult]:
        """Every published placement."""

    @property
    def verdict(self) -> GateVerdict:
        """The verdict of the gate."""


def accepted_from(report: Report) -> AcceptedNumbers:
    """The numbers of a report, as they go on file."""
    return AcceptedNumbers(
        robot=report.robot.name,
        accepted=report.environment.created[:10],
        verdict=_gate(report),
        settings=_settings(report),
        inputs=dict(sorted(report.robot.hashes.items())),
        published={_claim(p): p.found for p in report.published},
        sources={s.name: _numbers(s) for s in report.sources if s.status == "ran" and not s.reference},
    )


def accepted_text(numbers: AcceptedNumbers) -> str:
    """The file's text: JSON, a line a frame."""
    text = json.dumps(numbers.model_dump(), indent=1, ensure_ascii=False)
    # A pair of numbers belongs on one line, so that a changed frame is one changed line.
    lines, out = text.split("\n"), []
    while lines:
        line = lines.pop(0)
        if line.endswith("[") and len(lines) >= 3:
            line += " ".join(lines.pop(0).strip() for _ in range(2)) + lines.pop(0).strip()
        out.append(line)
    return "\n".join(out) + "\n"


def read_accepted(path: Path) -> AcceptedNumbers:
    """Read the numbers on file. Raises InputError if there are none, or they cannot be read."""
    if not os.path.lexists(path):
        raise InputError("nothing was accepted yet", where=path, hint=command_line(["crosscheck", "accept", path.stem]))
    data = parsed_json(read_text(path, MODEL_BYTES), path)
    try:
        return AcceptedNumbers.model_validate(data)
    except ValidationError as failure:
        first = failure.errors(include_url=False)[0]
        key = ".".join(str(step) for step in first["loc"])
        raise InputError(f"no accepted numbers: {first['msg']}", where=path, key=key or None) from None


def since(numbers: AcceptedNumbers, report: Judged, strict: bool) -> Regression:
    """What moved from the numbers on file to this report; strict: what grew fails."""
    now, before = _settings(report), numbers.settings
    # Random configurations are numbered: with fewer of them the first ones are looked at again, and what grows there has grown.
    fewer = now.samples < before.samples
    other = [f"{k}: {getattr(before, k)}, now {v}" for k, v in now if getattr(before, k) != v and not (k == "samples" and fewer)]
    moved = [] if other else list(_moved(numbers, report))
    return Regression(
        accepted=numbers.accepted,
        problem=f"accepted with other settings ({'; '.join(other)})" if other else "",
        note=f"looked at {now.samples} of the {before.samples} random configurations accepted" if fewer else "",
        moved=[m for m in moved if m.after > m.before or m.quantity in PROVEN] if fewer else moved,
        changed=list(_changed(numbers, report)),
        strict=strict,
    )


def _gate(report: Judged) -> str:
    return GATE[report.verdict.exit_code]


def _settings(report: Judged) -> Conditions:
    s = report.settings
    return Conditions(reference=s.reference, fixed=s.fixed, samples=s.samples, seed=s.seed)


def _claim(p: PublishedResult) -> str:
    return f"{p.configuration}, DH frame {p.frame} in {p.relative_to}"


def _numbers(source: Source) -> AcceptedSource:
    bounds = source.certificate.frames if source.certificate else []
    return AcceptedSource(
        verdict=source.verdict,
        frames={f.frame: (_kept(f.position.max, source.floor), _kept(f.rotation.max, source.floor)) for f in source.frames},
        bounds={b.frame: (_kept(b.position_upper, source.floor), _kept(b.rotation_upper, source.floor)) for b in bounds},
    )


def _kept(x: float, floor: float) -> float:
    """Ten digits; 0 below the noise floor, so that the file changes only where something did."""
    return 0.0 if x <= floor else float(f"{x:.10g}")


def _moved(numbers: AcceptedNumbers, report: Judged) -> Iterator[Moved]:
    for source in report.sources:
        known = numbers.sources.get(source.name)
        if known is None:
            continue
        new = _numbers(source)
        for quantities, before, after, floor in (
            (SEEN, known.frames, new.frames, source.floor),
            (PROVEN, known.bounds, new.bounds, source.floor),
        ):
            for frame in (f for f in before if f in after):
                for what, unit, a, b in zip(quantities, UNITS, before[frame], after[frame], strict=True):
                    if abs(b - a) > floor:
                        yield Moved(source=source.name, frame=frame, quantity=what, unit=unit, before=a, after=b, floor=floor)


def _changed(numbers: AcceptedNumbers, report: Judged) -> Iterator[Changed]:
    if numbers.verdict != (gate := _gate(report)):
        yield Changed(what="the gate", before=numbers.verdict, after=gate, worse=not report.verdict.passes)
    for name, digest in report.robot.hashes.items():
        if (before := numbers.inputs.get(name, "not there")) != digest:
            yield Changed(what=name, before=before[:12], after=digest[:12])
    for name in (name for name in numbers.inputs if name not in report.robot.hashes):
        yield Changed(what=name, before=numbers.inputs[name][:12], after="not there")
    yield from _sources_changed(numbers, report)
    claims = {_claim(p): p for p in report.published}
    for text, found in numbers.published.items():
        if text in claims and claims[text].found != found:
            worse = claims[text].found != claims[text].status
            yield Changed(what=f"published placement {text}", before=found, after=claims[text].found, worse=worse)


def _sources_changed(numbers: AcceptedNumbers, report: Judged) -> Iterator[Changed]:
    now = {s.name: s for s in report.sources if not s.reference}
    for name, source in now.items():
        known = numbers.sources.get(name)
        if known is None:
            if source.status == "ran":
                yield Changed(what=name, before="not there", after=source.verdict, worse=not source.passes)
            continue
        if known.verdict != source.verdict:
            yield Changed(what=name, before=known.verdict, after=source.verdict, worse=not source.passes)
        # What is not compared any more is not seen to grow: that is worse than growing.
        frames = {f.frame for f in source.frames}
        for frame in (f for f in known.frames if f not in frames and source.status == "ran"):
            yield Changed(what=f"{name} at {frame}", before="compared", after="not compared", worse=True)
        proven = {b.frame for b in source.certificate.frames} if source.certificate else set()
        if report.settings.certify and known.bounds and not proven and source.status == "ran":
            yield Changed(what=f"certificate of {name}", before="certified", after="none", worse=True)
    for name in (name for name in numbers.sources if name not in now):
        yield Changed(what=name, before=numbers.sources[name].verdict, after="not there", worse=True)
