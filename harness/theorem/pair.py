"""Two descriptions in normal form, and what their frames share: deviations, and polynomials as far as they are multiplied out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from harness.se3 import Array
from harness.theorem.balls import Matrix, identity
from harness.theorem.chain import Chains, Path, Step
from harness.theorem.coefficients import Coefficients, of_terms
from harness.theorem.gauge import Deviation, Gauge, carried, reaches, size_of
from harness.theorem.lower import At
from harness.theorem.normal import Line, Motion, normal
from harness.theorem.polynomial import Polynomial, Terms, subtract
from harness.theorem.scales import scales_of

MOST_TERMS = 10_000  # of one polynomial: nine joints that turn
TRIED = 6  # configurations
LARGEST_SCALE = 10**6  # of a frequency: beyond, a factor has more digits than any mechanism
NEGLIGIBLE = 1e-3  # share of a bound that what is left behind may have


@dataclass(frozen=True)
class Start:
    """Where two chains begin to differ.

    Attributes:
        depth: how many joints come before it.
        deviation: what is left of those joints; None if the chains do not have the same joints.
    """

    depth: int
    deviation: Deviation | None


@dataclass(frozen=True)
class Rests:
    """Two chains from their first difference on; `chord`: by how much what comes before changes the rotation at most."""

    a: Path
    b: Path
    chord: float


@dataclass(kw_only=True)
class Pair:
    """Two descriptions with the same joints.

    Attributes:
        names: frames that both have.
        a, b: each frame's line.
        ranges: of the joints that slide, (n, 2) [m].
        scales: common denominator of each joint's factors.
    """

    names: tuple[str, ...]
    a: dict[str, Line]
    b: dict[str, Line]
    ranges: Array
    scales: tuple[int, ...]
    _gauge: Gauge = field(default_factory=Gauge)
    _known: dict[tuple[Motion, tuple[Motion | None, ...]], Polynomial] = field(default_factory=dict)

    @classmethod
    def of(cls, a: Chains, b: Chains, ranges: Array) -> Pair:
        """The pair of two descriptions, at the frames that both have."""
        names = tuple(name for name in a.paths if name in b.paths)
        both = [c.only(names) for c in (a, b)]
        return cls(names=names, a=normal(both[0]), b=normal(both[1]), ranges=ranges, scales=scales_of(both))

    @cached_property
    def deviations(self) -> dict[str, Deviation | None]:
        """What is left at each frame when all that commutes has moved to its end; None if the joints are not the same."""
        return {name: self._gauge.at_end(self.a[name], self.b[name]) for name in self.names}

    def by_joints(self, name: str) -> tuple[tuple[float, float], tuple[bool, bool]]:
        """Bounds by constants alone: position [m], chord; and for each whether the discrepancy is the same everywhere.

        Infinite if both chains do not have the same joints in the same order.
        """
        end = self.deviations[name]
        if end is None:
            return (math.inf, math.inf), (False, False)
        own, left = size_of(end.E), carried(end, reaches(self.a[name], self.ranges))
        bounds = tuple((x + y) * (1.0 + 1e-15) for x, y in zip(own, left, strict=True))
        constant = tuple(y <= 1e-6 * x or (x == 0.0 and y == 0.0) for x, y in zip(own, left, strict=True))
        return (bounds[0], bounds[1]), (constant[0], constant[1])

    def slope(self, name: str) -> float | None:
        """Upper bound on how fast the position's discrepancy grows with the slides, by constants alone [m/m]."""
        end, slope, chord = self.deviations[name], 0.0, 0.0
        if end is None:
            return None
        for motion, residual in zip(self.a[name].motions, end.residuals, strict=True):
            chord += residual.chord
            if not motion.turns:
                slope += chord / math.sqrt(2.0) * float(sum(abs(x) for x in motion.row))
        return slope * (1.0 + 1e-12)

    @cached_property
    def _most(self) -> tuple[float, float]:
        """What joints that drop out may leave behind, position [m] and chord: a small share of the largest bound."""
        rough = [self.by_joints(name)[0] for name in self.names]
        largest = [max((bound[i] for bound in rough if math.isfinite(bound[i])), default=0.0) for i in range(2)]
        return NEGLIGIBLE * largest[0], NEGLIGIBLE * largest[1]

    def _start(self, name: str) -> Start:
        """How many of a frame's joints, from the base, drop out: what they leave behind is little."""
        line, other = self.a[name], self.b[name]
        if len(line.motions) != len(other.motions):
            return Start(0, None)
        start, reach = Start(0, None), reaches(line, self.ranges)
        for depth, (x, y) in enumerate(zip(line.motions, other.motions, strict=True)):
            at = self._gauge.before(x, y)
            if at is None or any(left > limit for left, limit in zip(carried(at, reach), self._most, strict=True)):
                break
            start = Start(depth, at)
        return start

    def multiplied_out(self, name: str) -> tuple[Coefficients, Coefficients] | None:
        """The difference of both chains at a frame as polynomials, position and rotation. None if they have too many terms."""
        start, lines = self._start(name), (self.a[name], self.b[name])
        if any(_terms(line, start.depth) > MOST_TERMS for line in lines) or max(self.scales, default=1) > LARGEST_SCALE:
            return None
        deviation = start.deviation
        begins = (deviation.E, identity()) if deviation is not None else (None, None)
        key = tuple(line.motions[start.depth] if start.depth < len(line.motions) else None for line in lines)
        one, other = (self._finished(line, start.depth, begin, key) for line, begin in zip(lines, begins, strict=True))
        functions = [of_terms(subtract(x, y), self.scales, self.ranges) for x, y in zip(one, other, strict=True)]
        left = carried(deviation, reaches(lines[0], self.ranges)) if deviation is not None else (0.0, 0.0)
        R, p = (replace(f, error=f.error + x) for f, x in zip(functions, reversed(left), strict=True))
        return p, R

    def rests(self, name: str) -> Rests:
        """Both lines of a frame from their first difference on."""
        start, a, b = self._start(name), self.a[name], self.b[name]
        if start.deviation is None:
            return Rests(_rest(a, 0, None), _rest(b, 0, None), 0.0)
        chord = carried(start.deviation, reaches(a, self.ranges))[1]
        return Rests(_rest(a, start.depth, start.deviation.E), _rest(b, start.depth, identity()), chord)

    def _finished(self, line: Line, depth: int, begin: Matrix | None, key: tuple[Motion | None, ...]) -> tuple[Terms, Terms]:
        """The terms of a line, rotation and origin, from its start on.

        depth: how many joints are left out.
        begin: the constant there, in place of the joints before it; None if none is left out.
        key: the first joints that are not left out, of both lines: what is multiplied out depends on them.
        """
        polynomial = Polynomial.one(self.scales)
        for motion in line.motions[depth:]:
            if (motion, key) not in self._known:
                known = polynomial.copy()
                first = motion.depth == depth and begin is not None
                known.then(Step(T=begin if first else motion.before))
                known.then(motion.step)
                self._known[motion, key] = known
            polynomial = self._known[motion, key]
        end = polynomial.copy()
        end.then(Step(T=line.tail))
        return end.finished()

    @cached_property
    def tries(self) -> list[At]:
        """Configurations at which every frame is looked at, always the same."""
        return [At(q) for q in self._some(TRIED)]

    def inside(self, q: Array) -> Array:
        """q (n,) with every joint that has a range moved into it."""
        low, high = self.ranges.T
        return np.asarray(np.where(low < high, np.clip(q, low, high), q))

    def _some(self, count: int) -> list[Array]:
        rng = np.random.default_rng(0)
        turns = math.pi * np.array(self.scales, dtype=np.float64)
        slides = np.array([self._slides(j) for j in range(len(turns))], dtype=bool)
        low, high = np.where(slides, self.ranges[:, 0], -turns), np.where(slides, self.ranges[:, 1], turns)
        return list(rng.uniform(low, high, (count, len(turns))))

    def _slides(self, joint: int) -> bool:
        return joint in {j for lines in (self.a, self.b) for line in lines.values() for j in sliding(line)}


def sliding(line: Line) -> set[int]:
    """The joints that slide something on a line, whatever else they do."""
    return {j for motion in line.motions if not motion.turns for j, factor in enumerate(motion.row) if factor}


def _rest(line: Line, depth: int, begin: Matrix | None) -> Path:
    """A line from a joint on, with a constant in place of what comes before."""
    steps: list[Step] = []
    for motion in line.motions[depth:]:
        steps += [Step(T=motion.before if steps or begin is None else begin), motion.step]
    return (*steps, Step(T=line.tail))


def _terms(line: Line, depth: int) -> float:
    """About how many terms a line's rotation has after its first joints."""
    turning = sum(m.turns for m in line.motions[depth:])
    return 3.0**turning / 2.0 if turning < 200 else math.inf
