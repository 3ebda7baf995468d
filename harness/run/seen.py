"""What a source shows while it is tested: accumulated call by call, in memory that does not grow with its answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from harness.comparison.components import Components
from harness.digits import discrepancy, steps
from harness.run.probes import COMPARED, KINDS, TURN, Box, Mask
from harness.run.tested import FrameTested, KindTested, Place, Repeated, Size, Tested, repeated_allowance
from harness.se3 import Array

Names = NDArray[np.str_]


@dataclass(frozen=True, kw_only=True)
class Answers:
    """Answers to some configurations, compared with the description.

    q: the configurations (N, n) [rad or m].
    kinds: the kind of each, (N,).
    way: how they were asked, as a report says it.
    placed: the mapped frames (F, 4, 3, N).
    off: how far they are off, position [m] and rotation [rad], (2, F, N); None if there is no description.
    limit: what rounding may be, (N,).
    allowed: the same, and what a trait of the engine explains, (N,).
    asked: which were asked at all, (N,).
    """

    q: Array
    kinds: Names
    way: str
    placed: Components
    off: Array | None
    limit: Array
    allowed: Array
    asked: Mask


@dataclass(frozen=True)
class _First:
    """The first answer to a configuration: way, placements (F, 4, 3), how far off (2, F)."""

    way: str
    placed: Array
    off: Array | None


class Seen:
    """Accumulates what one source shows.

    frames: indices of the mapped frames it has.
    """

    def __init__(self, frames: Sequence[int], box: Box, tolerance: Size) -> None:
        self.frames, self._box, self._tolerance = list(frames), box, np.array(tolerance)[:, None, None]
        self._calls: Counter[str] = Counter()
        self._counts: Counter[str] = Counter()
        self._kinds = {kind: np.zeros(2) for kind in KINDS}
        self._asked: set[bytes] = set()
        self._limit = self._turns = 0.0
        self._near = np.zeros(2)  # the largest differences that count, rounding included
        self._worst = self._beyond = self._invalid_at = None  # type: Place | None
        self._frames = np.zeros((2, len(self.frames)))
        self._places: dict[tuple[int, int], Place] = {}
        self._compared = np.zeros((2, len(self.frames)))
        self._invalid = 0
        self._nothing_beyond = False
        self._first: dict[bytes, _First] = {}
        self._again: Repeated | None = None
        self._doubtful: dict[str, tuple[float, Array]] = {}

    def call(self, kind: str) -> None:
        """Count a call."""
        self._calls[kind] += 1

    def take(self, answers: Answers, repeated: set[bytes]) -> None:
        """Take note of answers.

        answers: what was asked, and how far off it is.
        repeated: the configurations, as bytes, that are asked more than once.
        """
        finite: Mask = np.asarray(np.isfinite(answers.placed).all(axis=(1, 2)))
        self._count(answers, finite)
        off = np.zeros((2, *finite.shape)) if answers.off is None else np.where(finite, answers.off, 0.0)
        near = self._box.near(answers.q)
        for kind in dict.fromkeys(answers.kinds.tolist()):
            of_kind = off[:, :, answers.kinds == kind]
            np.maximum(self._kinds[kind], of_kind.max(axis=(1, 2), initial=0.0), out=self._kinds[kind])
        self._limit = max(self._limit, float(answers.limit[near].max(initial=0.0)))
        self._take_near(answers, off, near)
        self._take_far(answers, off, ~near)
        for i, q in enumerate(answers.q):
            if (key := q.tobytes()) in repeated and finite[:, i].all():
                self._answer(key, answers, i)

    def _count(self, answers: Answers, finite: Mask) -> None:
        for kind, is_asked in zip(answers.kinds.tolist(), answers.asked, strict=True):
            self._counts[kind] += bool(is_asked)
        self._asked.update(q.tobytes() for q in answers.q[answers.asked])
        turns = np.abs(answers.q[np.ix_(answers.asked, self._box.revolute)]) / TURN
        self._turns = max(self._turns, float(turns.max(initial=0.0)))
        inside = self._box.inside(answers.q)
        lost = ~finite & answers.asked
        self._nothing_beyond |= bool(lost[:, ~inside].any())
        if (bad := lost & inside).any():
            self._invalid += int(bad.sum())
            frame, row = (int(x) for x in np.argwhere(bad)[0])
            self._invalid_at = self._invalid_at or self._place(answers, frame, row, np.zeros((2, *finite.shape)))

    def _place(self, answers: Answers, frame: int, row: int, off: Array) -> Place:
        size = (float(off[0, frame, row]), float(off[1, frame, row]))
        return Place(kind=str(answers.kinds[row]), q=answers.q[row].copy(), frame=self.frames[frame], off=size)

    def _take_near(self, answers: Answers, off: Array, near: Mask) -> None:
        """What counts: the largest differences, and those that rounding does not explain, by frame."""
        counted = np.where(near, off, 0.0)
        largest = counted.max(axis=(1, 2), initial=0.0)
        if self._worst is None or steps(largest).max() > steps(self._near).max():  # by less, rounding would choose
            _, frame, row = (int(x) for x in np.unravel_index(int(steps(counted).argmax()), counted.shape))
            self._worst = self._place(answers, frame, row, off)
        np.maximum(self._near, largest, out=self._near)
        unexplained = np.where(counted > answers.allowed, counted, 0.0)
        of_run = unexplained[:, :, answers.kinds == COMPARED].max(axis=2, initial=0.0)
        np.maximum(self._compared, of_run, out=self._compared)
        for part, frame in np.argwhere(unexplained.max(axis=2, initial=0.0) > self._frames).tolist():
            row = int(unexplained[part, frame].argmax())
            self._frames[part, frame] = unexplained[part, frame, row]
            self._places[part, frame] = self._place(answers, frame, row, off)
        if answers.q.shape[0] > 1:
            ratio = (unexplained / self._tolerance).max(axis=(0, 1), initial=0.0)
            for kind in dict.fromkeys(answers.kinds[ratio > 1.0].tolist()):
                row = int(np.where(answers.kinds == kind, ratio, 0.0).argmax())
                if ratio[row] > self._doubtful.get(kind, (0.0, None))[0]:
                    self._doubtful[kind] = float(ratio[row]), answers.q[row].copy()

    def _take_far(self, answers: Answers, off: Array, far: Mask) -> None:
        """Further out only the first place, by turns, where it is off is kept."""
        ratio = np.where(far & (off > answers.allowed), off / self._tolerance, 0.0).max(axis=0)
        rows = np.flatnonzero(ratio.max(axis=0, initial=0.0) > 1.0)
        if len(rows):
            turns = self.turns(answers.q[rows])
            row = int(rows[turns.argmin()])
            if self._beyond is None or turns.min() < self.turns(self._beyond.q[None, :])[0]:
                self._beyond = self._place(answers, int(ratio[:, row].argmax()), row, off)

    def turns(self, q: Array) -> Array:
        """How far the furthest revolute joint of each of q (N, n) is from zero, in turns, (N,)."""
        return np.asarray(np.abs(q[:, self._box.revolute]).max(axis=1, initial=0.0) / TURN)

    def look_again(self, answers: Answers) -> None:
        """Compare answers that were taken before, and kept, with what they were then."""
        for i in np.flatnonzero(np.isfinite(answers.placed).all(axis=(0, 1, 2))):
            self._answer(answers.q[i].tobytes(), answers, int(i))

    def _answer(self, key: bytes, answers: Answers, row: int) -> None:
        """Keep the first answer to a configuration, and compare each other one with it."""
        placed = answers.placed[..., row]
        off = None if answers.off is None else answers.off[..., row]
        first = self._first.setdefault(key, _First(answers.way, placed.copy(), off))
        change = np.abs(placed - first.placed).max(axis=(1, 2))
        frame = int(steps(change).argmax())
        allowed = repeated_allowance(float(answers.allowed[row]))
        written = discrepancy(float(change[frame])), discrepancy(self._again.change if self._again else 0.0)
        if self._again is None or written[0] / allowed > written[1] / self._again.allowed:
            both = None
            if first.off is not None and off is not None:
                both = tuple((float(x[0, frame]), float(x[1, frame])) for x in (first.off, off))
            way = f"{answers.way} again" if answers.way == first.way else answers.way
            self._again = Repeated(
                change=float(change[frame]),
                allowed=allowed,
                q=answers.q[row].copy(),
                frame=self.frames[frame],
                ways=(first.way, way),
                off=both,  # type: ignore[arg-type]
            )

    def doubtful(self) -> list[Array]:
        """Of each kind the row of a block that is furthest off, if one is by more than the tolerance: worth asking alone."""
        return [q for _, q in self._doubtful.values()]

    def tested(self, description: Literal["dh", "urdf", ""], reason: str, refused: str, ignored_step: float) -> Tested:
        """What was seen, all told.

        description: which one the source reads; empty if none that is at hand, and `reason` says why.
        refused: why it has not answered beyond the limits.
        ignored_step: joint steps so small are ignored, as a trait of the engine says [rad or m].
        """
        if not refused and self._nothing_beyond:
            refused = "nothing finite came back"
        return Tested(
            description=description,
            reason=reason,
            configurations=len(self._asked),
            answers=self._counts.total(),
            calls=self._calls.total(),
            turns=self._turns,
            kinds=tuple(self._kind(kind) for kind in KINDS if self._counts[kind]),
            limit=self._limit,
            ignored_step=ignored_step,
            position=float(self._near[0]),
            rotation=float(self._near[1]),
            worst=self._worst,
            frames=tuple(self._frame(i) for i in range(len(self.frames))) if description else (),
            beyond=self._beyond,
            again=self._again,
            invalid=self._invalid,
            invalid_at=self._invalid_at,
            refused=refused,
        )

    def _kind(self, kind: str) -> KindTested:
        position, rotation = (float(x) for x in self._kinds[kind])
        return KindTested(name=kind, count=self._counts[kind], calls=self._calls[kind], position=position, rotation=rotation)

    def _frame(self, i: int) -> FrameTested:
        return FrameTested(
            frame=self.frames[i],
            position=float(self._frames[0, i]),
            rotation=float(self._frames[1, i]),
            position_at=self._places.get((0, i)),
            rotation_at=self._places.get((1, i)),
            compared=(float(self._compared[0, i]), float(self._compared[1, i])),
        )
