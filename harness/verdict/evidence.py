"""What a report shows for a source's verdict: certificate, explanation, reproducer, and both sides where it is worst."""

from __future__ import annotations

import math
from typing import Any

from harness.cause.changes import Change
from harness.description.configurations import ConfigurationSet
from harness.report import explanation as reasons
from harness.report import source_parts as parts
from harness.report.pose import FramePair, Pose
from harness.run.outcome import Explained, Outcome, Run


def at(configurations: ConfigurationSet, index: int, seed: int) -> parts.At:
    """A configuration by its index, with its values."""
    return parts.At(index=index, label=configurations.label(index), q=configurations.one(seed, index).tolist())


def certificate(run: Run, outcome: Outcome) -> parts.Certificate | None:
    """The report entry of a source's certificate."""
    certified = outcome.certified
    if certified is None:
        return None
    bounds, position, rotation = certified.bounds, certified.position_found, certified.rotation_found
    frames = []
    if bounds is not None and position is not None and rotation is not None:
        frames = [
            parts.FrameBound(
                frame=run.model.frames.frames[index].name,
                position_upper=float(bounds.position[i]),
                position_found=float(position[i]),
                rotation_upper=float(bounds.rotation[i]),
                rotation_found=float(rotation[i]),
                method=bounds.method[i],
            )
            for i, index in enumerate(certified.frames)
        ]
    return parts.Certificate(
        status="certified" if frames else "refused",
        reason=certified.reason,
        form=certified.form,
        nodes=certified.nodes,
        residual=_finite(certified.residual),
        reference_residual=_finite(certified.reference_residual),
        limit=_finite(certified.limit),
        frames=frames,
    )


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


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
