"""Every source against the reference at every mapped frame, block by block, in memory that does not grow with the blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.comparison.components import (
    Components,
    View,
    components,
    discrepancies,
    mapped,
    rotation_residual,
)
from harness.comparison.statistics import Stream
from harness.digits import discrepancy, steps
from harness.se3 import REPEATED, RIGID, Array

Mask: TypeAlias = NDArray[np.bool_]

CHUNK = 1024
HUGE = 1e100  # beyond this a length is as good as infinite: its square would be


@dataclass(kw_only=True)
class Validity:
    """Whether a source's placements are placements: finite, last row 0 0 0 1, rotation in SO(3) to within `se3.RIGID`.

    Attributes:
        checked: number of placements looked at.
        invalid: number of those that are no placements.
        residual: the largest error of a rotation, see `rotation_residual` [1].
        first: (configuration index, raw frame index) of the first one that is no placement; None if all are.
        again: the largest change of an entry when one configuration is asked for a second time, alone.
        again_at: index of that configuration; -1 if none was asked for again.
    """

    checked: int = 0
    invalid: int = 0
    residual: float = 0.0
    first: tuple[int, int] | None = None
    again: float = 0.0
    again_at: int = -1

    @property
    def stateful(self) -> bool:
        """Whether the answer depends on what was asked before, by more than rounding does."""
        return self.again > REPEATED


@dataclass
class Pair:
    """Largest discrepancies of two sources over the subset.

    Attributes:
        position: the largest distance [m].
        position_frame: index of the mapped frame that shows it; -1 as long as nothing was compared.
        rotation: the largest angle [rad].
        rotation_frame: index of the mapped frame that shows it; -1 as long as nothing was compared.
    """

    position: float = 0.0
    position_frame: int = -1
    rotation: float = 0.0
    rotation_frame: int = -1


class Comparison:
    """Accumulates the comparison of several sources, block by block.

    Attributes:
        views: by source, how its raw placements are read.
        reference: the source that all others are compared with.
        frames: number of mapped frames.
        subset: all pairs of sources are compared too, on the configurations with an index below this one.
        reach: the largest distance of a mapped frame from the base, by the reference [m].
        validity: by source, whether its placements are placements.
        position: by source, statistics of the distance from the reference [m], at each mapped frame.
        rotation: by source, statistics of the angle from the reference [rad], at each mapped frame.
        pairs: by pair of sources, the largest discrepancies over the subset.
    """

    def __init__(self, views: Mapping[str, View], reference: str, frames: int, subset: int) -> None:
        self.views = dict(views)
        self.reference = reference
        self.subset = subset
        self.frames = frames
        self.reach = 0.0
        self.validity = {source: Validity() for source in views}
        self.position: dict[str, Stream] = {}
        self.rotation: dict[str, Stream] = {}
        for source in views:
            if source != reference:
                self.position[source], self.rotation[source] = Stream(frames), Stream(frames)
        self.pairs: dict[tuple[str, str], Pair] = {}

    def drop(self, source: str) -> None:
        """Forget a source that failed: a partial result is no result."""
        self.views.pop(source, None)
        self.position.pop(source, None)
        self.rotation.pop(source, None)
        self.validity.pop(source, None)
        self.pairs = {pair: value for pair, value in self.pairs.items() if source not in pair}

    def update(self, start: int, raw: Mapping[str, Array]) -> None:
        """Compare one block of configurations.

        Args:
            start: index of the block's first configuration.
            raw: by source in `views`, its raw placements (N, F_raw, 4, 4) [m].
        """
        count = raw[self.reference].shape[0]
        # An engine may return anything: what is not finite is masked and counted, not warned about.
        with np.errstate(invalid="ignore", over="ignore"):
            for offset in range(0, count, CHUNK):
                part = slice(offset, min(offset + CHUNK, count))
                self._chunk(start + offset, {source: raw[source][part] for source in self.views})

    def _chunk(self, start: int, raw: Mapping[str, Array]) -> None:
        placed: dict[str, Components] = {}
        usable: dict[str, Mask | None] = {}
        for source, view in self.views.items():
            C = components(raw[source])
            good = self._check(source, start, raw[source], C)
            usable[source] = None if good is None else self._usable(good, view)
            placed[source] = mapped(C, view)
        reference = placed[self.reference]
        origins = np.einsum("frn,frn->fn", reference[:, 3], reference[:, 3])
        self.reach = max(self.reach, float(np.sqrt(np.nanmax(origins, initial=0.0, where=np.isfinite(origins)))))
        for source in self.position:
            self._pair(start, self.reference, source, placed, usable)
        if start < self.subset:
            self._all_pairs(start, placed, usable)

    def _check(self, source: str, start: int, T: Array, C: Components) -> Mask | None:
        """Update validity. Returns None if all are valid, else a mask (F_raw, N)."""
        validity = self.validity[source]
        validity.checked += C.shape[0] * C.shape[3]
        residual = rotation_residual(C)
        worst = float(residual.max(initial=0.0))
        last_row_ok = bool(np.array_equal(T[:, :, 3, :], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*T.shape[:2], 4))))
        if worst <= RIGID and last_row_ok and np.abs(C[:, 3]).max(initial=0.0) < HUGE:
            validity.residual = max(validity.residual, worst)
            return None
        finite: Mask = np.asarray((np.abs(C) < HUGE).all(axis=(1, 2)))
        last = np.abs(T[:, :, 3, :] - [0.0, 0.0, 0.0, 1.0]).max(axis=2).T
        good = finite & (residual <= RIGID) & (last <= RIGID)
        validity.residual = max(validity.residual, float(np.where(finite, residual, 0.0).max(initial=0.0)))
        bad = np.argwhere(~good.T)
        validity.invalid += len(bad)
        if len(bad) and validity.first is None:
            validity.first = (start + int(bad[0][0]), int(bad[0][1]))
        return finite

    @staticmethod
    def _usable(finite: Mask, view: View) -> Mask:
        """Mask of mapped frames whose raw placement, and base, is finite: an invalid but finite one is still measured."""
        mask: Mask = finite[view.raw_frames]
        return mask if view.base is None else np.logical_and(mask, finite[view.base])

    def _common(
        self, a: str, b: str, placed: Mapping[str, Components], usable: Mapping[str, Mask | None]
    ) -> tuple[list[int], Array, Array, Mask | None]:
        """Frames both have, position and rotation errors there, and the mask of finite ones (None: all)."""
        have_a, have_b = self.views[a].available, self.views[b].available
        frames = [f for f in have_a if f in have_b]
        rows_a, rows_b = ([have.index(f) for f in frames] for have in (have_a, have_b))
        C_a = placed[a] if frames == have_a else placed[a][rows_a]
        C_b = placed[b] if frames == have_b else placed[b][rows_b]
        masks = [m[rows] for m, rows in ((usable[a], rows_a), (usable[b], rows_b)) if m is not None]
        position, rotation = discrepancies(C_a, C_b)
        mask: Mask | None = np.logical_and.reduce(masks) if masks else None
        return frames, position, rotation, mask

    def _pair(self, start: int, a: str, b: str, placed: Mapping[str, Components], usable: Mapping[str, Mask | None]) -> None:
        frames, position, rotation, mask = self._common(a, b, placed, usable)
        for stream, values in ((self.position[b], position), (self.rotation[b], rotation)):
            if len(frames) == self.frames:
                stream.update(start, values, mask)
            else:  # frames this source does not have stay at count 0
                valid = np.zeros((self.frames, values.shape[1]), dtype=bool)
                valid[frames] = True if mask is None else mask
                full = np.zeros(valid.shape)
                full[frames] = values
                stream.update(start, full, valid)

    def _all_pairs(self, start: int, placed: Mapping[str, Components], usable: Mapping[str, Mask | None]) -> None:
        stop = self.subset - start
        sources: Sequence[str] = list(self.views)
        for i, a in enumerate(sources):
            for b in sources[i + 1 :]:
                frames, position, rotation, mask = self._common(a, b, placed, usable)
                if not frames:
                    continue
                pair = self.pairs.setdefault((a, b), Pair())
                for name, values in (("position", position), ("rotation", rotation)):
                    seen = (values if mask is None else np.where(mask, values, 0.0))[:, :stop]
                    peaks, largest = seen.max(axis=1), getattr(pair, name)
                    written = steps(peaks)
                    if getattr(pair, f"{name}_frame") < 0 or written.max() > steps(largest):
                        setattr(pair, f"{name}_frame", frames[int(written.argmax())])
                    setattr(pair, name, max(largest, float(peaks.max())))

    def worst(self, source: str, tolerance: tuple[float, float], frames: Sequence[int]) -> tuple[int, int] | None:
        """Where a source is furthest outside its tolerance.

        Args:
            source: source name.
            tolerance: [m], [rad].
            frames: indices of the mapped frames that are looked at.

        Returns:
            (frame, configuration index); None if all are within tolerance.
        """
        return self.furthest(source, tolerance, frames, 1.0)

    def furthest(
        self, source: str, tolerance: tuple[float, float], frames: Sequence[int], above: float = -1.0
    ) -> tuple[int, int] | None:
        """Where a source's discrepancy is the largest, divided by its tolerance.

        Args:
            source: source name.
            tolerance: [m], [rad].
            frames: indices of the mapped frames that are looked at.
            above: only discrepancies larger than this many tolerances count.

        Returns:
            (frame, configuration index); None if there is none.
        """
        best, where = above, None
        for stream, limit in ((self.position[source], tolerance[0]), (self.rotation[source], tolerance[1])):
            for frame in frames:
                if (ratio := discrepancy(float(stream.max[frame])) / limit) > best:
                    best, where = ratio, (frame, int(stream.argmax[frame]))
        return where
