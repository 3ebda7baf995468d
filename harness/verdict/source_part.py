"""One source's part of the report: its verdict at every frame, statistics, traits, noise class, reproducer."""

from __future__ import annotations

import contextlib

from harness.cause.changes import Change
from harness.comparison.compare import Comparison
from harness.comparison.statistics import Stream
from harness.engines.base import Trait
from harness.engines.registry import adapter_of
from harness.errors import CrosscheckError, EngineUnavailable, InputError
from harness.report import document as doc
from harness.report import source_parts as parts
from harness.run.binding import Bound
from harness.run.plan import Participant, pair_tolerance
from harness.run.results import Results
from harness.verdict.deviations import cause_on_file, deviation_on_file
from harness.verdict.evidence import at, certificate, explanation, pose, reproducer
from harness.verdict.judge import FAILING, judge
from harness.verdict.noise import CLASSES, NoiseClass, classify

FLOAT64 = CLASSES[0]


def assemble_source(results: Results, participant: Participant) -> doc.Source:
    """The report entry of one participant."""
    planned, bound = participant.planned, participant.bound
    reference = results.participants[0]
    tolerance = pair_tolerance(planned, reference.planned)
    part = doc.Source(
        name=planned.name,
        required=planned.required,
        reference=participant is reference,
        status=participant.status,
        verdict="failed" if participant.status == "failed" else "not run",
        reason=participant.reason,
        install=participant.install,
        tolerance=parts.Tolerance(position=tolerance[0], rotation=tolerance[1]),
        floor=_floor(results, (planned.name, reference.name)),
        traits=_traits(results, planned.name),
    )
    if bound is None:
        return part
    frames = {"read_in": bound.read_in, "absent": list(bound.absent)}
    part = part.model_copy(update={"joints": list(bound.engine.joints), **frames, **_joint_notes(results, bound)})
    if results.comparison is None:
        why = "not compared: the reference did not run"
        return part.model_copy(update={"status": "not run", "reason": why})
    part = part.model_copy(update={"validity": _validity(results, results.comparison, participant, bound)})
    if participant is reference:
        return part.model_copy(update={"verdict": _unfit(results.comparison, participant) or "reference"})
    return _judged(results, results.comparison, participant, bound, part)


def _floor(results: Results, names: tuple[str, str]) -> float:
    """What rounding alone may change, in float64 or in what an engine computes in, if that is coarser [m, rad]."""
    reach = results.comparison.reach if results.comparison else 0.0
    floor = FLOAT64.limit * (1.0 + reach)
    for name in names:
        with contextlib.suppress(EngineUnavailable, InputError):  # a program, or a broken adapter that says so itself
            floor = max(floor, adapter_of(name).resolution)
    return floor


def _judged(results: Results, comparison: Comparison, participant: Participant, bound: Bound, part: doc.Source) -> doc.Source:
    """Add the frames, and the verdict that follows from them."""
    reference = results.participants[0]
    tolerance = pair_tolerance(participant.planned, reference.planned)
    ends = [end for end in (bound, reference.bound) if end is not None]
    proven = certificate(results, participant.name)
    frames = [
        _frame(results, comparison, participant.name, reference.name, index, tolerance, proven)
        for index in range(len(results.model.frames.frames))
        if all(end.should_have(index) for end in ends)
    ]
    frames = _by_cause(results, participant.name, frames, tolerance)
    failing = [f for f in frames if f.verdict in FAILING]
    if not frames:
        update = {"status": "failed", "verdict": "failed", "reason": f"has no frame in common with {reference.name}"}
        return part.model_copy(update=update)
    worst = max(frames, key=lambda f: max(f.position.max / tolerance[0], f.rotation.max / tolerance[1]))
    noise = classify(max(f.position.max for f in frames), max(f.rotation.max for f in frames), comparison.reach)
    agrees = "agrees as accepted" if any(f.verdict == "accepted" for f in frames) else "agrees"
    verdict = _unfit(comparison, participant) or ("disagrees" if failing else agrees)
    return part.model_copy(
        update={
            "verdict": verdict,
            "frames": frames,
            "worst_frame": worst.frame,
            "first_disagreeing_frame": failing[0].frame if failing else "",
            "noise": noise.key,
            "noise_text": noise.text,
            "explained_by": _evidence(results, part.traits, noise),
            "explanation": explanation(results.explained.get(participant.name)),
            "reproducer": reproducer(results, participant.name),
            "pose": pose(results, participant.name),
            "certificate": proven,
        }
    )


def _by_cause(
    results: Results, source: str, frames: list[parts.FrameResult], tolerance: tuple[float, float]
) -> list[parts.FrameResult]:
    """Accepted frames whose deviation is of the size on file, but has another cause, or one more: changed."""
    on_file = cause_on_file(results.model, source, results.participants[0].name)
    if not on_file or not results.options.explain or all(f.verdict != "accepted" for f in frames):
        return frames
    told = results.explained.get(source)
    e = told.explanation if told else None
    slots = [(c, *others) for c, others in zip(e.changes, e.equivalents, strict=True)] if e else []
    # What is below the tolerance of this source is not its to tell.
    slots = [slot for slot in slots if slot[0].kind != "parameter" or abs(slot[0].size) > max(tolerance)]

    def as_filed(slot: tuple[Change, ...]) -> bool:
        pairs = ((c.size, on_file.get((c.subject, c.parameter))) for c in slot if c.kind == "parameter")
        return any(size is not None and abs(found - size) <= 2.0 * max(tolerance) for found, size in pairs)

    if len(slots) == len(on_file) and all(as_filed(slot) for slot in slots):
        return frames
    return [f.model_copy(update={"verdict": "deviation changed"}) if f.verdict == "accepted" else f for f in frames]


def _unfit(comparison: Comparison, participant: Participant) -> str:
    """Why the answers of a source are no placements of a mechanism, if they are not."""
    validity = comparison.validity[participant.name]
    return "invalid placements" if validity.invalid else "keeps state" if validity.stateful else ""


def _frame(
    results: Results,
    comparison: Comparison,
    source: str,
    reference: str,
    index: int,
    tolerance: tuple[float, float],
    proven: parts.Certificate | None,
) -> parts.FrameResult:
    frame = results.model.frames.frames[index]
    position = _statistics(results, comparison.position[source], index)
    rotation = _statistics(results, comparison.rotation[source], index)
    on_file = deviation_on_file(results.model, source, reference, frame.name)
    deviation = on_file[0] if on_file else None
    bound = next((b for b in proven.frames if b.frame == frame.name), None) if proven else None
    # What the certificate's search has found counts like what the samples have shown: both were evaluated.
    found = (
        max(position.max, bound.position_found if bound else 0.0),
        max(rotation.max, bound.rotation_found if bound else 0.0),
    )
    # A frame that was never compared cannot agree: not one finite pair of placements was seen.
    verdict = judge(*found, tolerance, deviation) if position.count else "not compared"
    if verdict == "agrees" and results.model.file.gate == "certified":
        holds = bound is not None and bound.position_upper <= tolerance[0] and bound.rotation_upper <= tolerance[1]
        verdict = "agrees" if holds else "not certified"
    return parts.FrameResult(
        frame=frame.name,
        verdict=verdict,
        position=position,
        rotation=rotation,
        noise=classify(position.max, rotation.max, comparison.reach).key,
        accepted=on_file
        and parts.Accepted(
            position=on_file[0].position, rotation=on_file[0].rotation, within=on_file[0].within, reason=on_file[1]
        ),
    )


def _statistics(results: Results, stream: Stream, index: int) -> parts.Statistics:
    count = int(stream.count[index])
    return parts.Statistics(
        count=count,
        max=max(float(stream.max[index]), 0.0),
        mean=stream.mean(index),
        p50=stream.quantile(index, 0.50),
        p95=stream.quantile(index, 0.95),
        p99=stream.quantile(index, 0.99),
        decades={str(k): v for k, v in stream.decades(index).items()},
        worst=at(results.model.configurations, int(stream.argmax[index]), results.options.seed) if count else None,
    )


def _validity(results: Results, comparison: Comparison, participant: Participant, bound: Bound) -> parts.Validity:
    seen = comparison.validity[participant.name]
    first = seen.first
    return parts.Validity(
        checked=seen.checked,
        invalid=seen.invalid,
        residual=seen.residual,
        first=at(results.model.configurations, first[0], results.options.seed) if first else None,
        first_frame=bound.frames[first[1]] if first else "",
        again=seen.again,
        again_at=at(results.model.configurations, seen.again_at, results.options.seed) if seen.again_at >= 0 else None,
    )


def _traits(results: Results, source: str) -> list[parts.TraitNote]:
    try:
        traits: tuple[Trait, ...] = adapter_of(source).traits
    except CrosscheckError:  # a broken adapter has none to show; its problem is the source's reason
        return []
    found = {finding.code for finding in results.model.findings}
    return [
        parts.TraitNote(key=t.key, text=t.text, evidence=t.evidence, lint=t.lint or "", applies=t.lint is None or t.lint in found)
        for t in traits
    ]


def _joint_notes(results: Results, bound: Bound) -> dict[str, object]:
    """What the engine was given for mimic followers, and which joints were held at zero."""
    held = [j for j in bound.joint_map.held if j in bound.engine.joints]
    followers = bound.joint_map.followers
    if not followers:
        return {"held": held}
    passed = [j for j in followers if j in bound.engine.joints]
    applied = [j for j in followers if j not in bound.engine.joints]
    texts = []
    if passed:
        texts.append(f"passed multiplier * q + offset for {', '.join(passed)}")
    if applied:
        texts.append(f"the engine itself moves {', '.join(applied)}")
    return {"held": held, "mimic": "; ".join(texts)}


def _evidence(results: Results, traits: list[parts.TraitNote], noise: NoiseClass) -> list[str]:
    """What is known about this engine or this URDF that would make a discrepancy of this class."""
    evidence = [t.text for t in traits if t.applies and noise.key == "float32" and t.key.startswith("float32")]
    if noise.key.startswith("pi-"):
        cut = [f for f in results.model.findings if f.code == "truncated-pi"]
        if cut:
            evidence.append(f"the URDF writes pi short in {len(cut)} places: {cut[0].message}")
        evidence += [s.why for s in results.model.suspects]
    if noise.key == "model":
        evidence += [t.text for t in traits if t.applies and t.lint]
    return evidence
