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
    _known: dict[Motion, Polynomial] = field(default_factory=dict)

    @classmethod
    def of(cls, a: Chains, b: Chains, ranges: Array) -> Pair:
        """The pair of two descriptions, at the frames that both have."""
        names = tuple(name for name in a.paths if name in b.paths)
        both = [Chains(c.joints, {name: c.paths[name] for name in names}) for c in (a, b)]
        return cls(names=names, a=normal(both[0]), b=normal(both[1]), ranges=ranges, scales=scales_of(both))

    def deviation(self, name: str) -> Deviation | None:
        """What is left at a frame when all that commutes has moved to its end; None if the joints are not the same."""
        return self._gauge.at_end(self.a[name], self.b[name])

    def by_joints(self, name: str) -> tuple[tuple[float, float], tuple[bool, bool]]:
        """Bounds by constants alone: position [m], chord; and for each whether the discrepancy is the same everywhere.

        Infinite if both chains do not have the same joints in the same order.
        """
        end = self.deviation(name)
        if end is None:
            return (math.inf, math.inf), (False, False)
        own, left = size_of(end.E), carried(end, reaches(self.a[name], self.ranges))
        bounds = tuple((x + y) * (1.0 + 1e-15) for x, y in zip(own, left, strict=True))
        constant = tuple(y <= 1e-6 * x or (x == 0.0 and y == 0.0) for x, y in zip(own, left, strict=True))
        return (bounds[0], bounds[1]), (constant[0], constant[1])

    def slope(self, name: str) -> float | None:
        """Upper bound on how fast the position's discrepancy grows with the slides, by constants alone [m/m]."""
        end, slope, chord = self.deviation(name), 0.0, 0.0
        if end is None:
            return None
        for motion, residual in zip(self.a[name].motions, end.residuals, strict=True):
            chord += residual.chord
            if not motion.turns:
                slope += chord / math.sqrt(2.0) * float(sum(abs(x) for x in motion.row))
        return slope * (1.0 + 1e-12)

    @cached_property
    def _start(self) -> Start:
        """How many joints from the base drop out: what they leave behind is a small share of the largest bound."""
        rough = {name: self.by_joints(name)[0] for name in self.names}
        name = max(self.names, key=lambda n: len(self.a[n].motions))
        line, other = self.a[name], self.b[name]
        if len(line.motions) != len(other.motions):
            return Start(0, None)
        most = [NEGLIGIBLE * max(bound[i] for bound in rough.values()) for i in range(2)]
        start, reach = Start(0, None), reaches(line, self.ranges)
        for depth, (x, y) in enumerate(zip(line.motions, other.motions, strict=True)):
            at = self._gauge.before(x, y)
            if at is None or any(left > limit for left, limit in zip(carried(at, reach), most, strict=True)):
                break
            start = Start(depth, at)
        return start

    def multiplied_out(self, name: str) -> tuple[Coefficients, Coefficients] | None:
        """The difference of both chains at a frame as polynomials, position and rotation. None if they have too many terms."""
        start, lines = self._start, (self.a[name], self.b[name])
        if any(_terms(line, start.depth) > MOST_TERMS for line in lines):
            return None
        if start.deviation is not None and min(len(line.motions) for line in lines) <= start.depth:
            return None  # before the first difference: constants say it all
        deviation = start.deviation
        begins = (deviation.E, identity()) if deviation is not None else (None, None)
        one, other = (self._finished(line, begin) for line, begin in zip(lines, begins, strict=True))
        functions = [of_terms(subtract(x, y), self.scales, self.ranges) for x, y in zip(one, other, strict=True)]
        left = carried(deviation, reaches(lines[0], self.ranges)) if deviation is not None else (0.0, 0.0)
        R, p = (replace(f, error=f.error + x) for f, x in zip(functions, reversed(left), strict=True))
        return p, R

    def rests(self, name: str) -> Rests:
        """Both lines of a frame from their first difference on."""
        start, a, b = self._start, self.a[name], self.b[name]
        if start.deviation is None:
            return Rests(_rest(a, 0, None), _rest(b, 0, None), 0.0)
        chord = carried(start.deviation, reaches(a, self.ranges))[1]
        return Rests(_rest(a, start.depth, start.deviation.E), _rest(b, start.depth, identity()), chord)

    def _finished(self, line: Line, begin: Matrix | None) -> tuple[Terms, Terms]:
        """The terms of a line, rotation and origin, from its start on.

        begin: the constant there, in place of the joints before it; None if none is left out.
        """
        depth = self._start.depth
        polynomial = Polynomial.one(self.scales)
        for motion in line.motions[depth:]:
            if motion not in self._known:
                known = polynomial.copy()
                first = motion.depth == depth and begin is not None
                known.then(Step(T=begin if first else motion.before))
                known.then(motion.step)
                self._known[motion] = known
            polynomial = self._known[motion]
        end = polynomial.copy()
        end.then(Step(T=line.tail))
        return end.finished()

    @cached_property
    def tries(self) -> list[At]:
        """Configurations at which every frame is looked at, always the same."""
        return [At(q) for q in self._some(TRIED)]

    def middle(self) -> Array:
        """A configuration at which nothing in particular happens, (n,)."""
        return np.asarray(self.ranges.mean(axis=1))

    def _some(self, count: int) -> list[Array]:
        rng = np.random.default_rng(0)
        turns = math.pi * np.array(self.scales)
        slides = np.array([self._slides(j) for j in range(len(turns))], dtype=bool)
        low, high = np.where(slides, self.ranges[:, 0], -turns), np.where(slides, self.ranges[:, 1], turns)
        return list(rng.uniform(low, high, (count, len(turns))))

    def _slides(self, joint: int) -> bool:
        motions = {m for lines in (self.a, self.b) for line in lines.values() for m in line.motions}
        return any(m.row[joint] and not m.turns for m in motions)


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
