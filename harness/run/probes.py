"""The configurations at which each engine is tested against its own description: of every kind that has caught an engine.

All are drawn from one seed, the same with every version of NumPy. docs/theory.md lists the kinds and says what each is for.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from harness.description.configurations import ConfigurationSet
from harness.description.joints import within_travel
from harness.description.model import RobotModel
from harness.run.grids import GRID_LIMIT, axes_of, grid
from harness.se3 import Array
from harness.workers.protocol import MAX_BLOCK

Mask = NDArray[np.bool_]

COMPARED, FULL, SINGLE, STEPS = "compared", "full block", "single calls", "short steps"
AGAIN, FAR, SPECIAL, GRID = "again", "far", "special", "grid"
KINDS = (COMPARED, FULL, SINGLE, STEPS, AGAIN, SPECIAL, GRID, FAR)  # in the order in which a report lists them

TURN = 2.0 * math.pi
TURNS = 25  # each way, of the far ones
STREAM = 1 << 62  # the random configurations of a run take the streams from 0 on
MOST_JOINTS = 16  # that are looked at one by one
SLOW_BLOCK = MAX_BLOCK // 2  # rows of the full block of a slow engine
WINDOWS = 2048  # rows of the grids over neighbouring joints, where the whole grid is too large

SUBSET, FAR_ROWS, COMBINED = 256, 256, 48
SINGLE_ROWS, SINGLE_NEW, SINGLE_SPECIAL, SINGLE_FAR = 96, 64, 32, 12
REPEATED_ROWS, REPEATED_NEW = 14, 6
STEP_SIZES = tuple(10.0**-k for k in range(9, 0, -1))
NEXT_TO = tuple(10.0**-k for k in range(12, 1, -1))


class Draws:
    """Numbers from a seed. Only Philox's raw stream is used: NumPy guarantees that it never changes."""

    def __init__(self, seed: int) -> None:
        self._bits = np.random.Philox(key=np.array([seed, STREAM], dtype=np.uint64))

    def unit(self, *shape: int) -> Array:
        """Numbers in [0, 1)."""
        raw = np.asarray(self._bits.random_raw(math.prod(shape)), dtype=np.uint64)
        return np.asarray((raw >> np.uint64(11)).astype(np.float64) * 2.0**-53).reshape(shape)

    def below(self, count: int, *shape: int) -> NDArray[np.intp]:
        """Whole numbers from 0 to count - 1."""
        return np.asarray(self.unit(*shape) * count).astype(np.intp)

    def signs(self, *shape: int) -> Array:
        """Numbers that are 1 or -1."""
        return np.where(self.unit(*shape) < 0.5, -1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Box:
    """Where joints may be asked.

    lower, upper: (n,) [rad or m]. A revolute joint: one turn each way, and its limits if these are wider. A slide: its range,
        cut to 10 m each way from the point of it that is nearest to zero.
    limits: the model's own limits and what its fixed configurations take, two of (n,) [rad or m].
    revolute: which joints turn, (n,).
    """

    lower: Array
    upper: Array
    limits: tuple[Array, Array]
    revolute: Mask

    @classmethod
    def of(cls, law: ConfigurationSet) -> Box:
        """The box of a model's joints."""
        revolute = np.array(law.revolute, dtype=bool)
        lower, upper = within_travel(law.lower, law.upper)
        return cls(
            lower=np.where(revolute, np.minimum(law.lower, -TURN), lower),
            upper=np.where(revolute, np.maximum(law.upper, TURN), upper),
            limits=(np.minimum(law.lower, law.fixed_q.min(axis=0)), np.maximum(law.upper, law.fixed_q.max(axis=0))),
            revolute=revolute,
        )

    @property
    def joints(self) -> Sequence[int]:
        """The joints that are looked at one by one: all, or 16 spread over a long chain."""
        n = len(self.lower)
        return sorted({round(j) for j in np.linspace(0, n - 1, min(n, MOST_JOINTS))})

    def uniform(self, draws: Draws, count: int) -> Array:
        """Random configurations, (count, n)."""
        return np.asarray(self.lower + draws.unit(count, len(self.lower)) * (self.upper - self.lower))

    def kept(self, q: Array) -> Array:
        """q (N, n) with slides moved into their range."""
        return np.where(self.revolute, q, np.clip(q, self.lower, self.upper))

    def near(self, q: Array) -> Mask:
        """Which of q (N, n) are within a turn each way, or within the limits: what differs there counts."""
        within = (q >= self.lower) & (q <= self.upper)
        return np.asarray((within | ~self.revolute).all(axis=1))

    def inside(self, q: Array) -> Mask:
        """Which of q (N, n) are within the limits: an engine must answer there."""
        return np.asarray(((q >= self.limits[0]) & (q <= self.limits[1])).all(axis=1))

    @cached_property
    def special(self) -> Array:
        """Values of each joint (5, n): zero, right angles and half turns; a slide's point next to zero, and its ends."""
        slide = np.clip(np.zeros_like(self.lower), self.lower, self.upper)
        turns = (0.0, math.pi / 2, -math.pi / 2, math.pi, -math.pi)
        ends = (slide, self.lower, self.upper, (self.lower + self.upper) / 2.0, slide)
        return np.array([np.where(self.revolute, turn, end) for turn, end in zip(turns, ends, strict=True)])


@dataclass(frozen=True)
class Block:
    """Configurations asked in one call. q: (N, n) [rad or m]; kinds: the kind of each row, (N,)."""

    q: Array
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class Probes:
    """What each source is asked: some blocks, then configurations one at a time, in this order.

    box: where the joints may be.
    blocks: the first is what the comparison has asked already.
    singles: the configurations asked alone, each a block of one row.
    """

    box: Box
    blocks: tuple[Block, ...]
    singles: Block


def draw(model: RobotModel, compared: Array, seed: int, rows: int = MAX_BLOCK) -> Probes:
    """The probes of a model.

    compared: configurations that the comparison has asked, (N, n) [rad or m].
    seed: below 2^64.
    rows: of the full block. With fewer than a block can have, the grid is thinned out.
    """
    box, draws = Box.of(model.configurations), Draws(seed)
    special, far, walk = _special(box, draws), _far(box, draws), _steps(box, draws)
    nodes = _grid(model, box, draws)
    if rows < MAX_BLOCK:
        nodes = nodes[_spread(len(nodes), rows // 3)]
    parts = [(SPECIAL, special), (STEPS, np.unique(walk, axis=0)), (FAR, far), (GRID, nodes)]
    apart = sum(len(rows) for _, rows in parts) > rows * 3 // 4  # then the grid is a block of its own
    first = parts[:-1] if apart else parts
    full = _block([*first, (FULL, box.uniform(draws, rows - sum(len(rows) for _, rows in first)))])
    square = Block(full.q[-full.q.shape[1] :], (AGAIN,) * full.q.shape[1])  # rows taken for columns show only here
    blocks = [_block([(COMPARED, compared)]), full, *([_block([(GRID, nodes)])] if apart else []), square]
    return Probes(box, tuple(blocks), _singles(box, draws, full, (special, far, walk)))


def _block(parts: Iterable[tuple[str, Array]]) -> Block:
    parts = list(parts)
    return Block(np.concatenate([rows for _, rows in parts]), tuple(kind for kind, rows in parts for _ in rows))


def _singles(box: Box, draws: Draws, full: Block, drawn: tuple[Array, Array, Array]) -> Block:
    """The configurations that are asked alone; many of them are rows of the full block too."""
    special, far, walk = drawn
    near = np.flatnonzero(box.near(full.q))
    rows = full.q[near[_spread(len(near), SINGLE_ROWS)]]
    new = box.uniform(draws, SINGLE_NEW)
    once = np.concatenate([rows, new, special[_spread(len(special), SINGLE_SPECIAL)]])
    chosen = near[draws.below(len(near), REPEATED_ROWS)]
    repeated = np.concatenate([full.q[chosen], box.uniform(draws, REPEATED_NEW)])
    # Each comes first or last, before and after all others.
    again = np.concatenate([repeated, repeated[::-1], repeated[draws.unit(len(repeated)).argsort(kind="stable")], once[:1]])
    return _block([(SINGLE, once), (STEPS, walk), (FAR, far[_spread(len(far), SINGLE_FAR)]), (AGAIN, again)])


def _spread(count: int, wanted: int) -> NDArray[np.intp]:
    """Indices spread evenly over `count`, first and last among them."""
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(np.intp))


def _special(box: Box, draws: Draws) -> Array:
    """Zero, right angles, half turns and the ends of slides: all joints, one joint, mixed; then right beside them."""
    values, n = box.special, len(box.lower)
    one = []
    for j in box.joints:
        alone = np.tile(values[0], (len(values) - 1, 1))
        alone[:, j] = values[1:, j]
        one.append(alone)
    mixed = _mixed(box, draws, COMBINED)
    nearby = np.tile(np.array([s * x for x in NEXT_TO for s in (1.0, -1.0)]), len(values) + 1)[:, None]
    bases = np.concatenate([np.repeat(values, 2 * len(NEXT_TO), axis=0), _mixed(box, draws, 2 * len(NEXT_TO))])
    beside = bases + nearby * draws.signs(len(bases), n)
    each = np.repeat(values[0][None, :], len(box.joints) * len(values) * 2, axis=0)
    sides = itertools.product(box.joints, range(len(values)), (1.0, -1.0))
    for row, (joint, value, sign) in enumerate(sides):
        each[row, joint] = values[value, joint] + sign * NEXT_TO[int(draws.below(len(NEXT_TO), 1)[0])]
    return box.kept(np.concatenate([values, *one, mixed, beside, each]))


def _mixed(box: Box, draws: Draws, count: int) -> Array:
    """Special values, drawn for each joint, (count, n)."""
    n = len(box.lower)
    return np.asarray(box.special[draws.below(len(box.special), count, n), np.arange(n)])


def _far(box: Box, draws: Draws) -> Array:
    """Up to 25 turns each way: all joints, one joint, near ones with whole turns added, and the far corners."""
    n, quarter = len(box.lower), FAR_ROWS // 4
    size = TURN * TURNS ** draws.unit(2 * quarter, n)  # evenly by power: from one turn to the last
    every = size * draws.signs(2 * quarter, n)
    one, several = box.uniform(draws, quarter), box.uniform(draws, quarter)
    at = draws.below(n, quarter)
    one[np.arange(quarter), at] = (TURN * TURNS ** draws.unit(quarter)) * draws.signs(quarter)
    several = several + TURN * (draws.below(2 * TURNS - 3, quarter, n) - (TURNS - 2))
    corners = TURN * TURNS * draws.signs(4, n)
    every[:4] = corners
    far = np.concatenate([every, one, several])
    # What is far is so by its turns: slides stay where they are.
    return np.where(box.revolute, far, box.uniform(draws, len(far)))


def _steps(box: Box, draws: Draws) -> Array:
    """Small steps away from a start, 1e-9 to 1e-1 [rad or m], and back to it; in all joints, then in one at a time."""
    n = len(box.lower)
    middle = (box.lower + box.upper) / 2.0 + 0.8 * (box.uniform(draws, 2) - (box.lower + box.upper) / 2.0)
    path: list[Array] = []
    for start in (box.special[0], _mixed(box, draws, 1)[0], middle[0]):
        for _ in range(2):
            direction = draws.signs(n)
            path += [start, *(start + size * direction for size in STEP_SIZES)]
        path.append(start)
    for j in box.joints:
        for size in (1e-6, 1e-3):
            step = np.zeros(n)
            step[j] = size * float(draws.signs(1)[0])
            path += [middle[1], middle[1] + step] if size == 1e-6 else [middle[1] + step]
    return box.kept(np.array(path))


def _grid(model: RobotModel, box: Box, draws: Draws) -> Array:
    """The grid that fixes a serial chain everywhere; of a long chain, grids over neighbouring joints, the others at random."""
    axes = axes_of(model, box.lower, box.upper)
    n = len(axes)
    if math.prod(axis.count for axis in axes) <= GRID_LIMIT:
        return grid(axes)
    most = max(axis.count for axis in axes)
    width = max((w for w in range(1, n) if (n - w + 1) * most**w <= WINDOWS), default=1)
    firsts = [int(i) for i in _spread(n - width + 1, max(1, WINDOWS // most**width))]
    rows = []
    for first in firsts:
        window = range(first, first + width)
        nodes = grid([axes[j] for j in window])
        part = np.repeat(box.uniform(draws, 1), len(nodes), axis=0)
        part[:, window] = nodes
        rows.append(part)
    return np.concatenate(rows)
