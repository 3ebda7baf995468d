"""What a mechanism is, whatever it came from: joint screws from n + 1 placements, and the chain they rebuild.

Product of exponentials (Murray, Li & Sastry, "A Mathematical Introduction to Robotic Manipulation", section 3.2.2):
    T(q) = exp(S_1 q_1) ... exp(S_n q_n) M,   M = T(0),   S_i = log(T(delta e_i) M^-1) / delta
The step is finite, not infinitesimal: for a joint it is exact. Twists are linear part first, (v, omega), in the base frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from harness import se3
from harness.se3 import Array

# q (N, n) to the placement of one frame, (N, 4, 4).
Chain: TypeAlias = Callable[[Array], Array]

ANGLE_STEP, LENGTH_STEP = 1.0, 0.1


@dataclass(frozen=True)
class Screws:
    """The joint screws of a chain.

    M: placement of the tip at q = 0, (4, 4) [m].
    S: twist of each joint a unit of q, (n, 6), linear part first.
    residual: largest entry by which the rebuilt chain differs from the original at random configurations; 0 if not tried.
    """

    M: Array
    S: Array
    residual: float


def skew(w: Array) -> Array:
    """Cross-product matrix, (3,) -> (3, 3)."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def exp(S: Array, q: float) -> Array:
    """exp(S q) for a twist S (6,), linear part first: (4, 4). Rodrigues' formula; a pure translation if omega is zero."""
    v, w = S[:3] * q, S[3:] * q
    T, angle = np.eye(4), float(np.linalg.norm(w))
    if angle < 1e-12:
        T[:3, 3] = v
        T[:3, :3] += skew(w)
        return T
    K = skew(w / angle)
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    T[:3, :3] += s * K + c * K @ K
    T[:3, 3] = (np.eye(3) + c / angle * K + (1.0 - s / angle) * K @ K) @ v
    return T


def log(T: Array) -> Array:
    """Twist (6,) with exp(log(T)) = T, for rotations below pi; linear part first."""
    R, p = T[:3, :3], T[:3, 3]
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    s, c = float(np.linalg.norm(vector)), (np.trace(R) - 1.0) / 2.0
    angle = math.atan2(s, c)
    if angle < 1e-12:
        return np.concatenate([p, vector])
    axis = vector / s if s > 1e-9 else np.zeros(3)
    K = skew(axis)
    half = angle / 2.0
    V_inverse = np.eye(3) - half * K + (1.0 - half / math.tan(half)) * K @ K
    return np.concatenate([V_inverse @ p, axis * angle])


def finite_steps(prismatic: Sequence[bool]) -> Array:
    """The step (n,) of each joint from which its screw is read [rad or m]."""
    return np.where(prismatic, LENGTH_STEP, ANGLE_STEP)


def step_configurations(prismatic: Sequence[bool]) -> Array:
    """The configurations from which screws are read, (n + 1, n): zero, then one finite step of each joint [rad or m]."""
    return np.concatenate([np.zeros((1, len(prismatic))), np.diag(finite_steps(prismatic))])


def chain_screws(T: Array, prismatic: list[bool]) -> Screws:
    """Joint screws from placements at the step configurations. Whether they rebuild the chain elsewhere is not tried.

    T: placements of the tip at `step_configurations`, (n + 1, 4, 4).
    prismatic: for each joint whether it slides.
    """
    steps = finite_steps(prismatic)
    S = np.array([log(T[i + 1] @ se3.inverse(T[0])) / steps[i] for i in range(len(prismatic))]).reshape(-1, 6)
    return Screws(T[0], S, 0.0)


def screws(chain: Chain, prismatic: list[bool], rng: np.random.Generator) -> Screws:
    """Joint screws of a chain of which only placements are known, and how well they rebuild it.

    chain: from q (N, n) to placements of the tip, (N, 4, 4).
    prismatic: for each joint whether it slides (its step is then 0.1 m, else 1 rad).
    rng: draws the 16 configurations at which the rebuilt chain is compared.
    """
    read = chain_screws(chain(step_configurations(prismatic)), prismatic)
    q = rng.uniform(-3.0, 3.0, (16, len(prismatic))) * np.where(prismatic, 0.2, 1.0)
    rebuilt = np.array([rebuild(read.M, read.S, q_k) for q_k in q])
    return replace(read, residual=float(np.abs(rebuilt - chain(q)).max(initial=0.0)))


def rebuild(M: Array, S: Array, q: Array) -> Array:
    """exp(S_1 q_1) ... exp(S_n q_n) M, (4, 4)."""
    T = np.eye(4)
    for twist, value in zip(S, q, strict=True):
        T = T @ exp(twist, float(value))
    return T @ M


@dataclass(frozen=True)
class Gauge:
    """The base transform between two sets of screws.

    T_b_a: the transform (4, 4) for which S_b = Ad(T_b_a) S_a.
    residuals: what it leaves, S_b - Ad(T_b_a) S_a, (n, 6).
    rank: how many directions of rotation and of translation the axes determine, (3, 3) if all.
    free: in words, which directions they leave open.
    """

    T_b_a: Array
    residuals: Array
    rank: tuple[int, int]
    free: tuple[str, ...]


def adjoint(T: Array) -> Array:
    """Ad_T for twists with the linear part first, (6, 6): [[R, [p] R], [0, R]]."""
    A = np.zeros((6, 6))
    R = T[:3, :3]
    A[:3, :3] = A[3:, 3:] = R
    A[:3, 3:] = skew(T[:3, 3]) @ R
    return A


def fit_gauge(S_a: Array, S_b: Array) -> Gauge:
    """The base transform that carries one set of screws to another, by Kabsch on the directions and least squares on points.

    Directions are the axes of revolute and the travel of prismatic joints (Kabsch 1976, doi:10.1107/S0567739476001873). If
    all are parallel, the turn about them follows from where the revolute axes stand.
    S_a, S_b: joint twists (n, 6), linear part first.
    """
    revolute = np.linalg.norm(S_a[:, 3:], axis=1) > 1e-9
    directions = [np.where(revolute[:, None], S[:, 3:], S[:, :3]) for S in (S_a, S_b)]
    U, sizes, Vt = np.linalg.svd(directions[1].T @ directions[0])
    R = np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)
    free = []
    if sizes[1] <= 1e-9 * sizes[0]:
        z = directions[1][0] / np.linalg.norm(directions[1][0])
        turn = _turn_about(z, _points(S_a[revolute]) @ R.T, _points(S_b[revolute]))
        if turn is None:
            free.append("rotation about the one direction that all axes share")
        else:
            R = exp(np.concatenate([np.zeros(3), z]), turn)[:3, :3] @ R
    # v_b - R v_a = t x (R w_a) = -[R w_a] t, for every revolute joint.
    rows = np.concatenate([-skew(w) for w in S_a[:, 3:] @ R.T])
    right = (S_b[:, :3] - S_a[:, :3] @ R.T).ravel()
    t, _, rank, _ = np.linalg.lstsq(rows, right, rcond=1e-9)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    if rank < 3:
        free.append("translation along the one direction that all axes share" if rank == 2 else "translation")
    turns = 2 if any("rotation" in text for text in free) else 3
    return Gauge(T, S_b - S_a @ adjoint(T).T, (turns, int(rank)), tuple(free))


def _points(S: Array) -> Array:
    """A point on the axis of each revolute twist, (n, 3)."""
    return np.asarray(np.cross(S[:, 3:], S[:, :3]) / (S[:, 3:] ** 2).sum(axis=1, keepdims=True))


def _turn_about(z: Array, a: Array, b: Array) -> float | None:
    """Angle about z that turns points a onto points b, both seen along z and from their middle. None if each is one point."""
    if len(a) < 2:
        return None
    a, b = (p - np.outer(p @ z, z) for p in (a - a.mean(axis=0), b - b.mean(axis=0)))
    if np.linalg.norm(a) < 1e-9:
        return None
    return math.atan2(float((np.cross(a, b) @ z).sum()), float((a * b).sum()))
