"""Each engine seen through the model's mapping: asked by joint name, read by frame name, in the model's base frame."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.comparison.components import View, components, mapped, matrices
from harness.description.engine_names import placement_in_base
from harness.description.frames import unchecked_joint
from harness.description.joints import JointMap
from harness.description.model import RobotModel
from harness.engines.base import Engine
from harness.errors import EngineFailed
from harness.run.naming import Naming
from harness.se3 import Array
from harness.workers.process import ProcessEngine


@dataclass(kw_only=True)
class Bound:
    """An engine bound to a model: asked in the model's joint order, answering at the mapped frames.

    engine: who answers.
    joint_map: the model's joints as those of its description.
    frames: the engine's frame names that are read.
    view: how mapped frames follow from them.
    missing: indices of mapped frames the engine does not have, though its description does.
    absent: names of mapped frames it need not have.
    undeclared: those of `absent` that frames.toml does not say so of.
    read_in: the frame its placements are read in, if that is not the base frame.
    waited: time spent on its answers [s].
    """

    engine: Engine
    joint_map: JointMap
    frames: tuple[str, ...]
    view: View
    missing: tuple[int, ...] = ()
    absent: tuple[str, ...] = ()
    undeclared: tuple[str, ...] = ()
    read_in: str = ""
    waited: float = 0.0

    @property
    def seconds(self) -> float:
        """Time spent inside the engine [s]: as a worker measures it itself, if it does, else as seen from here."""
        own = self.engine.seconds if isinstance(self.engine, ProcessEngine) else 0.0
        return own or self.waited

    def should_have(self, frame: int) -> bool:
        """Whether the mapped frame with this index can be expected of this source: its description has it."""
        return self.view.slots[frame] is not None or frame in self.missing

    def raw(self, q: Array) -> Array:
        """Placements as the engine returns them, q (N, n) in model order: (N, len(frames), 4, 4)."""
        values = self.joint_map.values(q, self.engine.joints)
        start = time.perf_counter()
        try:
            return self.engine.placements(values, self.frames)
        finally:
            self.waited += time.perf_counter() - start

    def mapped(self, q: Array) -> dict[int, Array]:
        """Placements (N, 4, 4) of each mapped frame this source has, by its index, at q (N, n)."""
        T = matrices(mapped(components(self.raw(q)), self.view))
        return {frame: T[:, i] for i, frame in enumerate(self.view.available)}


@dataclass(frozen=True)
class _Reading:
    """Which raw frame is read for each mapped frame.

    labels: the engine's name of each mapped frame, None where its description has none.
    raw: the engine's frames that are read, each once.
    """

    labels: tuple[str | None, ...]
    raw: tuple[str, ...]

    @property
    def slots(self) -> tuple[int | None, ...]:
        """Index into `raw` of each mapped frame, None if it is not read."""
        return tuple(self.raw.index(label) if label in self.raw else None for label in self.labels)

    @property
    def missing(self) -> tuple[int, ...]:
        """Indices of mapped frames that have a label, and that the engine does not have."""
        return tuple(i for i, label in enumerate(self.labels) if label is not None and label not in self.raw)


def bind(engine: Engine, model: RobotModel, offsets: Mapping[str, Array]) -> Bound:
    """Bind an engine to a model.

    engine: who answers.
    model: the robot model with its mapping.
    offsets: the rigid offsets (4, 4) by frame name; one that is not measured counts as none.

    Raises EngineFailed for a frame or joint that is needed and not there, or there and unknown.
    """
    naming = Naming(model, engine.source)
    naming.check_joints(engine)
    if isinstance(engine, ProcessEngine) and engine.is_program:
        naming.check_frames(engine)
    reading = _reading(naming, engine)
    names = [frame.name for frame in model.frames.frames]
    absent = [name for name in names if name in naming.names.without]
    undeclared = [names[i] for i in reading.missing] if engine.partial else []
    if engine.partial:
        _check_chain(reading, engine, model)
    view, read_in = _view(reading, naming, engine, offsets)
    return Bound(
        engine=engine,
        joint_map=naming.joint_map,
        frames=reading.raw,
        view=view,
        missing=() if engine.partial else reading.missing,
        absent=(*absent, *undeclared),
        undeclared=tuple(undeclared),
        read_in=read_in,
    )


def _reading(naming: Naming, engine: Engine) -> _Reading:
    """The labels of all mapped frames, and those that the engine has."""
    labels = tuple(naming.label_in(engine, frame) for frame in naming.model.frames.frames)
    return _Reading(labels, tuple(x for x in dict.fromkeys(labels) if x is not None and x in engine.frames))


def _check_chain(reading: _Reading, engine: Engine, model: RobotModel) -> None:
    """Raise EngineFailed if an engine that lacks frames by design lacks all those that some joint moves."""
    seen = (frame for frame, slot in zip(model.frames.frames, reading.slots, strict=True) if slot is not None)
    if joint := unchecked_joint(seen, model.table):
        asked = ", ".join(dict.fromkeys(x for x in reading.labels if x is not None))
        has = ", ".join(engine.frames)
        raise EngineFailed(engine.source, f"has none of the frames that joint {joint!r} moves: asked for {asked}; it has {has}")


def _view(reading: _Reading, naming: Naming, engine: Engine, offsets: Mapping[str, Array]) -> tuple[View, str]:
    """How mapped frames follow from raw ones, and the name of the frame they are read in, if not the base frame."""
    model = naming.model
    constant = np.array([naming.constant(frame, dict(offsets)) for frame in model.frames.frames])
    anchor = naming.anchor(engine)
    if anchor is None:
        return View(reading.slots, constant, None), ""
    T_base_anchor = placement_in_base(anchor, model.frames.base, model.table)
    base = reading.raw.index(str(naming.label_in(engine, anchor)))
    view = View(reading.slots, constant, base, None if np.array_equal(T_base_anchor, np.eye(4)) else T_base_anchor)
    return view, "" if anchor is model.frames.base else anchor.name
