"""Batched placements, one contiguous vector per matrix entry: the kernels under every comparison.

`Components` is (F, 4, 3, N) float64: frame; column x, y, z axis or origin p [m]; row; configuration. Elementwise work on
it runs at memory speed, where (N, F, 4, 4) would need a small matrix product per placement.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from harness.se3 import Array, chord_angle

Components: TypeAlias = Array


@dataclass(frozen=True)
class View:
    """How mapped frames are read off one source's raw placements.

    slots: (F,) index of the raw frame of each mapped frame, None if the source does not have it.
    offsets: (F, 4, 4) constant transform that follows the raw frame.
    base: index of the raw frame in which placements are to be expressed, None if they already are.
    front: (4, 4) constant transform before it all, T_base_raw, None if it is the identity.
    """

    slots: tuple[int | None, ...]
    offsets: Array
    base: int | None
    front: Array | None = None

    @property
    def available(self) -> list[int]:
        """Indices of the mapped frames this source has."""
        return [f for f, slot in enumerate(self.slots) if slot is not None]

    @property
    def raw_frames(self) -> list[int]:
        """Index of the raw frame of each mapped frame this source has, in the order of `available`."""
        return [slot for slot in self.slots if slot is not None]


def components(T: Array) -> Components:
    """(N, F, 4, 4) placements as (F, 4, 3, N)."""
    return np.ascontiguousarray(T[:, :, :3, :].transpose(1, 3, 2, 0))


def matrices(C: Components) -> Array:
    """(F, 4, 3, N) back to (N, F, 4, 4)."""
    T = np.zeros((C.shape[3], C.shape[0], 4, 4))
    T[:, :, :3, :] = C.transpose(3, 0, 2, 1)
    T[:, :, 3, 3] = 1.0
    return T


def mapped(C: Components, view: View) -> Components:
    """Raw components of a source to the mapped frames it has, in order of `view.available`.

    front T_base^-1 T_frame offset, as far as the view has them.
    """
    available = view.available
    raw = C if view.base is None else _relative(C, C[view.base])
    if view.front is not None:
        raw = np.einsum("ri,fkin->fkrn", view.front[:3, :3], raw)
        raw[:, 3] += view.front[:3, 3, None]
    picked = raw[view.raw_frames]
    F, _, _, N = picked.shape
    # Columns of T X are combinations of the columns of T: a (4 x 4) by (4 x 3N) product a frame.
    out = np.matmul(view.offsets[available].transpose(0, 2, 1), picked.reshape(F, 4, 3 * N))
    return np.asarray(out.reshape(F, 4, 3, N))


def _relative(C: Components, base: Array) -> Components:
    """T_base^-1 T for every frame, base (4, 3, N)."""
    eye = np.eye(4)[:, :3]
    if np.array_equal(base, np.broadcast_to(eye[:, :, None], base.shape)):
        return C
    shifted = C.copy()
    shifted[:, 3] -= base[3]
    return np.asarray(np.einsum("rin,fkin->fkrn", base[:3], shifted))


def rotation_residual(C: Components) -> Array:
    """How far each rotation is from SO(3): the largest of | |x|^2 - 1 |, | |y|^2 - 1 |, |x.y| and |z - x cross y|_inf.

    Zero exactly for rotations: x, y orthonormal and z = x cross y says R'R = I and det R = 1 at once. Shape (F, N).
    """
    x, y, z = C[:, 0], C[:, 1], C[:, 2]
    residual: Array = np.abs(np.einsum("frn,frn->fn", x, x) - 1.0)
    np.maximum(residual, np.abs(np.einsum("frn,frn->fn", y, y) - 1.0), out=residual)
    np.maximum(residual, np.abs(np.einsum("frn,frn->fn", x, y)), out=residual)
    for r in range(3):
        i, j = (r + 1) % 3, (r + 2) % 3
        np.maximum(residual, np.abs(z[:, r] - (x[:, i] * y[:, j] - x[:, j] * y[:, i])), out=residual)
    return residual


def discrepancies(C_a: Components, C_b: Components) -> tuple[Array, Array]:
    """Position error [m] and rotation error [rad] (see `se3.rotation_error`) of equal frames, each (F, N)."""
    D = C_a - C_b
    np.multiply(D, D, out=D)
    position = np.sqrt(D[:, 3].sum(axis=1))
    chord = np.sqrt(D[:, :3].sum(axis=(1, 2)))
    return position, chord_angle(chord)
