"""Which sources take part, and each engine seen through the model's mapping: by joint name, by frame name."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from harness import se3
from harness.analysis.components import View, components, mapped, matrices
from harness.analysis.verdict import Deviation
from harness.description.joints import JointMap
from harness.description.model import RobotModel, Tolerance
from harness.engines.base import Engine
from harness.engines.registry import REFERENCE, adapter_of
from harness.errors import EngineFailed, EngineUnavailable, InputError, nearest
from harness.se3 import Array

Status: TypeAlias = Literal["ran", "not run", "failed"]


@dataclass(frozen=True)
class Planned:
    """A source that is to run."""

    name: str
    required: bool
    tolerance: Tolerance


@dataclass
class Participant:
    """A planned source and what became of it. `bound` is None unless it runs."""

    planned: Planned
    bound: Bound | None = None
    status: Status = "ran"
    reason: str = ""
    install: str = ""

    @property
    def name(self) -> str:
        """Source name."""
        return self.planned.name

    def fail(self, error: Exception) -> None:
        """Take the source out and keep why. What third-party code raises is its result, not the end of the run."""
        self.bound = None
        self.status = "not run" if isinstance(error, EngineUnavailable) else "failed"
        self.reason = error.reason if isinstance(error, EngineUnavailable | EngineFailed) else f"{type(error).__name__}: {error}"
        self.install = (error.install or "") if isinstance(error, EngineUnavailable) else ""


def plan(model: RobotModel, chosen: Sequence[str], reference: str) -> list[Planned]:
    """The reference first, then the sources of model.toml, or those chosen (each then required).

    Raises InputError for an unknown source, or if nothing is left to compare.
    """
    entries = {entry.name: entry for entry in model.file.source}
    names = [reference, *(chosen or [REFERENCE, *entries])]
    planned = []
    for name in dict.fromkeys(names):
        _check_known(name)
        if not name.startswith("dh:") and model.urdf is None:
            raise InputError(f"{model.name} has no [urdf] table for it", key=name)
        entry = entries.get(name)
        required = bool(chosen) or entry is None or entry.required
        planned.append(Planned(name, required, (entry and entry.tolerance) or model.file.tolerance))
    if len(planned) < 2:
        raise InputError(
            f"{model.name}: nothing to compare with the reference {reference}",
            hint=f"choose among: {', '.join(entries)}",
        )
    return planned


def _check_known(name: str) -> None:
    """Raise InputError unless `name` is a registered source; a broken adapter is known, and will say so itself."""
    with contextlib.suppress(EngineUnavailable):
        adapter_of(name)


def pair_tolerance(a: Planned, reference: Planned) -> tuple[float, float]:
    """Tolerance (m, rad) of a source against the reference.

    Tolerances on file are against the in-house FK; against another reference they add up (triangle inequality).
    """
    if reference.name == REFERENCE:
        return a.tolerance.position, a.tolerance.rotation
    own = [p.tolerance for p in (a, reference) if p.name != REFERENCE]
    return sum(t.position for t in own), sum(t.rotation for t in own)


def deviation_on_file(model: RobotModel, source: str, reference: str, frame: str) -> tuple[Deviation, str] | None:
    """The accepted deviation of `source` from `reference` at `frame`, and its reason.

    On file it is against the in-house FK. Another reference brings its own: two sources with the same one agree.
    """

    def on_file(name: str) -> tuple[Deviation, str] | None:
        for entry in model.file.accepted:
            if name in entry.sources and frame in entry.frames:
                return Deviation(entry.position, entry.rotation, entry.within), entry.reason
        return None

    own, theirs = on_file(source), on_file(reference)
    if theirs is None or own is None:
        return own or theirs
    return None


@dataclass
class Bound:
    """An engine bound to a model: asked in the model's joint order, answering at the mapped frames.

    `frames` are the engine's frame names that are read; `view` tells how mapped frames follow from them; `missing` are
    indices of mapped frames the engine does not have, though its description does; `seconds` is the time spent inside the engine.
    """

    engine: Engine
    joint_map: JointMap
    frames: tuple[str, ...]
    view: View
    missing: tuple[int, ...] = ()
    seconds: float = 0.0

    def should_have(self, frame: int) -> bool:
        """Whether the mapped frame with this index can be expected of this source: its description has it."""
        return self.view.slots[frame] >= 0 or frame in self.missing

    def raw(self, q: Array) -> Array:
        """Placements as the engine returns them, q (N, n) in model order: (N, len(frames), 4, 4)."""
        values = self.joint_map.values(q, self.engine.joints)
        start = time.perf_counter()
        try:
            return self.engine.placements(values, self.frames)
        finally:
            self.seconds += time.perf_counter() - start

    def mapped(self, q: Array) -> dict[int, Array]:
        """Placements (N, 4, 4) of each mapped frame this source has, by its index, at q (N, n)."""
        T = matrices(mapped(components(self.raw(q)), self.view))
        return {frame: T[:, i] for i, frame in enumerate(self.view.available)}


def bind(engine: Engine, model: RobotModel, offsets: Mapping[str, Array]) -> Bound:
    """Bind an engine to a model. `offsets` are the rigid offsets by frame name; an unmeasured one counts as none.

    Raises EngineFailed if the engine does not have the base frame or a joint that the description has not.
    """
    kind = engine.source.partition(":")[0]
    joint_map = model.joint_map(kind)
    if unknown := [j for j in engine.joints if j not in joint_map.names]:
        raise EngineFailed(
            engine.source,
            f"has a joint {unknown[0]!r} that the description does not: {nearest(unknown[0], joint_map.names)}",
        )
    frames = model.frames.frames
    if kind == "dh":
        names = list(dict.fromkeys(f.dh for f in frames))
        slots = tuple(names.index(f.dh) for f in frames)
        constant = [offsets.get(f.name, np.eye(4)) if f.offset is None else f.offset for f in frames]
        return Bound(engine, joint_map, tuple(names), View(slots, np.array(constant), None))
    base = model.frames.base.urdf
    if base is None or base not in engine.frames:
        raise EngineFailed(engine.source, f"does not have the base frame {base!r}")
    wanted = [f.urdf for f in frames]
    names = [name for name in dict.fromkeys(wanted) if name is not None and name in engine.frames]
    slots = tuple(names.index(name) if name in names else -1 for name in wanted)
    missing = tuple(i for i, f in enumerate(frames) if f.urdf is not None and f.urdf not in names)
    view = View(slots, np.tile(np.eye(4), (len(frames), 1, 1)), names.index(base))
    return Bound(engine, joint_map, tuple(names), view, missing=missing)


def measure_rigid(model: RobotModel, in_house: Bound, urdf_source: Bound, q: Array) -> dict[str, Array]:
    """Offset of each rigid frame, by frame name: the mean of T_dh_link = T_base_dh^-1 T_base_link over q (N, n).

    A mean over evenly spread configurations, not one of them: an offset taken at one absorbs whatever discrepancy there is
    at that one, and shows it doubled elsewhere. Rotations are averaged in the chordal sense, by projecting the mean matrix
    on SO(3) (Moakher 2002, doi:10.1137/S0895479801383877). Frames whose placements are not finite are left out.
    """
    T_base_dh, T_base_link = in_house.mapped(q), urdf_source.mapped(q)
    offsets = {}
    for i, frame in enumerate(model.frames.frames):
        if frame.relation == "rigid" and i in T_base_link and np.isfinite(T_base_link[i]).all():
            mean = (se3.inverse(T_base_dh[i]) @ T_base_link[i]).mean(axis=0)
            U, _, Vt = np.linalg.svd(mean[:3, :3])
            mean[:3, :3] = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
            offsets[frame.name] = mean
    return offsets
