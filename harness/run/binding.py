"""Each engine seen through the model's mapping: asked by joint name, read by frame name, in the model's base frame."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness import se3
from harness.comparison.components import View, components, mapped, matrices
from harness.description.engine_names import placement_in_base
from harness.description.frames import MappedFrame, unchecked_joint
from harness.description.frames_file import EngineNames
from harness.description.joints import JointMap
from harness.description.model import RobotModel
from harness.engines.base import Engine
from harness.engines.registry import kind_of
from harness.errors import EngineFailed, nearest
from harness.se3 import Array
from harness.workers.process import ProcessEngine


class Measured(NamedTuple):
    """A measured offset T_dh_link (4, 4), and the largest entry by which it changes with q."""

    offset: Array
    spread: float


@dataclass(kw_only=True)
class Bound:
    """An engine bound to a model: asked in the model's joint order, answering at the mapped frames.

    `frames` are the engine's frame names that are read; `view` tells how mapped frames follow from them; `missing` are
    indices of mapped frames the engine does not have, though its description does; `absent` those it need not have, and
    `undeclared` those of them that frames.toml does not say so of; `read_in` the frame its placements are read in, if not the
    base frame; `waited` is the time spent on its answers.
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


def wanted_frames(source: str, model: RobotModel) -> tuple[str, ...]:
    """The engine's frames that binding it will read, as far as it has them."""
    kind, names = kind_of(source), model.engine_names.get(source, EngineNames())
    labels = [_label(f, kind, names) for f in model.frames.frames if f.name not in names.without]
    return tuple(dict.fromkeys(label for label in labels if label is not None))


def bind(engine: Engine, model: RobotModel, offsets: Mapping[str, Array]) -> Bound:
    """Bind an engine to a model. `offsets` are the rigid offsets by frame name; an unmeasured one counts as none.

    Raises EngineFailed for a frame or joint that is needed and not there, or there and unknown.
    """
    kind, names = kind_of(engine.source), model.engine_names.get(engine.source, EngineNames())
    joint_map = model.joint_map(kind).renamed(names.joints)
    _check_joints(engine, joint_map)
    frames = model.frames.frames
    labels = {f.name: None if f.name in names.without else _label_there(f, kind, names, engine, model) for f in frames}
    if isinstance(engine, ProcessEngine) and engine.is_program:
        _check_frame_names(engine, kind, names, model)
    read = [x for x in dict.fromkeys(labels.values()) if x is not None and x in engine.frames]
    slots = tuple(read.index(x) if x in read else None for x in labels.values())
    missing = tuple(i for i, x in enumerate(labels.values()) if x is not None and x not in read)
    absent = [f.name for f in frames if f.name in names.without]
    undeclared = [frames[i].name for i in missing] if engine.partial else []
    if engine.partial:
        if joint := unchecked_joint((f for f, slot in zip(frames, slots, strict=True) if slot is not None), model.table):
            asked = ", ".join(dict.fromkeys(x for x in labels.values() if x is not None))
            has = ", ".join(engine.frames)
            raise EngineFailed(
                engine.source, f"has none of the frames that joint {joint!r} moves: asked for {asked}; it has {has}"
            )
        absent += undeclared
        missing = ()
    constant = np.array([_constant(f, kind, names, offsets) for f in frames])
    anchor = _anchor(engine, model, kind, names, labels)
    view, read_in = View(slots, constant, None), ""
    if anchor is not None:
        T = placement_in_base(anchor, model.frames.base, model.table)
        base = read.index(str(labels[anchor.name]))
        view = View(slots, constant, base, None if np.array_equal(T, np.eye(4)) else T)
        read_in = "" if anchor is model.frames.base else anchor.name
    return Bound(
        engine=engine,
        joint_map=joint_map,
        frames=tuple(read),
        view=view,
        missing=missing,
        absent=tuple(absent),
        undeclared=tuple(undeclared),
        read_in=read_in,
    )


def _label(frame: MappedFrame, kind: str, names: EngineNames) -> str | None:
    """What an engine calls a mapped frame; None if its description does not have it."""
    return names.frames.get(frame.name) or (frame.dh if kind == "dh" else frame.urdf)


def _label_there(frame: MappedFrame, kind: str, names: EngineNames, engine: Engine, model: RobotModel) -> str | None:
    """The label under which this engine has the frame: `base` and `0`, or `tool` and the last row, may be one frame."""
    label = _label(frame, kind, names)
    if kind == "urdf" or label in engine.frames or frame.name in names.frames:
        return label
    table = model.table
    pairs = (("base", "0", table.base), ("tool", str(len(table.rows)), table.tool))
    for one, other, T in pairs:
        if label in (one, other) and np.array_equal(T, np.eye(4)):
            return next((x for x in (one, other) if x in engine.frames), label)
    return label


def _check_frame_names(engine: Engine, kind: str, names: EngineNames, model: RobotModel) -> None:
    """A frame under a name that nothing has is a misspelling: it would go unread."""
    known = {*names.frames.values(), *(model.table.frames if kind == "dh" or model.urdf is None else model.urdf.links)}
    if unknown := [frame for frame in engine.frames if frame not in known]:
        hint = f'another name can be given in frames.toml, [engine."{engine.source}"] frames'
        raise EngineFailed(engine.source, f"has a frame {unknown[0]!r}: {nearest(unknown[0], known)}; {hint}")


def _check_joints(engine: Engine, joint_map: JointMap) -> None:
    if unknown := [j for j in engine.joints if j not in joint_map.names]:
        hint = nearest(unknown[0], joint_map.names)
        raise EngineFailed(engine.source, f"has a joint {unknown[0]!r} that the description does not: {hint}")
    if lost := [j for j in joint_map.moved if j not in engine.joints and j not in joint_map.followers]:
        raise EngineFailed(engine.source, f"has no joint {lost[0]!r}; {nearest(lost[0], engine.joints)}")


def _anchor(
    engine: Engine, model: RobotModel, kind: str, names: EngineNames, labels: Mapping[str, str | None]
) -> MappedFrame | None:
    """The frame relative to which placements are read; None if they are in the base frame as they come.

    The one that frames.toml names; else, for a URDF, the base frame, or the first frame at a declared offset from it that
    the engine has.
    """
    frames = model.frames.frames
    if names.base is not None:
        fit = [f for f in frames if f.name == names.base]
    elif kind == "dh":
        return None
    else:
        fit = [model.frames.base, *(f for f in frames if f.dh in ("base", "0") and f.offset is not None)]
        fit = [f for f in fit if f.name not in names.without]
    for frame in fit:
        if labels[frame.name] in engine.frames:
            return frame
    raise EngineFailed(engine.source, f"has none of the frames that stand still: {', '.join(f.name for f in fit)}")


def _constant(frame: MappedFrame, kind: str, names: EngineNames, offsets: Mapping[str, Array]) -> Array:
    """Constant transform behind the frame that is read: a frame that is named as the engine has it needs none."""
    if kind == "urdf" or frame.name in names.frames:
        return np.eye(4)
    return offsets.get(frame.name, np.eye(4)) if frame.offset is None else frame.offset


def measure_rigid(model: RobotModel, in_house: Bound, urdf_source: Bound, q: Array) -> dict[str, Measured]:
    """Offset of each rigid frame, by frame name: the mean of T_dh_link = T_base_dh^-1 T_base_link over q (N, n).

    A mean over evenly spread configurations, not one of them: an offset taken at one absorbs whatever discrepancy there is
    at that one, and shows it doubled elsewhere. Rotations are averaged in the chordal sense, by projecting the mean matrix
    on SO(3) (Moakher 2002, doi:10.1137/S0895479801383877). Frames whose placements are not finite are left out.
    """
    T_base_dh, T_base_link = in_house.mapped(q), urdf_source.mapped(q)
    offsets = {}
    for i, frame in enumerate(model.frames.frames):
        if frame.relation == "rigid" and i in T_base_link and np.isfinite(T_base_link[i]).all():
            T_dh_link = se3.inverse(T_base_dh[i]) @ T_base_link[i]
            mean = se3.mean_transform(T_dh_link)
            offsets[frame.name] = Measured(mean, float(np.abs(T_dh_link - mean).max()))
    return offsets
