"""What a view shows, without the showing: the sources at one configuration, how far apart they are, and where to look."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.description.model import RobotModel
from harness.errors import EngineFailed
from harness.kinematics.singular import singular
from harness.run.options import Options
from harness.run.robot import load
from harness.run.streaming import compare
from harness.run.worst import find_worst
from harness.se3 import Array, position_error, rotation_error
from harness.workers.pool import Workers


@dataclass(frozen=True, kw_only=True)
class Apart:
    """One source at one frame, off the reference [m], [rad]; within: no more than the tolerance."""

    source: str
    frame: str
    position: float
    rotation: float
    within: bool


@dataclass(frozen=True)
class Place:
    """A configuration to jump to: what it is, and q (n,)."""

    kind: str
    name: str
    q: Array


class Session:
    """All chosen sources of a robot, bound as in a cross-check, asked one configuration at a time by any thread."""

    def __init__(self, model: RobotModel, options: Options, workers: Workers) -> None:
        """Start the engines and compare them once, to know where they are furthest apart.

        Raises InputError for wrong options, EngineFailed if the reference does not run.
        """
        self.model, self.options = model, options
        self._lock = threading.Lock()
        self.run = load(model, options, workers)
        self.run.comparison = compare(self.run, workers, None)
        reference = self.run.reference
        if reference.bound is None or self.run.comparison is None:
            raise EngineFailed(reference.name, f"the reference does not run: {reference.reason}")
        find_worst(self.run)

    @property
    def reference(self) -> str:
        """Name of the source that the others are compared with."""
        return self.run.reference.name

    @property
    def sources(self) -> list[str]:
        """Names of the sources that run, reference first."""
        return [o.name for o in self.run.outcomes if o.bound is not None]

    @property
    def absent(self) -> dict[str, str]:
        """Why each of the others does not run."""
        return {o.name: o.reason for o in self.run.outcomes if o.bound is None}

    @cached_property
    def frames(self) -> list[str]:
        """Names of the mapped frames in the order of the chain."""
        order = {label: i for i, label in enumerate(self.model.table.frames)}
        return [f.name for f in sorted(self.model.frames.frames, key=lambda f: order[f.dh])]

    def placements(self, q: Array) -> dict[str, dict[str, Array]]:
        """Placements (4, 4) by source and frame at q (n,); a source that fails now is left out, and `absent` says why."""
        names = [f.name for f in self.model.frames.frames]
        found = {}
        with self._lock:
            for outcome in self.run.outcomes:
                if outcome.bound is None:
                    continue
                try:
                    T = outcome.bound.mapped(q[None, :])
                    found[outcome.name] = {names[i]: placement[0] for i, placement in T.items()}
                except Exception as error:  # an engine's failure is its result
                    outcome.fail(error)
        return found

    def apart(self, placements: Mapping[str, Mapping[str, Array]]) -> list[Apart]:
        """Discrepancies from the reference, source by source, from the base on."""
        base = placements.get(self.reference, {})
        rows = []
        for outcome in self.run.others:
            limits = self.run.tolerance(outcome)
            for frame in self.frames:
                T_a, T_b = base.get(frame), placements.get(outcome.name, {}).get(frame)
                if T_a is None or T_b is None:
                    continue
                errors = (float(position_error(T_a, T_b)), float(rotation_error(T_a, T_b)))
                within = all(e <= limit for e, limit in zip(errors, limits, strict=True))
                rows.append(Apart(source=outcome.name, frame=frame, position=errors[0], rotation=errors[1], within=within))
        return rows

    @cached_property
    def places(self) -> list[Place]:
        """Published and named configurations, the worst of each source, and singular ones."""
        law = self.model.configurations
        places = [Place("published" if c.published else "fixed", c.name, c.q) for c in law.fixed]
        places += [
            Place(
                "worst", f"{o.name} at {self.model.frames.frames[o.worst.frame].name}", law.one(self.options.seed, o.worst.index)
            )
            for o in self.run.others
            if o.worst is not None
        ]
        for i, (q, value) in enumerate(self._singular()):
            places.append(Place("singular", f"{i + 1}: smallest singular value {value:.1g}", q))
        return places

    def _singular(self) -> list[tuple[Array, float]]:
        law, in_house = self.model.configurations, self.run.in_house
        last = max(in_house.view.available, key=lambda i: self.frames.index(self.model.frames.frames[i].name))
        reach = self.run.discrepancies().reach
        with contextlib.suppress(np.linalg.LinAlgError):
            return singular(lambda q: in_house.mapped(q)[last], law.lattice()[:512], law.lower, law.upper, max(reach, 1e-3))
        return []
