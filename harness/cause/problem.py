"""Two models that disagree, as a search sees them: both descriptions, what was seen of both, and what counts as agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from harness import se3
from harness.cause import fit
from harness.cause.changes import Change, of_parameter
from harness.kinematics.mechanism import Mechanism, Parameter
from harness.kinematics.recipes import Recipe
from harness.se3 import Array

End: TypeAlias = Literal["a", "b"]
FAITHFUL = 0.5  # a model of a source reproduces it to this part of the tolerance, or is not used


class Knob(NamedTuple):
    """One number of one description."""

    end: End
    parameter: Parameter


@dataclass(frozen=True)
class Seen:
    """Placements of both at the configurations q (N, n): (N, F, 4, 4) each."""

    q: Array
    a: Array
    b: Array


@dataclass(frozen=True, kw_only=True)
class Problem:
    """a is the reference, b the source; a recipe is None if that one does not compute what its description says.

    names: the compared frames; rigid: those whose offset is measured; tolerance [m], [rad]; behind: the constant transform
    (4, 4) that was put behind what the source gave for a frame, where there is one; labels: what the two descriptions are
    called; sources: what differs, in words; engines: who computed.
    """

    a: Recipe | None
    b: Recipe | None
    names: tuple[str, ...]
    rigid: frozenset[str]
    seen: Seen
    check: Seen
    tolerance: tuple[float, float]
    behind: Mapping[str, Array] = field(default_factory=dict)
    labels: tuple[str, str] = ("a", "b")
    sources: tuple[str, str] = ("a", "b")
    engines: tuple[str, str] = ("a", "b")
    _added: dict[tuple[End, int], Array] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def fitted(self) -> list[int]:
        """Frames that numbers are fitted to: those whose offset is known; all, if it is of none that moves."""
        known = [i for i, name in enumerate(self.names) if name not in self.rigid]
        moving = [i for i in known if np.ptp(self.seen.a[:, i], axis=0).max(initial=0.0) > 1e-9]
        return known if moving else list(range(len(self.names)))

    @property
    def fitted_names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.names[i] for i in self.fitted)

    def added(self, end: End, seen: Seen) -> Array:
        """What the engine of one side adds to what its description says, float32 for one: (N, F, 4, 4)."""
        recipe, was = (self.a, seen.a) if end == "a" else (self.b, seen.b)
        key = (end, id(seen))
        if key not in self._added and recipe is not None:
            self._added[key] = was - recipe.mechanism.placements(seen.q, self.names)
        return self._added[key]

    def unturned(self, T: Array) -> Array:
        """b's placements (N, F, 4, 4) if it gave their inverses."""
        Y = np.array([self.behind.get(name, np.eye(4)) for name in self.names])
        return np.asarray(se3.inverse(T @ se3.inverse(Y)) @ Y)

    @property
    def reach(self) -> float:
        """Largest distance of a frame from the base [m], at least 0.1."""
        return max(0.1, float(np.linalg.norm(self.seen.a[..., :3, 3], axis=-1).max()))


@dataclass(frozen=True, kw_only=True)
class State:
    """A problem with some repairs made: recipes edited, numbers shifted [m or rad], one side's placements inverted."""

    problem: Problem
    a: Recipe | None
    b: Recipe | None
    edits: tuple[Change, ...] = ()
    shifts: Mapping[Knob, float] = field(default_factory=dict)
    inverse: bool = False

    @classmethod
    def start(cls, problem: Problem) -> State:
        """Nothing repaired yet."""
        return cls(problem=problem, a=problem.a, b=problem.b)

    @property
    def size(self) -> int:
        """Number of changes."""
        return len(self.edits) + len(self.shifts)

    def mechanism(self, end: End) -> Mechanism | None:
        """One side's mechanism with its numbers shifted; None if that side has no model."""
        recipe = self.a if end == "a" else self.b
        if recipe is None:
            return None
        return recipe.mechanism.shifted({k.parameter: x for k, x in self.shifts.items() if k.end == end})

    def placements(self, seen: Seen) -> tuple[Array, Array]:
        """Both sides at the configurations of `seen`: as they were seen where nothing is changed, as modelled else."""
        both = []
        ends: tuple[End, End] = ("a", "b")
        for end in ends:
            recipe, original = (self.a, self.problem.a) if end == "a" else (self.b, self.problem.b)
            changed = recipe is not original or any(k.end == end for k in self.shifts)
            mechanism = self.mechanism(end) if changed else None
            if mechanism is None:
                both.append(seen.a if end == "a" else seen.b)
            else:
                both.append(mechanism.placements(seen.q, self.problem.names) + self.problem.added(end, seen))
        return both[0], self.problem.unturned(both[1]) if self.inverse else both[1]

    @cached_property
    def now(self) -> tuple[Array, Array]:
        """Both sides at the configurations that numbers are fitted at."""
        return self.placements(self.problem.seen)

    @cached_property
    def left(self) -> float:
        """Root mean square of what is left between the two, over the fitted frames and all entries."""
        T_a, T_b = (T[:, self.problem.fitted] for T in self.now)
        return float(np.sqrt(((T_a - T_b) ** 2).mean()))

    def errors(self, seen: Seen | None = None) -> tuple[float, float]:
        """Largest discrepancy [m], [rad] over all frames, offsets of rigid frames measured again."""
        T_a, T_b = self.now if seen is None else self.placements(seen)
        return fit.errors(measured(T_a, T_b, self.problem), T_b)

    def agrees(self, thorough: bool = True) -> bool:
        """Whether the repair works: everything within tolerance, where it was fitted and where it was not."""
        limits = self.problem.tolerance
        seen = (None, self.problem.check) if thorough else (None,)
        return all(p <= limits[0] and r <= limits[1] for p, r in (self.errors(s) for s in seen))

    def edited(self, change: Change, a: Recipe | None, b: Recipe | None, inverse: bool = False) -> State:
        """With one structural repair more."""
        return replace(self, a=a, b=b, edits=(*self.edits, change), inverse=self.inverse != inverse)

    def shifted(self, shifts: Mapping[Knob, float], left: float | None = None) -> State:
        """With these shifts instead; `left`, if it is known already, need not be computed."""
        state = replace(self, shifts=dict(shifts))
        if left is not None:
            state.__dict__["left"] = left  # where cached_property keeps it
        return state

    def changes(self) -> tuple[Change, ...]:
        """Everything changed, in words."""
        words = []
        for knob, size in self.shifts.items():
            recipe = self.a if knob.end == "a" else self.b
            if recipe is None:
                continue
            i = 0 if knob.end == "a" else 1
            before = recipe.mechanism.value(knob.parameter)
            by = self.problem.sources[1 - i]
            words.append(of_parameter(knob.end, knob.parameter, size, before, self.problem.labels[i], by, self.left))
        return (*self.edits, *words)


def measured(T_a: Array, T_b: Array, problem: Problem) -> Array:
    """a's placements with the offsets of rigid frames measured against b's."""
    rigid = [i for i, name in enumerate(problem.names) if name in problem.rigid]
    if not rigid or not (np.isfinite(T_a).all() and np.isfinite(T_b).all()):
        return T_a
    out = T_a.copy()
    out[:, rigid] = T_a[:, rigid] @ fit.behind(T_a[:, rigid], T_b[:, rigid])
    return out
