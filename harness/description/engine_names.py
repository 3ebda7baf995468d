"""`[engine."SOURCE"]` of frames.toml: what one engine calls things, and where its chain begins and ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from harness.description.dh import DHTable
from harness.description.frames import FrameMap, MappedFrame, reaches_every_joint
from harness.description.frames_file import EngineNames
from harness.errors import MappingError, nearest
from harness.se3 import Array


def check_engine_names(
    entries: Mapping[str, EngineNames], frames: FrameMap, joints: Iterable[str], table: DHTable, path: Path
) -> None:
    """Raise MappingError for a name that does not exist, and for a chain that leaves a joint unchecked."""
    known = {frame.name: frame for frame in frames.frames}
    joints = set(joints)
    for source, entry in entries.items():
        key = f'engine."{source}"'
        for part, names in (
            ("base", [entry.base] if entry.base else []),
            ("tip", [entry.tip] if entry.tip else []),
            ("frames", entry.frames),
            ("without", entry.without),
        ):
            for name in names:
                if name not in known:
                    raise MappingError(f"no mapped frame {name!r}; {nearest(name, known)}", where=path, key=f"{key}.{part}")
        for name in entry.joints:
            if name not in joints:
                raise MappingError(f"no joint {name!r}; {nearest(name, joints)}", where=path, key=f"{key}.joints")
        if entry.tip is not None and known[entry.tip].urdf is None:
            raise MappingError(f"{entry.tip!r} has no link in the URDF", where=path, key=f"{key}.tip")
        if entry.base is not None:
            _constant(known[entry.base], frames, table, path, f"{key}.base")
            if entry.base in entry.without:
                raise MappingError(f"{entry.base!r} is the base and left out at once", where=path, key=f"{key}.without")
        reaches_every_joint([f for f in frames.frames if f.name not in entry.without], table, path, f"{key}.without")


def _constant(frame: MappedFrame, frames: FrameMap, table: DHTable, path: Path, key: str) -> None:
    if frame.dh not in ("base", "0") or frame.offset is None:
        fit = [f.name for f in frames.frames if f.dh in ("base", "0") and f.offset is not None]
        raise MappingError(
            f"expected a frame at a declared offset from DH frame base or 0, {frame.name!r} is not",
            where=path,
            key=key,
            hint=f"choose among: {', '.join(fit)}",
        )


def placement_in_base(frame: MappedFrame, base: MappedFrame, table: DHTable) -> Array:
    """T_base_frame (4, 4) of a frame that no joint moves, as the mapping declares it."""
    at = {"base": np.eye(4), "0": table.base}
    offset = np.eye(4) if frame.offset is None else frame.offset
    return np.asarray(np.linalg.solve(at[base.dh], at[frame.dh] @ offset))
