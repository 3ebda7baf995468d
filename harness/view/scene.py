"""Draws skeletons, frame triads and meshes into a viser scene, and moves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.rendering.figures import in_one_place
from harness.se3 import Array

# Okabe and Ito: told apart by the colour-blind; each source has a thickness of its own as well.
COLOURS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233), (120, 120, 120))


def quaternion(R: Array) -> Array:
    """Unit quaternion wxyz (4,) of a rotation (3, 3): the largest eigenvector of Bar-Itzhack's symmetric matrix.

    Bar-Itzhack 2000, doi:10.2514/2.4654; good for matrices that are rotations to rounding only.
    """
    (a, b, c), (d, e, f), (g, h, i) = R
    K = np.array([
        [a - e - i, b + d, c + g, h - f],
        [b + d, e - a - i, f + h, c - g],
        [c + g, f + h, i - a - e, d - b],
        [h - f, c - g, d - b, a + e + i],
    ])  # fmt: skip
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z])


class Skeleton:
    """One source in the scene: lines from frame to frame, a triad at each; the reference has names as well."""

    def __init__(self, server: Any, index: int, frames: Sequence[str], size: float, named: bool) -> None:
        self.frames = frames
        self._colour = COLOURS[index % len(COLOURS)]
        self._root = f"/sources/{index}"  # names come from files, and a slash in one would be a path
        self._thickness = size * (0.09 if named else 0.05 + 0.01 * index)
        self._size = size
        self._scene = server.scene
        self.visible = True
        self._labels: list[tuple[str, Any]] = []
        self._nodes: list[Any] = []
        self._named = named

    def move(self, T: Mapping[str, Array]) -> None:
        """Draw the placements, by frame."""
        names = [name for name in self.frames if name in T]
        points = np.array([T[name][:3, 3] for name in names]).reshape(-1, 3)
        lines = np.stack([points[:-1], points[1:]], axis=1) if len(points) > 1 else np.zeros((0, 2, 3))
        turns = np.array([quaternion(T[name][:3, :3]) for name in names]).reshape(-1, 4)
        self._nodes = [
            self._scene.add_line_segments(
                f"{self._root}/lines", points=lines.astype(np.float32), colors=self._colour, thickness=self._thickness,
                visible=self.visible,
            ),
            self._scene.add_batched_axes(
                f"{self._root}/triads", batched_wxyzs=turns, batched_positions=points, axes_length=self._size,
                axes_radius=0.03 * self._size * (1.4 if self._named else 1.0), visible=self.visible,
            ),
        ]  # fmt: skip
        if self._named and not self._labels:
            for group in in_one_place(points, 1e-6):
                text = ", ".join(names[i] for i in group)
                self._labels.append((names[group[0]], self._scene.add_label(f"/labels/{group[0]}", text)))
        for name, label in self._labels:
            label.position = T[name][:3, 3]

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self.visible = visible
        for node in [*self._nodes, *(label for _, label in self._labels)]:
            node.visible = visible
