"""What is proven of the two descriptions of a run, and for which sources it counts.

The theorem speaks of the files. A source reads one of them, the reference one too; the bound of their difference is shown beside
the source as long as the source was not seen to compute something else (`harness.run.probing`).
"""

from __future__ import annotations

import math

import numpy as np

from harness.description.joints import within_travel
from harness.description.model import RobotModel
from harness.engines.registry import kind_of
from harness.run.outcome import Certified, Outcome, Run
from harness.theorem.descriptions import of_model
from harness.theorem.prove import FrameBound
from harness.theorem.statement import theorem


def prove_all(run: Run) -> None:
    """The theorem of the run's two descriptions, and what it says of every source that was compared."""
    if run.model.urdf is not None:
        chains = of_model(run.model, run.rigid_transforms)
        run.theorem = theorem(chains["dh"], chains["urdf"], slides_of(run.model))
    for outcome in run.compared:
        outcome.certified = _certified(run, outcome)


def slides_of(model: RobotModel) -> dict[str, tuple[float, float]]:
    """The range of each joint that slides something, lower and upper end [m, or rad of one that turns and slides].

    Its limits, and what fixed configurations take; those of a slide within `joints.TRAVEL`.
    """
    law, ranges = model.configurations, {}
    lowest = np.minimum(law.lower, law.fixed_q.min(axis=0, initial=math.inf))
    highest = np.maximum(law.upper, law.fixed_q.max(axis=0, initial=-math.inf))
    lower, upper = within_travel(lowest, highest)
    for j, joint in enumerate(model.table.joints):
        slides = model.table.kind(joint) == "prismatic"
        if slides or _drives_a_slide(model, j):
            ends = (lower[j], upper[j]) if slides else (lowest[j], highest[j])
            ranges[joint] = (float(ends[0]), float(ends[1]))
    return ranges


def _drives_a_slide(model: RobotModel, joint: int) -> bool:
    """Whether a joint moves a slide of the URDF: a screw, or a slide that follows it."""
    if model.urdf is None or model.urdf_joints is None:
        return False
    driven = zip(model.urdf_joints.names, model.urdf_joints.A[:, joint], strict=True)
    return any(factor and model.urdf.joints[name].type == "prismatic" for name, factor in driven)


def _certified(run: Run, outcome: Outcome) -> Certified:
    """The bounds of what a source and the reference read, at the mapped frames that both have."""
    have = outcome.running().view.available
    frames = [f for f in run.reference.running().view.available if f in have]
    names = [run.model.frames.frames[f].name for f in frames]
    if kind_of(outcome.name) == kind_of(run.reference.name):
        return Certified(frames=frames, bounds=tuple(_same(run) for _ in frames))
    if run.theorem is None:
        return Certified(reason="there is no second description")
    proven = {i: run.theorem.frames[name] for i, name in zip(frames, names, strict=True) if name in run.theorem.frames}
    if not proven:
        return Certified(reason="no frame that it has is in both descriptions")
    return Certified(frames=list(proven), bounds=tuple(proven.values()))


def _same(run: Run) -> FrameBound:
    """Two sources of one description: nothing to be proven."""
    q = np.zeros((2, len(run.model.table.joints)))
    return FrameBound(position=0.0, rotation=0.0, position_found=0.0, rotation_found=0.0, slope=0.0, method="constant", worst=q)
