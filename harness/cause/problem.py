"""Two models that disagree, as a search sees them: their descriptions, their placements, and what counts as agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from harness import se3
from harness.cause import fit
from harness.cause.budget import Budget
from harness.cause.changes import Change, of_parameter
from harness.cause.probe import PARTS, Observations, Part, Probe
from harness.kinematics.mechanism import Mechanism, Parameter
from harness.kinematics.recipes import Recipe
from harness.se3 import Array

End: TypeAlias = Literal["a", "b"]
ENDS: tuple[End, End] = ("a", "b")
FAITHFUL = 0.5  # a model of a source reproduces it to this part of the tolerance, or is not used


class Knob(NamedTuple):
    """One number of one description."""

    end: End
    parameter: Parameter


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A reference `a` and a source `b` that disagree.

    a, b: their descriptions. None if that side does not compute what its description says.
    names: the compared frames.
    rigid: those frames whose offset is measured, not declared.
    probe: the configurations at which both were asked.
    observed: what both gave there, for each part of the probe.
    tolerance: what counts as agreement, [m] and [rad].
    offsets_after: for a frame, the constant transform (4, 4) by which the source's placements were multiplied from the right.
    labels: what the two descriptions are called.
    sources: what differs, in words: a description, or the engine that reads it otherwise.
    engines: who computed.
    """

    a: Recipe | None
    b: Recipe | None
    names: tuple[str, ...]
    rigid: frozenset[str]
    probe: Probe
    observed: Mapping[Part, Observations]
    tolerance: tuple[float, float]
    offsets_after: Mapping[str, Array] = field(default_factory=dict)
    labels: tuple[str, str] = ("a", "b")
    sources: tuple[str, str] = ("a", "b")
    engines: tuple[str, str] = ("a", "b")

    @cached_property
    def budget(self) -> Budget:
        """How much work the search for a cause has done, and may do."""
        return Budget(self.probe.random.shape[1])

    @cached_property
    def fitted_frames(self) -> list[int]:
        """Indices of the frames that numbers are fitted to: those whose offset is known. All frames, if none of those moves."""
        known = [i for i, name in enumerate(self.names) if name not in self.rigid]
        moving = [i for i in known if np.ptp(self.observed["fit"].a[:, i], axis=0).max(initial=0.0) > 1e-9]
        return known if moving else list(range(len(self.names)))

    @property
    def fitted_names(self) -> tuple[str, ...]:
        """Names of the fitted frames."""
        return tuple(self.names[i] for i in self.fitted_frames)

    @cached_property
    def unmodelled(self) -> Unmodelled:
        """What each engine adds to what its description says, float32 rounding for one: (N, F, 4, 4) for each end and part."""
        return Unmodelled(self)

    def inverted(self, T: Array) -> Array:
        """b's placements (N, F, 4, 4) if it had given the inverse of each."""
        Y = np.array([self.offsets_after.get(name, np.eye(4)) for name in self.names])
        return np.asarray(se3.inverse(T @ se3.inverse(Y)) @ Y)

    @property
    def reach(self) -> float:
        """Largest distance of a frame from the base [m], at least 0.1."""
        return max(0.1, float(np.linalg.norm(self.observed["fit"].a[..., :3, 3], axis=-1).max()))


class Unmodelled(dict[tuple[End, Part], Array]):
    """Observed less modelled placements, (N, F, 4, 4), computed when first asked for. KeyError for an end without a model."""

    def __init__(self, problem: Problem) -> None:
        super().__init__()
        self._problem = problem

    def __missing__(self, key: tuple[End, Part]) -> Array:
        end, part = key
        observed = self._problem.observed[part]
        recipe, T = (self._problem.a, observed.a) if end == "a" else (self._problem.b, observed.b)
        if recipe is None:
            raise KeyError(key)
        self[key] = T - recipe.mechanism.placements(observed.q, self._problem.names)
        return self[key]


@dataclass(frozen=True, kw_only=True)
class State:
    """A problem with some repairs made.

    a, b: the descriptions, structural repairs made.
    edits: those structural repairs, in order.
    shifts: for each changed number by how much it is changed [m or rad].
    inverse: whether the source's placements are inverted.
    """

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

    def recipe(self, end: End) -> Recipe | None:
        """One side's description, structural repairs made."""
        return self.a if end == "a" else self.b

    def mechanism(self, end: End) -> Mechanism | None:
        """One side's mechanism with its numbers shifted; None if that side has no model."""
        recipe = self.recipe(end)
        if recipe is None:
            return None
        return recipe.mechanism.shifted({k.parameter: x for k, x in self.shifts.items() if k.end == end})

    def placements(self, part: Part) -> tuple[Array, Array]:
        """Both sides at one part of the probe, (N, F, 4, 4) each: as observed where nothing is changed, else as modelled."""
        observed = self.problem.observed[part]
        T_a, T_b = self._one_side("a", part, observed.a), self._one_side("b", part, observed.b)
        return T_a, self.problem.inverted(T_b) if self.inverse else T_b

    def _one_side(self, end: End, part: Part, observed: Array) -> Array:
        original = self.problem.a if end == "a" else self.problem.b
        changed = self.recipe(end) is not original or any(k.end == end for k in self.shifts)
        mechanism = self.mechanism(end) if changed else None
        if mechanism is None:
            return observed
        q = self.problem.observed[part].q
        self.problem.budget.spend(len(mechanism.factors), len(q))
        return mechanism.placements(q, self.problem.names) + self.problem.unmodelled[end, part]

    @cached_property
    def now(self) -> tuple[Array, Array]:
        """Both sides where numbers are fitted: `placements("fit")`, computed once."""
        return self.placements("fit")

    @cached_property
    def residual(self) -> float:
        """How far the two sides are still apart: root mean square over all entries of the fitted frames' placements."""
        T_a, T_b = (T[:, self.problem.fitted_frames] for T in self.now)
        return float(np.sqrt(((T_a - T_b) ** 2).mean()))

    def errors(self, part: Part = "fit") -> tuple[float, float]:
        """Largest discrepancy [m], [rad] over all frames, offsets of rigid frames measured again."""
        T_a, T_b = self.now if part == "fit" else self.placements(part)
        return fit.errors(with_measured_offsets(T_a, T_b, self.problem), T_b)

    def agrees(self) -> bool:
        """Whether the repair works: everything within tolerance, where it was fitted and where it was not."""
        limits = self.problem.tolerance
        return all(p <= limits[0] and r <= limits[1] for p, r in map(self.errors, PARTS))

    def edited(self, change: Change, a: Recipe | None, b: Recipe | None, inverse: bool = False) -> State:
        """With one structural repair more.

        change: what it changes, in words.
        a, b: the descriptions after it.
        inverse: whether it inverts the source's placements.
        """
        return replace(self, a=a, b=b, edits=(*self.edits, change), inverse=self.inverse != inverse)

    def shifted(self, shifts: Mapping[Knob, float], residual: float | None = None) -> State:
        """With these shifts instead of its own.

        shifts: for each number by how much it is changed [m or rad].
        residual: the new state's residual, if it is known already.
        """
        state = replace(self, shifts=dict(shifts))
        if residual is not None:
            state.__dict__["residual"] = residual  # where cached_property keeps it
        return state

    def changes(self) -> tuple[Change, ...]:
        """Everything changed, in words."""
        words = []
        for knob, size in self.shifts.items():
            recipe = self.recipe(knob.end)
            if recipe is None:
                continue
            i = 0 if knob.end == "a" else 1
            before = recipe.mechanism.value(knob.parameter)
            by = self.problem.sources[1 - i]
            words.append(of_parameter(knob.end, knob.parameter, size, before, self.problem.labels[i], by, self.residual))
        return (*self.edits, *words)


def with_measured_offsets(T_a: Array, T_b: Array, problem: Problem) -> Array:
    """a's placements (N, F, 4, 4) with the offsets of rigid frames measured against b's."""
    rigid = [i for i, name in enumerate(problem.names) if name in problem.rigid]
    if not rigid or not (np.isfinite(T_a).all() and np.isfinite(T_b).all()):
        return T_a
    out = T_a.copy()
    out[:, rigid] = T_a[:, rigid] @ fit.fit_constant_offset(T_a[:, rigid], T_b[:, rigid])
    return out
