"""Where two chains differ first, when no repair was found: the first joint whose screws differ."""

from __future__ import annotations

import math

import numpy as np

from harness import se3
from harness.cause.problem import Problem
from harness.kinematics.screws import Screws, chain_screws, rebuild
from harness.se3 import Array

NOTICED = 1e-9  # m or rad: a smaller difference of screws is rounding
TRIED = 8  # configurations at which a chain is compared with its own screws


def first_difference(problem: Problem, joints: tuple[str, ...], prismatic: tuple[bool, ...]) -> str:
    """What was not searched, and the first difference of the two chains, in words.

    joints, prismatic: name of each joint, and whether it slides.
    """
    remark = problem.budget.remark()
    return f"{remark}: {_first(problem, joints, prismatic)}" if remark else _first(problem, joints, prismatic)


def _first(problem: Problem, joints: tuple[str, ...], prismatic: tuple[bool, ...]) -> str:
    frame, observed, probe = problem.fitted_frames[-1], problem.observed["check"], problem.probe
    if not all(np.isfinite(T[:, frame]).all() for T in (observed.a, observed.b)):
        return "its placements are not all finite"
    chain_a, chain_b = (chain_screws(probe.stepped(T[:, frame]), list(prismatic)) for T in (observed.a, observed.b))
    misfit = _misfit(probe.sampled(observed.q), probe.sampled(observed.b[:, frame]), chain_b)
    if misfit > 1e-4:
        return f"{problem.sources[1]} does not move as a serial chain: it is {misfit:.2g} off what its own joint screws give"
    for k, (joint, S_a, S_b) in enumerate(zip(joints, chain_a.S, chain_b.S, strict=True)):
        if np.abs(S_a - S_b).max() > max(NOTICED, 2.0 * max(problem.tolerance)):
            return f"the joint screws first differ at joint {k + 1}, {joint}: {_how_far_apart(S_a, S_b)}"
    gap = se3.position_error(chain_a.M, chain_b.M) * 1e3
    return f"all joint screws are equal; at q = 0 {problem.names[frame]} is {gap:.3g} mm off: look behind the last joint"


def _misfit(q: Array, T: Array, chain: Screws) -> float:
    """Largest entry by which placements T (N, 4, 4) at q (N, n) differ from those that the chain's screws give."""
    return float(np.abs(np.array([rebuild(chain.M, chain.S, x) for x in q[:TRIED]]) - T[:TRIED]).max())


def _how_far_apart(a: Array, b: Array) -> str:
    """The difference of two screws (6,): angle between their axes, and distance of the axes' points nearest to the base."""
    w_a, w_b = a[3:], b[3:]
    if not (np.linalg.norm(w_a) > 0.5 and np.linalg.norm(w_b) > 0.5):
        return "one slides where the other turns, or along another direction"
    turn = math.degrees(math.atan2(float(np.linalg.norm(np.cross(w_a, w_b))), float(w_a @ w_b)))
    points = [np.cross(S[3:], S[:3]) / float(S[3:] @ S[3:]) for S in (a, b)]
    return f"its axis is turned by {turn:.3g} deg and stands {np.linalg.norm(points[0] - points[1]) * 1e3:.3g} mm apart"
