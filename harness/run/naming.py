"""What one engine calls the mapped frames of a model, and whether its names are those of the description."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.description.frames import MappedFrame
from harness.description.frames_file import EngineNames
from harness.description.joints import JointMap
from harness.description.model import RobotModel
from harness.engines.base import Engine
from harness.engines.registry import kind_of
from harness.errors import EngineFailed, nearest
from harness.se3 import Array


@dataclass(frozen=True)
class Naming:
    """The mapping of a model as one source sees it.

    model: the robot model.
    source: name of the source.
    """

    model: RobotModel
    source: str

    @property
    def kind(self) -> str:
        """Kind of description the source computes from: `dh` or `urdf`."""
        return kind_of(self.source)

    @property
    def names(self) -> EngineNames:
        """`[engine."SOURCE"]` of frames.toml; empty if there is none."""
        return self.model.engine_names.get(self.source, EngineNames())

    @property
    def joint_map(self) -> JointMap:
        """The joint map of its description, in the engine's own joint names."""
        return self.model.joint_map(self.kind).renamed(self.names.joints)

    def label(self, frame: MappedFrame) -> str | None:
        """What the source calls a mapped frame; None if its description does not have it."""
        if frame.name in self.names.without:
            return None
        return self.names.frames.get(frame.name) or (frame.dh if self.kind == "dh" else frame.urdf)

    def label_in(self, engine: Engine, frame: MappedFrame) -> str | None:
        """The label under which this engine has the frame: `base` and `0`, or `tool` and the last row, may be one frame."""
        label = self.label(frame)
        if label is None or self.kind == "urdf" or label in engine.frames or frame.name in self.names.frames:
            return label
        table = self.model.table
        for one, other, T in (("base", "0", table.base), ("tool", str(len(table.rows)), table.tool)):
            if label in (one, other) and np.array_equal(T, np.eye(4)):
                return next((x for x in (one, other) if x in engine.frames), label)
        return label

    def constant(self, frame: MappedFrame, offsets: dict[str, Array]) -> Array:
        """Constant transform (4, 4) behind the frame that is read. A frame named as the engine has it needs none."""
        if self.kind == "urdf" or frame.name in self.names.frames:
            return np.eye(4)
        return offsets.get(frame.name, np.eye(4)) if frame.offset is None else frame.offset

    def anchor(self, engine: Engine) -> MappedFrame | None:
        """The frame relative to which placements are read; None if they are in the base frame as they come.

        The frame that frames.toml names. Without one, for a URDF: the base frame, or the first frame at a declared offset
        from it that the engine has. Raises EngineFailed if the engine has none of them.
        """
        frames = self.model.frames.frames
        if self.names.base is not None:
            still = [f for f in frames if f.name == self.names.base]
        elif self.kind == "dh":
            return None
        else:
            still = [self.model.frames.base, *(f for f in frames if f.dh in ("base", "0") and f.offset is not None)]
            still = [f for f in still if f.name not in self.names.without]
        for frame in still:
            if self.label_in(engine, frame) in engine.frames:
                return frame
        raise EngineFailed(engine.source, f"has none of the frames that stand still: {', '.join(f.name for f in still)}")

    def check_joints(self, engine: Engine) -> None:
        """Raise EngineFailed for a joint that the description does not have, or one that the engine lacks."""
        joint_map = self.joint_map
        if unknown := [j for j in engine.joints if j not in joint_map.names]:
            hint = nearest(unknown[0], joint_map.names)
            raise EngineFailed(engine.source, f"has a joint {unknown[0]!r} that the description does not: {hint}")
        if lost := [j for j in joint_map.moved if j not in engine.joints and j not in joint_map.followers]:
            raise EngineFailed(engine.source, f"has no joint {lost[0]!r}; {nearest(lost[0], engine.joints)}")

    def check_frames(self, engine: Engine) -> None:
        """Raise EngineFailed for a frame under a name that nothing has: a misspelling, which would go unread."""
        table, urdf = self.model.table, self.model.urdf
        known = {*self.names.frames.values(), *(table.frames if self.kind == "dh" or urdf is None else urdf.links)}
        if unknown := [frame for frame in engine.frames if frame not in known]:
            hint = f'another name can be given in frames.toml, [engine."{engine.source}"] frames'
            raise EngineFailed(engine.source, f"has a frame {unknown[0]!r}: {nearest(unknown[0], known)}; {hint}")


def wanted_frames(source: str, model: RobotModel) -> tuple[str, ...]:
    """The engine's frames that binding it will read, as far as it has them."""
    naming = Naming(model, source)
    labels = (naming.label(frame) for frame in model.frames.frames)
    return tuple(dict.fromkeys(label for label in labels if label is not None))
