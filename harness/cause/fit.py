"""Which change of one number of a mechanism makes its placements those that were seen: least squares in one unknown.

It is solved for every parameter globally: a length enters positions linearly, an angle as a cosine and a sine, so that the
sum of squares is known for every angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness import se3
from harness.kinematics.mechanism import Mask, Mechanism, Parameter
from harness.se3 import Array

SCAN = 72
POLISH = 4


@dataclass(frozen=True)
class Seen:
    """What is to be reached: placements T (N, F, 4, 4) of the named frames at the configurations q (N, n)."""

    q: Array
    names: tuple[str, ...]
    T: Array


def errors(T_a: Array, T_b: Array) -> tuple[float, float]:
    """Largest discrepancy [m], [rad]; infinite if anything is not finite."""
    if not (np.isfinite(T_a).all() and np.isfinite(T_b).all()):
        return np.inf, np.inf
    position = float(se3.position_error(T_a, T_b).max(initial=0.0))
    return position, float(se3.rotation_error(T_a, T_b).max(initial=0.0))


def residuals(T: Array, wanted: Array) -> Array:
    """(N, F, 6): position [m] and the sine of the rotation [rad] that lead from T to `wanted`, in the base frame's axes."""
    R = wanted[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.empty((*T.shape[:2], 6))
    out[..., :3] = wanted[..., :3, 3] - T[..., :3, 3]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[..., 3 + k] = (R[..., j, i] - R[..., i, j]) / 2.0
    return out


def derivatives(T: Array, xi: Array, moves: Mask) -> Array:
    """How each parameter moves every frame, (K, N, F, 6): velocity of its origin, and angular velocity."""
    w = xi[:, :, None, 3:]
    out = np.empty((*xi.shape[:2], T.shape[1], 6))
    out[..., :3] = xi[:, :, None, :3] + np.cross(w, T[None, :, :, :3, 3])
    out[..., 3:] = w
    return np.asarray(out * moves[:, None, :, None])


def each_alone(mechanism: Mechanism, seen: Seen) -> list[tuple[float, Parameter, float]]:
    """For every parameter that matters the change that alone comes nearest: (root mean square left, parameter, change)."""
    T, xi, moves = mechanism.twists(seen.q, seen.names)
    found = []
    for k, parameter in enumerate(mechanism.parameters):
        if not moves[k].any():
            continue
        delta = _length(T, xi[k], moves[k], seen.T) if parameter.unit == "m" else _angle(T, xi[k], moves[k], seen.T)
        if delta is not None:
            left = seen.T - _moved(T, xi[k], moves[k], delta)
            found.append((float(np.sqrt((left**2).mean())), parameter, delta))
    return found


def _moved(T: Array, xi: Array, moves: Mask, delta: float) -> Array:
    """exp(delta xi) T for the frames that move; xi (N, 6) is a turn about an axis, or a shift."""
    v, w = xi[:, :3], xi[:, 3:]
    out = T.copy()
    if not w.any():
        out[..., :3, 3] += delta * v[:, None] * moves[:, None]
        return out
    K = np.zeros((len(w), 3, 3))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        K[:, j, i], K[:, i, j] = w[:, k], -w[:, k]
    KK = K @ K
    half = 2.0 * np.sin(delta / 2.0) ** 2  # 1 - cos, accurate for small angles
    R = np.eye(3) + np.sin(delta) * K + half * KK
    t = np.einsum("nij,nj->ni", np.sin(delta) * np.eye(3) + half * K, v)  # (I - R) p for v = -w x p
    out[:, moves, :3] = R[:, None] @ T[:, moves, :3]
    out[..., :3, 3] += t[:, None] * moves[:, None]
    return out


def _length(T: Array, xi: Array, moves: Mask, wanted: Array) -> float | None:
    v = xi[:, None, :3]
    gap = (wanted - T)[:, moves][..., :3, 3]
    size = float((v**2).sum() * moves.sum())
    return float((gap * v).sum()) / size if size > 0 else None


def _angle(T: Array, xi: Array, moves: Mask, wanted: Array) -> float | None:
    """The best of all angles, by a scan of the sum of squares, then Gauss-Newton on what is really left."""
    C0, Cc, Cs = _harmonics(T, xi, moves)
    gap = (wanted - T)[:, moves, :3] + (T[:, moves, :3] - C0)
    basis = np.stack([Cc.ravel(), Cs.ravel()])
    G, h = basis @ basis.T, basis @ gap.ravel()
    angles = np.linspace(-np.pi, np.pi, SCAN, endpoint=False)
    cs = np.stack([np.cos(angles), np.sin(angles)])
    cost = np.einsum("ia,ij,ja->a", cs, G, cs) - 2.0 * h @ cs
    best = min((float(cost.min()), float(angles[cost.argmin()])), (float(G[0, 0] - 2.0 * h[0]), 0.0))[1]
    for _ in range(POLISH):
        now = _moved(T, xi, moves, best)
        slope = (-np.sin(best) * Cc + np.cos(best) * Cs).ravel()
        size = float(slope @ slope)
        if size < 1e-24:
            return None
        best += float(slope @ (wanted - now)[:, moves, :3].ravel()) / size
    return float(np.remainder(best + np.pi, 2.0 * np.pi) - np.pi)


def _harmonics(T: Array, xi: Array, moves: Mask) -> tuple[Array, Array, Array]:
    """exp(delta xi) T = C0 + Cc cos delta + Cs sin delta, each (N, F moved, 3, 4)."""
    zero, quarter, half = (_moved(T, xi, moves, delta)[:, moves, :3] for delta in (0.0, np.pi / 2, np.pi))
    C0 = (zero + half) / 2.0
    return C0, (zero - half) / 2.0, quarter - C0


def behind(T: Array, wanted: Array) -> Array:
    """The constant Y (4, 4) of each frame for which T Y comes nearest to `wanted`, (F, 4, 4)."""
    gap = se3.inverse(T) @ wanted
    return np.array([se3.mean_transform(gap[:, f]) for f in range(gap.shape[1])])
