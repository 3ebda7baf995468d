"""Rigid transforms as 4x4 matrices: constructors, inverse and the two discrepancies.

`T_a_b` maps coordinates in frame b to frame a. All functions broadcast over leading axes, (..., 4, 4), in metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

# What is asked of every source's placements, in a run and by `crosscheck worker-check` alike:
RIGID = 1e-6  # the largest entry of R'R - I, or error of the last row 0 0 0 1, of a rigid transform
REPEATED = 1e-9  # the largest change of an entry when it is asked for again: batches round differently from single rows

CANCELLED = 1e-3  # the sum of the two smaller singular values of a mean rotation, of which the larger are at most 1
QUARTER_TURN = math.pi / 2
_CHORD = 2.0 * math.sqrt(2.0)  # of half a turn


def sincos(angle: float) -> tuple[float, float]:
    """Sine and cosine of one angle [rad], exact at multiples of pi/2.

    The double nearest to pi/2 stands for a right angle in a table; its floating-point cosine, 6e-17, is an artefact.
    """
    quarters = round(angle / QUARTER_TURN)
    if angle == quarters * QUARTER_TURN and abs(quarters) <= 4:
        return (0.0, 1.0, 0.0, -1.0)[quarters % 4], (1.0, 0.0, -1.0, 0.0)[quarters % 4]
    return math.sin(angle), math.cos(angle)


def translation(xyz: Sequence[float]) -> Array:
    """Pure translation by `xyz` [m], shape (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = xyz
    return T


def rotation(axis: str, angle: float) -> Array:
    """Rotation by `angle` [rad] about the x, y or z axis, shape (4, 4)."""
    s, c = sincos(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = np.eye(4)
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def from_xyz_rpy(xyz: Sequence[float], rpy: Sequence[float]) -> Array:
    """Transform of a URDF `<origin>`: translation [m], then R = Rz(yaw) Ry(pitch) Rx(roll) [rad]. Shape (4, 4)."""
    roll, pitch, yaw = rpy
    return translation(xyz) @ rotation("z", yaw) @ rotation("y", pitch) @ rotation("x", roll)


def to_rpy(T: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of one transform, accurate also next to pitch = +-pi/2, where yaw is set to zero.

    There only roll -+ yaw is defined: roll is taken from what yaw has left, so that an error of yaw cancels.
    """
    R = T[:3, :3]
    level = math.hypot(R[0, 0], R[1, 0])
    yaw = math.atan2(R[1, 0], R[0, 0]) if level > 1e-11 else 0.0
    s, c = math.sin(yaw), math.cos(yaw)
    pitch = math.atan2(-R[2, 0], level)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return roll, pitch, yaw


def inverse(T: Array) -> Array:
    """`T_b_a` from `T_a_b`, shape (..., 4, 4), using that the rotation is orthogonal."""
    out = np.zeros_like(T)
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    out[..., :3, :3] = R_t
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R_t, T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def position_error(T_a: Array, T_b: Array) -> Array:
    """Distance between the origins [m], shape (...)."""
    return np.asarray(np.linalg.norm(T_a[..., :3, 3] - T_b[..., :3, 3], axis=-1))


def rotation_error(T_a: Array, T_b: Array) -> Array:
    """Angle of the relative rotation [rad] in [0, pi], shape (...).

    From the chord, 2 arcsin(|R_a - R_b|_F / (2 sqrt 2)): resolves to 1e-16, where arccos of the trace stops at 1.5e-8
    (Huynh 2009, "Metrics for 3D rotations", doi:10.1007/s10851-009-0161-2).
    """
    chord = np.linalg.norm(T_a[..., :3, :3] - T_b[..., :3, :3], axis=(-2, -1))
    return chord_angle(np.asarray(chord))


def chord_angle(chord: Array) -> Array:
    """Angle [rad] of two rotations that are a Frobenius distance `chord` apart; see `rotation_error`."""
    return np.asarray(2.0 * np.arcsin(np.minimum(1.0, chord / _CHORD)))


def mean_transform(T: Array) -> Array:
    """Mean of transforms (..., 4, 4), the rotation in the chordal sense (Moakher 2002, doi:10.1137/S0895479801383877).

    Rotations that cancel out have no mean: all are as far from it. The first of them is taken then, not what rounding leaves.
    """
    mean = T.reshape(-1, 4, 4).mean(axis=0)
    U, sizes, Vt = np.linalg.svd(mean[:3, :3])
    turn = np.sign(np.linalg.det(U @ Vt))
    if sizes[1] + turn * sizes[2] < CANCELLED:
        mean[:3, :3] = T.reshape(-1, 4, 4)[0, :3, :3]
    else:
        mean[:3, :3] = U @ np.diag([1.0, 1.0, turn]) @ Vt
    return np.asarray(mean)
