"""Which change of one number of a mechanism brings its placements to those that were observed: least squares in one unknown.

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
class Target:
    """The placements that are to be reached.

    q: configurations (N, n) [rad or m].
    names: names of F frames.
    T: their placements, (N, F, 4, 4) [m].
    """

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
    """What leads from placements T to `wanted`, (N, F, 6): translation [m] and sine of the rotation, in the base frame's axes."""
    R = wanted[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.empty((*T.shape[:2], 6))
    out[..., :3] = wanted[..., :3, 3] - T[..., :3, 3]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[..., 3 + k] = (R[..., j, i] - R[..., i, j]) / 2.0
    return out


def derivatives(T: Array, xi: Array, moves: Mask) -> Array:
    """How each of K parameters moves every frame, (K, N, F, 6): velocity of its origin, then its angular velocity.

    T: placements (N, F, 4, 4).
    xi: the parameters' twists (K, N, 6), linear part first.
    moves: which frames each parameter moves, (K, F).
    """
    w = xi[:, :, None, 3:]
    out = np.empty((*xi.shape[:2], T.shape[1], 6))
    out[..., :3] = xi[:, :, None, :3] + np.cross(w, T[None, :, :, :3, 3])
    out[..., 3:] = w
    return np.asarray(out * moves[:, None, :, None])


def each_alone(mechanism: Mechanism, target: Target) -> list[tuple[float, Parameter, float]]:
    """For every parameter that moves a frame, the change that alone comes nearest to the target.

    Returns the root mean square of what it leaves, the parameter, and the change [m or rad].
    """
    T, xi, moves = mechanism.twists(target.q, target.names)
    fits = []
    for k, parameter in enumerate(mechanism.parameters):
        if not moves[k].any():
            continue
        best = _best_length if parameter.unit == "m" else _best_angle
        delta = best(T, xi[k], moves[k], target.T)
        if delta is not None:
            gap = target.T - _moved(T, xi[k], moves[k], delta)
            fits.append((float(np.sqrt((gap**2).mean())), parameter, delta))
    return fits


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


def _best_length(T: Array, xi: Array, moves: Mask, wanted: Array) -> float | None:
    """The best shift [m], by linear least squares; None if it moves nothing."""
    v = xi[:, None, :3]
    gap = (wanted - T)[:, moves][..., :3, 3]
    size = float((v**2).sum() * moves.sum())
    return float((gap * v).sum()) / size if size > 0 else None


def _best_angle(T: Array, xi: Array, moves: Mask, wanted: Array) -> float | None:
    """The best of all angles [rad], by a scan of the sum of squares, then by Gauss-Newton; None if it turns nothing."""
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


def fit_constant_offset(T: Array, wanted: Array) -> Array:
    """For each frame the constant transform Y for which T Y comes nearest to `wanted`, (F, 4, 4).

    T, wanted: placements (N, F, 4, 4).
    """
    gap = se3.inverse(T) @ wanted
    return np.array([se3.mean_transform(gap[:, f]) for f in range(gap.shape[1])])
