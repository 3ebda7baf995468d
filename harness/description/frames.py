"""The frame-name mapping: which DH frame and which URDF link are one frame, and at what constant offset.

Four kinds of entry (design: one table `[[frame]]` each):
    dh + urdf                  the same frame under two names
    dh + urdf + xyz/rpy        the URDF link at a declared constant offset from the DH frame
    urdf + of + xyz/rpy        the URDF link at a declared constant offset from another entry
    dh + urdf + rigid = true   on the same body; the offset is measured and must stay constant
An entry without `urdf` is compared among DH sources only.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from harness.description.dh import DHTable
from harness.description.frames_file import FrameEntry, FramesFile
from harness.description.urdf import Urdf
from harness.description.values import Transform
from harness.errors import MappingError, nearest
from harness.se3 import Array

Relation = Literal["identical", "declared", "rigid"]


@dataclass(frozen=True, kw_only=True)
class MappedFrame:
    """A frame under one name: `T_base_name = T_base_dh @ offset`, and the link `urdf` is the same frame.

    Attributes:
        name: its name here and in reports.
        dh: label of the DH frame it is on.
        urdf: its link in the URDF; None if it is compared among DH sources only.
        relation: how the offset is known: `identical` (there is none), `declared`, or `rigid` (it is measured).
        of: the other entry that a declared offset was given from, if any.
        offset: T_dh_name (4, 4) [m]; None for a rigid frame until it has been measured.
        declared: the transforms that the offset is the product of, as the file writes them.
    """

    name: str
    dh: str
    urdf: str | None
    relation: Relation
    of: str | None
    offset: Array | None
    declared: tuple[Transform, ...] = ()


@dataclass(frozen=True)
class FrameMap:
    """All mapped frames in file order; `base` is the one in which every placement is expressed."""

    frames: tuple[MappedFrame, ...]
    base: MappedFrame


def resolve_frames(file: FramesFile, table: DHTable, urdf: Urdf | None, path: Path) -> FrameMap:
    """Check the entries against both descriptions.

    Args:
        file: frames.toml as written.
        table: the DH table.
        urdf: the URDF, or None.
        path: the file, for messages.

    Raises:
        MappingError: a name does not exist or is mapped twice, a joint would not be checked, or there is no base frame.
            It names the key and the nearest spelling.
    """
    by_name: dict[str, int] = {}
    taken: dict[tuple[str, str], int] = {}
    frames: list[MappedFrame] = []
    for i, entry in enumerate(file.frame):
        key = f"frame[{i}]"
        _once(by_name, entry.name, i, path, f"{key}.name", f"frame name {entry.name!r}")
        if entry.urdf is not None:
            if urdf is None:
                raise MappingError("names a URDF link, but the model has no [urdf]", where=path, key=f"{key}.urdf")
            if entry.urdf not in urdf.links:
                raise MappingError(
                    f"no link {entry.urdf!r} in {urdf.path.name}; {nearest(entry.urdf, urdf.links)}",
                    where=path,
                    key=f"{key}.urdf",
                )
            _once(taken, ("urdf", entry.urdf), i, path, f"{key}.urdf", f"link {entry.urdf!r}")
        mapped = _resolve(entry, i, file, table, path)
        if mapped.relation == "identical":
            _once(taken, ("dh", mapped.dh), i, path, f"{key}.dh", f"DH frame {mapped.dh} without an offset")
        frames.append(mapped)
    reaches_every_joint(frames, table, path, "frame")
    return FrameMap(tuple(frames), _base(frames, table, path))


def unchecked_joint(frames: Iterable[MappedFrame], table: DHTable) -> str:
    """The first joint that moves none of these frames; empty if every joint moves one."""
    last = max((table.frames.index(frame.dh) for frame in frames), default=-1)
    moving = ((i, row.name) for i, row in enumerate(table.rows, start=1) if row.kind != "fixed")
    return next((name for i, name in moving if table.frames.index(str(i)) > last), "")


def reaches_every_joint(frames: Iterable[MappedFrame], table: DHTable, path: Path, key: str) -> None:
    """Refuse a mapping in which a joint would never be checked.

    Args:
        frames: the mapped frames that are compared.
        table: the DH table.
        path: the file, for messages.
        key: the key in it, for messages.

    Raises:
        MappingError: a joint moves none of the frames.
    """
    if joint := unchecked_joint(frames, table):
        hint = "map a frame at the end of the chain"
        raise MappingError(f"no mapped frame moves with joint {joint!r}", where=path, key=key, hint=hint)


def _once(seen: dict[Any, int], item: Any, i: int, path: Path, key: str, what: str) -> None:
    if item in seen:
        raise MappingError(f"{what} is mapped twice, first by frame[{seen[item]}]", where=path, key=key)
    seen[item] = i


def _resolve(entry: FrameEntry, i: int, file: FramesFile, table: DHTable, path: Path) -> MappedFrame:
    """Follow `of` down to an entry with `dh`, composing the declared offsets."""
    offset, current, seen = entry.offset, entry, [entry.name]
    transforms = [entry.transform] if entry.transform else []
    while current.of is not None:
        target = next((e for e in file.frame if e.name == current.of), None)
        if target is None:
            hint = nearest(current.of, [e.name for e in file.frame])
            raise MappingError(f"no frame {current.of!r} in this file; {hint}", where=path, key=f"frame[{i}].of")
        if target.name in seen:
            raise MappingError(f"frames refer to each other in a circle: {' -> '.join([*seen, target.name])}", where=path)
        if target.rigid:
            raise MappingError(
                f"{target.name!r} is rigid, its own offset is not declared",
                where=path,
                key=f"frame[{i}].of",
                hint="give this entry dh and rigid = true instead",
            )
        offset, current = target.offset @ offset, target
        transforms = [*([target.transform] if target.transform else []), *transforms]
        seen.append(current.name)
    label = str(current.dh)
    if label not in table.frames:
        raise MappingError(
            f"no DH frame {label!r} in dh.csv: expected base, 0 to {len(table.rows)}, or tool", where=path, key=f"frame[{i}].dh"
        )
    if entry.rigid:
        return MappedFrame(name=entry.name, dh=label, urdf=entry.urdf, relation="rigid", of=None, offset=None)
    declared = entry.of is not None or entry.xyz is not None or entry.rpy is not None
    return MappedFrame(
        name=entry.name,
        dh=label,
        urdf=entry.urdf,
        relation="declared" if declared else "identical",
        of=entry.of,
        offset=offset,
        declared=tuple(transforms),
    )


def _base(frames: list[MappedFrame], table: DHTable, path: Path) -> MappedFrame:
    labels = ["base"] if not np.array_equal(table.base, np.eye(4)) else ["base", "0"]
    for frame in frames:
        if frame.relation == "identical" and frame.dh in labels:
            return frame
    raise MappingError(
        f"expected an entry with dh = {' or '.join(repr(label) for label in labels)} and no offset: the base frame in which "
        "placements are expressed",
        where=path,
    )
