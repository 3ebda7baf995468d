"""What the report says of one source at each mapped frame, and the verdict there."""

from __future__ import annotations

from dataclasses import dataclass

from harness.cause.changes import Change
from harness.comparison.compare import Comparison
from harness.comparison.statistics import Stream
from harness.description.frames import MappedFrame
from harness.report import proof_parts as proofs
from harness.report import source_parts as parts
from harness.report.verdicts import FrameVerdict, Verdict
from harness.run.outcome import Outcome, Run
from harness.verdict.deviations import cause_on_file, deviation_on_file
from harness.verdict.evidence import at
from harness.verdict.judge import Deviation, judge
from harness.verdict.noise import classify


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """One source at one mapped frame, before the verdict.

    frame: the mapped frame.
    position, rotation: statistics of its discrepancies [m], [rad].
    proven: what is proven there of the descriptions that it and the reference read, if that counts.
    accepted: the deviation on file and its reason, if there is one.
    """

    frame: MappedFrame
    position: parts.Statistics
    rotation: parts.Statistics
    proven: proofs.FrameBound | None
    accepted: tuple[Deviation, str] | None = None


def frame_results(run: Run, outcome: Outcome, proven: proofs.Certificate | None) -> list[parts.FrameResult]:
    """One source at every mapped frame that both it and the reference should have."""
    ends = (outcome.running(), run.reference.running())
    indices = [i for i in range(len(run.model.frames.frames)) if all(end.should_have(i) for end in ends)]
    comparison = run.discrepancies()
    seen = [_seen(run, outcome, i, proven) for i in indices]
    verdicts = _as_caused(run, outcome, [_verdict(run, outcome, one) for one in seen])
    return [_result(one, verdict, comparison) for one, verdict in zip(seen, verdicts, strict=True)]


def _seen(run: Run, outcome: Outcome, index: int, proven: proofs.Certificate | None) -> _Seen:
    comparison, frame = run.discrepancies(), run.model.frames.frames[index]
    return _Seen(
        frame=frame,
        position=_statistics(run, comparison.position[outcome.name], index),
        rotation=_statistics(run, comparison.rotation[outcome.name], index),
        proven=next((b for b in proven.frames if b.frame == frame.name), None) if proven else None,
        accepted=deviation_on_file(run.model, outcome.name, run.reference.name, frame.name),
    )


def _verdict(run: Run, outcome: Outcome, seen: _Seen) -> FrameVerdict:
    # A frame that was never compared cannot agree: not one finite pair of placements was seen.
    if not seen.position.count:
        return Verdict.NOT_COMPARED
    tolerance, bound = run.tolerance(outcome), seen.proven
    # What was found of the two descriptions counts like what the samples have shown: both were evaluated.
    position = max(seen.position.max, bound.position_found if bound else 0.0)
    rotation = max(seen.rotation.max, bound.rotation_found if bound else 0.0)
    verdict = judge(position, rotation, tolerance, seen.accepted[0] if seen.accepted else None)
    if verdict is Verdict.AGREES and run.model.file.gate == "certified":
        holds = bound is not None and bound.position_upper <= tolerance[0] and bound.rotation_upper <= tolerance[1]
        return Verdict.AGREES if holds else Verdict.NOT_CERTIFIED
    return verdict


def _as_caused(run: Run, outcome: Outcome, verdicts: list[FrameVerdict]) -> list[FrameVerdict]:
    """Accepted frames whose deviation is of the size on file, but has another cause, or one more: changed."""
    on_file = cause_on_file(run.model, outcome.name, run.reference.name)
    if not on_file or not run.options.explain or Verdict.ACCEPTED not in verdicts:
        return verdicts
    tolerance = max(run.tolerance(outcome))
    explanation = outcome.explained.explanation if outcome.explained else None
    changes = zip(explanation.changes, explanation.equivalents, strict=True) if explanation else ()
    slots = [(change, *others) for change, others in changes]
    # What is below the tolerance of this source is not its to tell.
    slots = [slot for slot in slots if slot[0].kind != "parameter" or abs(slot[0].size) > tolerance]

    def as_filed(slot: tuple[Change, ...]) -> bool:
        pairs = ((c.size, on_file.get((c.subject, c.parameter))) for c in slot if c.kind == "parameter")
        return any(size is not None and abs(found - size) <= 2.0 * tolerance for found, size in pairs)

    if len(slots) == len(on_file) and all(as_filed(slot) for slot in slots):
        return verdicts
    return [Verdict.DEVIATION_CHANGED if verdict is Verdict.ACCEPTED else verdict for verdict in verdicts]


def _result(seen: _Seen, verdict: FrameVerdict, comparison: Comparison) -> parts.FrameResult:
    accepted = None
    if seen.accepted:
        deviation, reason = seen.accepted
        accepted = parts.Accepted(
            position=deviation.position, rotation=deviation.rotation, within=deviation.within, reason=reason
        )
    return parts.FrameResult(
        frame=seen.frame.name,
        verdict=verdict,
        position=seen.position,
        rotation=seen.rotation,
        noise=classify(seen.position.max, seen.rotation.max, comparison.reach).key,
        accepted=accepted,
    )


def _statistics(run: Run, stream: Stream, index: int) -> parts.Statistics:
    count = int(stream.count[index])
    return parts.Statistics(
        count=count,
        max=max(float(stream.max[index]), 0.0),
        mean=stream.mean(index),
        p50=stream.quantile(index, 0.50),
        p95=stream.quantile(index, 0.95),
        p99=stream.quantile(index, 0.99),
        decades={str(k): v for k, v in stream.decades(index).items()},
        worst=at(run.model.configurations, int(stream.argmax[index]), run.options.seed) if count else None,
    )
