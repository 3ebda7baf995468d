"""One source's part of the report: its verdict, its frames, traits, noise class and evidence."""

from __future__ import annotations

import contextlib
from typing import TypedDict

from harness.digits import coordinate
from harness.engines.base import Refusal, Trait
from harness.engines.registry import adapter_of
from harness.errors import CrosscheckError, EngineUnavailable, InputError
from harness.report import document as doc
from harness.report import proof_parts as proofs
from harness.report import source_parts as parts
from harness.report.explanation import Explanation
from harness.report.pose import Pose
from harness.report.tested_parts import Tested
from harness.report.verdicts import SourceVerdict, Verdict
from harness.run.binding import Bound
from harness.run.outcome import Outcome, Run, Status
from harness.verdict.evidence import at, certificate, explanation, pose, reproducer
from harness.verdict.frame_part import frame_results
from harness.verdict.judge import judge_source
from harness.verdict.noise import CLASSES, NoiseClass, classify
from harness.verdict.tested_part import judge_tested, tested_part

FLOAT64 = CLASSES[0]


class _Result(TypedDict, total=False):
    """The fields of a source's entry that its result decides."""

    status: Status
    verdict: SourceVerdict
    reason: str
    validity: parts.Validity
    frames: list[parts.FrameResult]
    worst_frame: str
    first_disagreeing_frame: str
    noise: str
    noise_text: str
    explained_by: list[str]
    explanation: Explanation | None
    reproducer: parts.Reproducer | None
    pose: Pose | None
    certificate: proofs.Certificate | None
    tested: Tested | None


class _Given(TypedDict, total=False):
    """The fields that say what a source was asked and given."""

    joints: list[str]
    held: list[str]
    mimic: str
    read_in: str
    absent: list[str]


def assemble_source(run: Run, outcome: Outcome) -> doc.Source:
    """The report entry of one source."""
    planned = outcome.planned
    tolerance = run.tolerance(outcome)
    traits = _traits(run, planned.name)
    result: _Result = {"status": outcome.status, "verdict": Verdict.NOT_RUN, "reason": outcome.reason}
    result.update(_result(run, outcome, traits))
    return doc.Source(
        name=planned.name,
        required=planned.required,
        reference=outcome is run.reference,
        install=outcome.install,
        tolerance=parts.Tolerance(position=tolerance[0], rotation=tolerance[1]),
        floor=_floor(run, (planned.name, run.reference.name)),
        traits=traits,
        **_given(outcome.bound),
        **result,
    )


def _floor(run: Run, names: tuple[str, str]) -> float:
    """What rounding alone may change, in float64 or in what an engine computes in, if that is coarser [m, rad]."""
    reach = coordinate(run.comparison.reach) if run.comparison else 0.0
    floor = FLOAT64.limit * (1.0 + reach)
    for name in names:
        with contextlib.suppress(EngineUnavailable, InputError):  # a program, or a broken adapter that says so itself
            floor = max(floor, adapter_of(name).resolution)
    return floor


def _result(run: Run, outcome: Outcome, traits: list[parts.TraitNote]) -> _Result:
    """What became of the source: it did not run, it is the reference, or it was compared."""
    if outcome.bound is None:
        return {"verdict": Verdict.FAILED if outcome.status == "failed" else Verdict.NOT_RUN}
    if run.comparison is None:
        return {"status": "not run", "reason": "not compared: the reference did not run"}
    validity = _validity(run, outcome, outcome.bound)
    if outcome is run.reference:
        own = judge_tested(run, outcome, {}, _misreads(outcome.name, traits))
        judged = judge_source([], run.comparison.validity[outcome.name], own)
        verdict = Verdict.REFERENCE if judged is Verdict.AGREES else judged
        return {
            "validity": validity,
            "verdict": verdict,
            "tested": tested_part(run, outcome, {}, _misreads(outcome.name, traits)),
        }
    return {"validity": validity, **_compared(run, outcome, traits)}


def _compared(run: Run, outcome: Outcome, traits: list[parts.TraitNote]) -> _Result:
    """The frames of a source that was compared, and the verdict that follows from them."""
    tolerance, comparison = run.tolerance(outcome), run.discrepancies()
    proven = certificate(run, outcome)
    frames = frame_results(run, outcome, proven)
    if not frames:
        reason = f"has no frame in common with {run.reference.name}"
        return {"status": "failed", "verdict": Verdict.FAILED, "reason": reason}
    failing = [f for f in frames if f.verdict.disagrees]
    worst = max(frames, key=lambda f: max(f.position.max / tolerance[0], f.rotation.max / tolerance[1]))
    by_name, misreads = {f.frame: f.verdict for f in frames}, _misreads(outcome.name, traits)
    own = judge_tested(run, outcome, by_name, misreads)
    noise = classify(max(f.position.max for f in frames), max(f.rotation.max for f in frames), comparison.reach)
    return {
        "verdict": judge_source([f.verdict for f in frames], comparison.validity[outcome.name], own),
        "frames": frames,
        "worst_frame": worst.frame,
        "first_disagreeing_frame": failing[0].frame if failing else "",
        "noise": noise.key,
        "noise_text": noise.text,
        "explained_by": _evidence(run, _recorded(outcome.name), traits, noise),
        "explanation": explanation(outcome.explained),
        "reproducer": reproducer(run, outcome),
        "pose": pose(run, outcome),
        "certificate": proven,
        "tested": tested_part(run, outcome, by_name, misreads),
    }


def _validity(run: Run, outcome: Outcome, bound: Bound) -> parts.Validity:
    seen = run.discrepancies().validity[outcome.name]
    configurations, seed, first = run.model.configurations, run.options.seed, seen.first
    return parts.Validity(
        checked=seen.checked,
        invalid=seen.invalid,
        residual=seen.residual,
        first=at(configurations, first[0], seed) if first else None,
        first_frame=bound.frames[first[1]] if first else "",
        again=seen.again,
        again_at=at(configurations, seen.again_at, seed) if seen.again_at >= 0 else None,
    )


def _recorded(source: str) -> tuple[Trait, ...]:
    try:
        return adapter_of(source).traits
    except CrosscheckError:  # a broken adapter has none to show; its problem is the source's reason
        return ()


def _traits(run: Run, source: str) -> list[parts.TraitNote]:
    codes = {finding.code for finding in run.model.findings}
    return [
        parts.TraitNote(key=t.key, text=t.text, evidence=t.evidence, lint=t.lint or "", applies=t.lint is None or t.lint in codes)
        for t in _recorded(source)
    ]


def _misreads(source: str, traits: list[parts.TraitNote]) -> bool:
    """Whether the engine is known to read a URDF like this one otherwise than its specification says."""
    refusals = {t.key for t in _recorded(source) if isinstance(t, Refusal)}
    return any(t.applies and t.lint and t.key not in refusals for t in traits)


def _given(bound: Bound | None) -> _Given:
    """Joints and frames of the engine; what it was given for mimic followers, and which joints were held at zero."""
    if bound is None:
        return {}
    given: _Given = {
        "joints": list(bound.engine.joints),
        "read_in": bound.read_in,
        "absent": list(bound.absent),
        "held": [j for j in bound.joint_map.held if j in bound.engine.joints],
    }
    if followers := bound.joint_map.followers:
        passed = [j for j in followers if j in bound.engine.joints]
        applied = [j for j in followers if j not in bound.engine.joints]
        texts = [f"passed multiplier * q + offset for {', '.join(passed)}"] if passed else []
        texts += [f"the engine itself moves {', '.join(applied)}"] if applied else []
        given["mimic"] = "; ".join(texts)
    return given


def _evidence(run: Run, recorded: tuple[Trait, ...], traits: list[parts.TraitNote], noise: NoiseClass) -> list[str]:
    """What is known about this engine or this URDF that would make a discrepancy of this class."""
    evidence = [t.text for t in traits if t.applies and noise.key == "float32" and t.key.startswith("float32")]
    if noise.key.startswith("pi-"):
        cut = [f for f in run.model.findings if f.code == "truncated-pi"]
        if cut:
            evidence.append(f"the URDF writes pi short in {len(cut)} places: {cut[0].message}")
        evidence += [s.why for s in run.model.suspects]
    if noise.key == "model":
        refusals = {t.key for t in recorded if isinstance(t, Refusal)}  # an engine that gave placements has not refused
        evidence += [t.text for t in traits if t.applies and t.lint and t.key not in refusals]
    return evidence
