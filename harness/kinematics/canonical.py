"""Canonical DH parameters of a mechanism, from its joint screws: the table, whatever format the mechanism came from.

Consecutive axes have a common normal; the frames of either convention lie on it (Siciliano et al., "Robotics", section 2.8.2;
Craig, section 3.4). Where the normal is not unique, parallel axes or a prismatic joint's free position, a choice is made and
named as a free direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness import se3
from harness.description.dh import Convention, DHRow
from harness.kinematics.screws import Screws
from harness.se3 import Array

PARALLEL = 1e-8
NEAR_PARALLEL = 1e-3
ON = 1e-9


@dataclass(frozen=True)
class Canonical:
    """A DH table that was computed.

    rows: one for each joint.
    base, tool: transforms (4, 4) [m].
    free: in words, the directions that the mechanism leaves open and that were chosen.
    """

    rows: tuple[DHRow, ...]
    base: Array
    tool: Array
    free: tuple[str, ...]


@dataclass(frozen=True)
class _Axis:
    """A joint axis at q = 0: unit direction z, a point on it, and whether the joint slides."""

    z: Array
    point: Array
    prismatic: bool


def canonical(
    screws: Screws, prismatic: list[bool], convention: Convention, names: list[str], parallel: float = PARALLEL
) -> Canonical:
    """DH parameters of the chain. Raises ValueError if a screw is no joint's (a helical or zero twist).

    screws: of the chain.
    prismatic, names: for each joint whether it slides, and its name.
    convention: of the table that is wanted.
    parallel: sine of the angle below which two axes have no common normal of their own.
    """
    axes = _axes(screws, prismatic, names)
    free = [f"{name} slides: its axis may stand anywhere" for name, slides in zip(names, prismatic, strict=True) if slides]
    frames = _frames(axes, screws.M, convention, names, free, parallel)
    row = _standard_row if convention == "standard" else _modified_row
    rows = [
        row(name, se3.inverse(frames[i]) @ frames[i + 1], axis.prismatic)
        for i, (name, axis) in enumerate(zip(names, axes, strict=True))
    ]
    return Canonical(tuple(rows), frames[0], se3.inverse(frames[-1]) @ screws.M, tuple(free))


def _axes(screws: Screws, prismatic: list[bool], names: list[str]) -> list[_Axis]:
    axes: list[_Axis] = []
    at = np.zeros(3)
    for name, S, slides in zip(names, screws.S, prismatic, strict=True):
        v, w = S[:3], S[3:]
        size = float(np.linalg.norm(v if slides else w))
        if abs(size - 1.0) > 1e-6 or (slides and np.linalg.norm(w) > 1e-9):
            raise ValueError(f"joint {name!r} moves by {size:.6g} a unit of q, not by 1: no DH row does that")
        if slides:
            axes.append(_Axis(v / size, at, True))
            continue
        if abs(v @ w) > 1e-9:
            raise ValueError(f"joint {name!r} is helical: it slides {v @ w:.3g} m a radian along its axis")
        z = w / size
        point = np.cross(z, v / size)  # the point of the axis nearest to the base origin
        at = point
        axes.append(_Axis(z, point, False))
    return axes


def _frame(x: Array, z: Array, origin: Array) -> Array:
    T = np.eye(4)
    T[:3, 0], T[:3, 2], T[:3, 3] = x, z, origin
    T[:3, 1] = np.cross(z, x)
    return T


def _across(z: Array, wish: Array) -> Array:
    """The unit vector across z nearest to `wish`; some vector across z if `wish` is along it."""
    for candidate in (wish, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])):
        x = candidate - (candidate @ z) * z
        if np.linalg.norm(x) > 1e-6:
            return np.asarray(x / np.linalg.norm(x))
    raise ValueError("no direction across the axis")


def _normal(
    first: _Axis, second: _Axis, near: Array, x: Array, free: list[str], names: tuple[str, str], parallel: float
) -> tuple[Array, Array, Array]:
    """Common normal of two axes: unit direction, its foot on the first and on the second.

    near: a point. Parallel axes have many common normals: the one through this point is taken.
    x: the previous x axis, which decides the sign.
    free: gets a text if the normal is not unique.
    names: of both joints.
    parallel: sine of the angle below which the axes count as parallel.
    """
    cross = np.cross(first.z, second.z)
    sine = float(np.linalg.norm(cross))
    if sine < parallel:
        foot = first.point + ((near - first.point) @ first.z) * first.z
        other = second.point + ((foot - second.point) @ second.z) * second.z
        across = other - foot
        across = across - (across @ first.z) * first.z
        direction = across / np.linalg.norm(across) if np.linalg.norm(across) > ON else _across(first.z, x)
        if not (first.prismatic or second.prismatic):
            free.append(f"{names[0]} and {names[1]} are parallel: d may slide along them")
    else:
        if sine < NEAR_PARALLEL:
            free.append(f"{names[0]} and {names[1]} are parallel to within {sine:.1e} rad: d is ill-determined")
        direction = cross / sine
        between = second.point - first.point
        # between = s z1 + t direction - u z2, solved by its triple products.
        s = float(np.cross(between, second.z) @ direction) / sine
        u = float(np.cross(between, first.z) @ direction) / sine
        foot, other = first.point + s * first.z, second.point + u * second.z
    if direction @ x < -1e-9 or (abs(direction @ x) <= 1e-9 and direction[np.abs(direction).argmax()] < 0):
        direction = -direction
    return direction, foot, other


def _start(axis: _Axis) -> Array:
    """Frame 0 on the first axis: the base frame itself where it fits, else as near to it as can be."""
    origin = axis.point - (axis.point @ axis.z) * axis.z if not axis.prismatic else np.zeros(3)
    return _frame(_across(axis.z, np.array([1.0, 0.0, 0.0])), axis.z, origin)


def _shifted(axis: _Axis, near: Array) -> _Axis:
    """A prismatic axis has no position of its own: put it through a point."""
    return _Axis(axis.z, near, True) if axis.prismatic else axis


def _frames(
    axes: list[_Axis], M: Array, convention: Convention, names: list[str], free: list[str], parallel: float
) -> list[Array]:
    """Frames 0 ... n at q = 0, each x on the common normal of two neighbouring axes, at its foot on one of them.

    Standard: z_(i-1) along joint i's axis, frame i on axis i + 1. Modified: z_i along it, frame i on axis i.
    """
    frames = [_start(axes[0])]
    current = _shifted(axes[0], frames[0][:3, 3])
    for i in range(len(axes) - 1):
        near, x = frames[-1][:3, 3], frames[-1][:3, 0]
        following = _shifted(axes[i + 1], near)
        x, first, second = _normal(current, following, near, x, free, (names[i], names[i + 1]), parallel)
        frames.append(_frame(x, following.z, second) if convention == "standard" else _frame(x, current.z, first))
        current = following
    return [*frames, _last(current, M, convention)]


def _last(axis: _Axis, M: Array, convention: Convention) -> Array:
    """Frame n: the tip itself if a standard row can reach it, else on the last axis abreast of the tip."""
    x, p = M[:3, 0], M[:3, 3]
    foot = axis.point + ((p - axis.point) @ axis.z) * axis.z
    if convention == "standard" and abs(x @ axis.z) < ON and np.linalg.norm(np.cross(x, p - foot)) < ON:
        return M
    return _frame(_across(axis.z, x), axis.z, foot)


def _standard_row(name: str, A: Array, prismatic: bool) -> DHRow:
    theta, alpha = math.atan2(A[1, 0], A[0, 0]), math.atan2(A[2, 1], A[2, 2])
    a = float(A[0, 3] * math.cos(theta) + A[1, 3] * math.sin(theta))
    return DHRow(name=name, kind="prismatic" if prismatic else "revolute", a=a, alpha=alpha, d=float(A[2, 3]), theta=theta)


def _modified_row(name: str, A: Array, prismatic: bool) -> DHRow:
    theta, alpha = math.atan2(-A[0, 1], A[0, 0]), math.atan2(-A[1, 2], A[2, 2])
    d = float(A[2, 3] * math.cos(alpha) - A[1, 3] * math.sin(alpha))
    return DHRow(name=name, kind="prismatic" if prismatic else "revolute", a=float(A[0, 3]), alpha=alpha, d=d, theta=theta)
