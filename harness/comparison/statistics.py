"""Streaming statistics of nonnegative discrepancies: maximum, mean, quantiles and a log-scale histogram in fixed memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from harness.digits import decimal_scale, steps
from harness.se3 import Array

LOWEST, HIGHEST, PER_DECADE = -15, 4, 16
BINS = (HIGHEST - LOWEST) * PER_DECADE
EDGE = 1e-8  # bins: what is at an edge but for rounding, as 0.1 mm often is, has reached it


class Stream:
    """Statistics of one quantity at `frames` frames, fed block by block with (frames, N) values.

    The histogram has 16 bins a decade from 1e-15 to 1e4; what lies below is counted in the first bin. Values that are
    not finite are left out and counted by the caller. `argmax` is the first configuration whose value is written like `max`:
    which one of them is larger by less is a matter of rounding.
    """

    def __init__(self, frames: int) -> None:
        self.count = np.zeros(frames, dtype=np.int64)
        self.total = np.zeros(frames)
        self.max = np.full(frames, -1.0)
        self.argmax = np.full(frames, -1, dtype=np.int64)
        self.histogram = np.zeros((frames, BINS), dtype=np.int64)
        self._shift = np.arange(frames)[:, None] * BINS

    def update(self, start: int, values: Array, valid: NDArray[np.bool_] | None = None) -> None:
        """Add values (frames, N) of configurations `start` ...; `valid` (frames, N) leaves some out."""
        if values.shape[1] == 0:
            return
        ranked = values if valid is None else np.where(valid, values, -1.0)
        peak = ranked.max(axis=1)
        better = steps(peak) > steps(self.max)
        self.argmax[better] = np.rint(ranked * decimal_scale(peak)[:, None]).argmax(axis=1)[better] + start
        np.maximum(self.max, peak, out=self.max)
        self.count += values.shape[1] if valid is None else valid.sum(axis=1)
        self.total += values.sum(axis=1) if valid is None else np.where(valid, values, 0.0).sum(axis=1)
        bins = np.log10(np.maximum(ranked, 10.0**LOWEST))
        bins -= LOWEST
        bins *= PER_DECADE
        bins += EDGE
        # Truncation is floor here: everything is nonnegative. `max - 1` keeps the topmost edge inside.
        index = np.minimum(bins.astype(np.int64), BINS - 1) + self._shift
        flat = index.ravel() if valid is None else index[valid]
        self.histogram += np.bincount(flat, minlength=self.histogram.size).reshape(self.histogram.shape)

    def mean(self, frame: int) -> float:
        """Mean over the values counted; 0 if there are none."""
        return float(self.total[frame] / self.count[frame]) if self.count[frame] else 0.0

    def quantile(self, frame: int, fraction: float) -> float:
        """Upper bound of the quantile: the upper edge of its bin, at most 15.5 % above it, and never above the maximum."""
        if not self.count[frame]:
            return 0.0
        cumulative = np.cumsum(self.histogram[frame])
        bin_ = int(np.searchsorted(cumulative, fraction * self.count[frame]))
        edge = 10.0 ** (LOWEST + (min(bin_, BINS - 1) + 1) / PER_DECADE)
        return float(min(edge, self.max[frame]))

    def decades(self, frame: int) -> dict[int, int]:
        """Counts by decade: key k counts values in [10^k, 10^(k+1)); all below 1e-14, zeros among them, are under -15."""
        counts = self.histogram[frame].reshape(-1, PER_DECADE).sum(axis=1)
        return {LOWEST + i: int(c) for i, c in enumerate(counts) if c}
