"""What a report shows for a source's verdict: what is proven of the files, why, reproducer, and both sides where it is worst."""

from __future__ import annotations

from typing import Any, Literal

from harness.cause.changes import Change
from harness.description.configurations import ConfigurationSet
from harness.digits import measured_bounds
from harness.report import explanation as reasons
from harness.report import proof_parts as proofs
from harness.report import source_parts as parts
from harness.report.pose import FramePair, Pose
from harness.run.outcome import Explained, Outcome, Run
from harness.theorem.prove import FrameBound

WORTH_TELLING = 1e-11  # [m]: where two descriptions differ by less is a matter of the last digits


def at(configurations: ConfigurationSet, index: int, seed: int) -> parts.At:
    """A configuration by its index, with its values."""
    return parts.At(index=index, label=configurations.label(index), q=configurations.one(seed, index).tolist())


def certificate(run: Run, outcome: Outcome) -> proofs.Certificate | None:
    """The report entry of what is proven of the descriptions that a source and the reference read."""
    certified = outcome.certified
    if certified is None:
        return None
    pairs = zip(certified.frames, certified.bounds, strict=True) if certified.bounds else ()
    frames = [_bound(run, run.model.frames.frames[index].name, bound) for index, bound in pairs]
    return proofs.Certificate(status="certified" if frames else "refused", reason=certified.reason, frames=frames)


def theorem(run: Run) -> proofs.Theorem | None:
    """The report entry of what is proven of the two descriptions."""
    if run.theorem is None:
        return None
    return proofs.Theorem(
        frames=[_bound(run, name, bound) for name, bound in run.theorem.frames.items()],
        equality={n: "offset measured" if n in run.offsets else word for n, word in run.theorem.equality.items()},
        worst={n: b.worst[0].tolist() for n, b in run.theorem.frames.items() if b.position_found > WORTH_TELLING},
        slides={joint: _range(run, joint, ends) for joint, ends in run.theorem.ranges.items()},
    )


def _range(run: Run, joint: str, ends: tuple[float, float]) -> proofs.Range:
    unit: Literal["m", "rad"] = "m" if run.model.table.kind(joint) == "prismatic" else "rad"
    return proofs.Range(lower=ends[0], upper=ends[1], unit=unit)


def _bound(run: Run, frame: str, bound: FrameBound) -> proofs.FrameBound:
    position, rotation = (bound.position_found, bound.position), (bound.rotation_found, bound.rotation)
    if frame in run.offsets:
        position, rotation = measured_bounds(*position), measured_bounds(*rotation)
    return proofs.FrameBound(
        frame=frame,
        position_upper=position[1],
        position_found=position[0],
        rotation_upper=rotation[1],
        rotation_found=rotation[0],
        slope=bound.slope,
        method=bound.method,
    )


def _change(change: Change) -> dict[str, Any]:
    return {field: getattr(change, field) for field in reasons.OneChange.model_fields}


def explanation(explained: Explained | None) -> reasons.Explanation | None:
    """The report entry of an explanation."""
    if explained is None or explained.explanation is None:
        return None if explained is None else reasons.Explanation(unexplained=explained.unexplained)
    found = explained.explanation
    changes = [
        reasons.Change(**_change(change), equivalents=[reasons.OneChange(**_change(other)) for other in others])
        for change, others in zip(found.changes, found.equivalents, strict=True)
    ]
    return reasons.Explanation(
        changes=changes,
        before_position=found.before[0],
        before_rotation=found.before[1],
        after_position=found.after[0],
        after_rotation=found.after[1],
    )


def reproducer(run: Run, outcome: Outcome) -> parts.Reproducer | None:
    """The report entry of the smallest reproducer."""
    found = outcome.reproduced
    if found is None:
        return None
    return parts.Reproducer(
        frame=run.model.frames.frames[found.frame].name,
        q=found.q.tolist(),
        position=found.position,
        rotation=found.rotation,
        reference_placement=found.T_reference.tolist(),
        source_placement=found.T_source.tolist(),
    )


def pose(run: Run, outcome: Outcome) -> Pose | None:
    """The report entry of both sides at the worst configuration."""
    found = outcome.worst
    if found is None:
        return None
    frames = run.model.frames.frames
    pairs = [FramePair(frame=frames[i].name, reference=a.tolist(), source=b.tolist()) for i, (a, b) in found.placements.items()]
    where = at(run.model.configurations, found.index, run.options.seed)
    return Pose(at=where, frame=frames[found.frame].name, frames=pairs)
