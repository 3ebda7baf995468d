"""Where two chains part, when no repair was found: the first joint whose screw differs."""

from __future__ import annotations

import math

import numpy as np

from harness import se3
from harness.cause.problem import Problem
from harness.kinematics.screws import finite_steps, log, rebuild
from harness.se3 import Array

NOTICED = 1e-9


def first_difference(problem: Problem, joints: tuple[str, ...], prismatic: tuple[bool, ...]) -> str:
    """In words. problem.check must end with q = 0 and one step of each joint, as `explaining.configurations` makes it."""
    n, frame = len(joints), problem.fitted[-1]
    steps = finite_steps(prismatic)
    chains = []
    for T in (problem.check.a, problem.check.b):
        placed = T[:, frame]
        if not np.isfinite(placed).all():
            return "its placements are not all finite"
        M = placed[-n - 1]
        S = np.array([log(placed[i - n] @ se3.inverse(M)) / steps[i] for i in range(n)])
        chains.append((M, S))
    misfit = _misfit(problem.check.q[: -n - 1], problem.check.b[: -n - 1, frame], *chains[1])
    if misfit > 1e-4:
        return f"{problem.sources[1]} does not move as a serial chain: it is {misfit:.2g} off what its own joint screws give"
    (M_a, S_a), (M_b, S_b) = chains
    for k, joint in enumerate(joints):
        if np.abs(S_a[k] - S_b[k]).max() > max(NOTICED, 2.0 * max(problem.tolerance)):
            return f"the joint screws first differ at joint {k + 1}, {joint}: {_apart(S_a[k], S_b[k])}"
    gap = se3.position_error(M_a, M_b) * 1e3
    return f"all joint screws are equal; at q = 0 {problem.names[frame]} is {gap:.3g} mm off: look behind the last joint"


def _misfit(q: Array, T: Array, M: Array, S: Array) -> float:
    return float(np.abs(np.array([rebuild(M, S, x) for x in q[:8]]) - T[:8]).max())


def _apart(a: Array, b: Array) -> str:
    """How far apart two screws are, as turn of the axis and distance of their points nearest to the base."""
    w_a, w_b = a[3:], b[3:]
    if not (np.linalg.norm(w_a) > 0.5 and np.linalg.norm(w_b) > 0.5):
        return "one slides where the other turns, or along another direction"
    turn = math.degrees(math.atan2(float(np.linalg.norm(np.cross(w_a, w_b))), float(w_a @ w_b)))
    points = [np.cross(S[3:], S[:3]) / float(S[3:] @ S[3:]) for S in (a, b)]
    return f"its axis is turned by {turn:.3g} deg and stands {np.linalg.norm(points[0] - points[1]) * 1e3:.3g} mm apart"
