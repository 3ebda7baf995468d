"""Which polynomial the placements of a model are in each of its joints: what a certificate rests on."""

from __future__ import annotations

import math
from fractions import Fraction

from harness.certificate.interpolation import Axis
from harness.description.joints import mapped_chain
from harness.description.model import RobotModel

LARGEST_DENOMINATOR = 12


class UncertifiableError(Exception):
    """Why no certificate can exist for a model; its text is shown in the report."""


def joint_axes(model: RobotModel) -> list[Axis]:
    """How the placements of every source depend on each model joint, (n,).

    With q_urdf = A q + b, the degree in revolute joint j is sum_i |A_ij| over the URDF joints i on the mapped chain. A
    fractional factor (a mimic multiplier) stretches the period. Raises UncertifiableError for a joint that both turns and
    slides links, or a factor that is no simple fraction.
    """
    fixed = model.configurations.fixed_q
    turning, sliding = _factors(model)
    axes = []
    for j, name in enumerate(model.table.joints):
        if turning[j] and sliding[j]:
            raise UncertifiableError(f"joint {name!r} turns some links and slides others: no polynomial of either kind")
        if sliding[j]:
            lower = min(model.configurations.lower[j], fixed[:, j].min())
            upper = max(model.configurations.upper[j], fixed[:, j].max())
            axes.append(Axis(False, 1, float(lower), float(upper)))  # slides add and never multiply
            continue
        fractions = [[Fraction(x).limit_denominator(LARGEST_DENOMINATOR) for x in side] for side in turning[j]]
        for side, exact in zip(turning[j], fractions, strict=True):
            if any(abs(x - y) > 1e-12 for x, y in zip(side, exact, strict=True)):
                raise UncertifiableError(f"joint {name!r} drives a link by a factor that is no simple fraction: {side}")
        stretch = math.lcm(*(f.denominator for side in fractions for f in side))
        degree = max(int(sum(side) * stretch) for side in fractions)
        axes.append(Axis(True, degree, 0.0, 2.0 * math.pi * stretch))
    return axes


def _factors(model: RobotModel) -> tuple[list[list[list[float]]], list[list[list[float]]]]:
    """For each model joint, the factors with which it turns, and slides, the links of each description."""
    n = len(model.table.joints)
    turning: list[list[list[float]]] = [[] for _ in range(n)]
    sliding: list[list[list[float]]] = [[] for _ in range(n)]
    for j, name in enumerate(model.table.joints):
        (turning if model.table.kind(name) == "revolute" else sliding)[j].append([1.0])
    if model.urdf is None or model.urdf_joints is None:
        return turning, sliding
    chain = mapped_chain(model.urdf, model.frames)
    for j in range(n):
        for into, prismatic in ((turning, False), (sliding, True)):
            driven = [
                abs(float(model.urdf_joints.A[row, j]))
                for row, name in enumerate(model.urdf_joints.names)
                if name in chain and (chain[name].type == "prismatic") is prismatic and model.urdf_joints.A[row, j] != 0.0
            ]
            if driven:
                into[j].append(driven)
    return turning, sliding
