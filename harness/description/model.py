"""One folder of models/ becomes a `RobotModel`: table, mapping, configurations, URDF, tolerances, required sources."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.description.configurations import ConfigurationSet, ConfigurationsFile, resolve_configurations
from harness.description.dh import DHTable
from harness.description.dh_csv import SuspectNumber, read_dh_csv
from harness.description.engine_names import check_engine_names
from harness.description.finding import Finding
from harness.description.frames import FrameMap, resolve_frames
from harness.description.frames_file import EngineNames, FramesFile
from harness.description.joints import JointMap, identity_map, mapped_chain, random_limits, resolve_joints
from harness.description.locate import locate_urdf
from harness.description.model_file import ModelFile
from harness.description.toml_file import read_toml
from harness.description.urdf import Urdf
from harness.description.urdf_file import read_urdf
from harness.description.urdf_lint import check
from harness.errors import MappingError, ModelFileError, nearest
from harness.reading import URDF_BYTES, read_bytes

MOST_ACCEPTED = 20_000  # pairs of a source and a frame


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """A robot model, read and checked against itself.

    Attributes:
        folder: where it was read.
        file: model.toml.
        table: the DH table, base and tool transform included.
        urdf: the URDF; None if the model has none.
        frames: the mapping of frames.
        urdf_joints: the map from the model's joints to the URDF's; None without a URDF.
        engine_names: by source, what one engine calls things.
        configurations: the configurations it is checked at.
        findings: what the lint says of the URDF.
        suspects: numbers in dh.csv that look cut short, or like degrees.
        hashes: SHA-256 of each file that was read, by name.
    """

    folder: Path
    file: ModelFile
    table: DHTable
    urdf: Urdf | None
    frames: FrameMap
    urdf_joints: JointMap | None
    engine_names: dict[str, EngineNames]
    configurations: ConfigurationSet
    findings: tuple[Finding, ...]
    suspects: tuple[SuspectNumber, ...]
    hashes: dict[str, str]

    @property
    def name(self) -> str:
        """Name of the model, as in reports."""
        return self.file.name

    def joint_map(self, kind: str) -> JointMap:
        """Map from the model's joints to those of a kind of description, `dh` or `urdf`."""
        if kind == "urdf" and self.urdf_joints is not None:
            return self.urdf_joints
        return identity_map(self.table)

    def unmapped(self) -> tuple[list[str], list[str]]:
        """DH frames, and links of the chain, that no entry maps: nothing is checked there."""
        mapped_dh = {f.dh for f in self.frames.frames}
        same_as_base = {"base"} if "0" in mapped_dh and np.array_equal(self.table.base, np.eye(4)) else set()
        if np.array_equal(self.table.tool, np.eye(4)):
            same_as_base |= {"tool"}
        if "base" in mapped_dh and np.array_equal(self.table.base, np.eye(4)):
            same_as_base |= {"0"}
        labels = [x for x in self.table.frames if x not in mapped_dh and x not in same_as_base]
        if self.urdf is None or self.frames.base.urdf is None:
            return labels, []
        links = {self.frames.base.urdf: None}
        for joint in mapped_chain(self.urdf, self.frames).values():
            links.update({joint.parent: None, joint.child: None})
        mapped_links = {f.urdf for f in self.frames.frames}
        return labels, [link for link in links if link not in mapped_links]


def load_table(folder: Path) -> tuple[ModelFile, DHTable, tuple[SuspectNumber, ...]]:
    """model.toml, the DH table, and the numbers in it that look cut short. No URDF is read, so no data package is needed.

    Raises ModelFileError.
    """
    file = read_toml(folder / "model.toml", ModelFile)
    rows, suspects = read_dh_csv(folder / "dh.csv")
    table = DHTable(
        rows,
        file.convention,
        file.base.matrix() if file.base else np.eye(4),
        file.tool.matrix() if file.tool else np.eye(4),
    )
    if not table.joints:
        raise ModelFileError("expected at least one joint that moves, every row is fixed", where=folder / "dh.csv")
    return file, table, suspects


def load_model(folder: Path) -> RobotModel:
    """Read and validate one robot model folder.

    Raises:
        ModelFileError: a file is absent, or wrong.
        MappingError: frames.toml does not fit the table or the URDF.
        UrdfError: the URDF cannot be read, or is no kinematic tree.
        DescriptionUnavailable: the package that has the URDF is not installed.
    """
    if not folder.is_dir():
        raise ModelFileError("no such robot model folder", where=folder)
    paths = {name: folder / name for name in ("dh.csv", "model.toml", "frames.toml", "configurations.toml")}
    file, table, suspects = load_table(folder)
    urdf: Urdf | None = None
    findings: tuple[Finding, ...] = ()
    urdf_path: Path | None = None
    if file.urdf is not None:
        urdf_path = locate_urdf(file.urdf.file, file.urdf.package, folder)
        urdf = read_urdf(urdf_path)
        findings = check(urdf)
    frames_file = read_toml(paths["frames.toml"], FramesFile)
    frames = resolve_frames(frames_file, table, urdf, paths["frames.toml"])
    joints = resolve_joints(frames_file.joints, table, urdf, frames, paths["frames.toml"]) if urdf else None
    configurations = resolve_configurations(
        read_toml(paths["configurations.toml"], ConfigurationsFile),
        table,
        random_limits(table, urdf, joints),
        paths["configurations.toml"],
    )
    known_joints = (*table.joints, *(urdf.movable if urdf else ()))
    check_engine_names(frames_file.engine, frames, known_joints, table, paths["frames.toml"])
    _check_sources(file, frames, paths["model.toml"])
    hashes = {name: _sha256(path) for name, path in paths.items()}
    if file.urdf is not None and urdf_path is not None:
        hashes[f"{file.urdf.package or 'urdf'}:{file.urdf.file}"] = _sha256(urdf_path)
    return RobotModel(
        folder=folder,
        file=file,
        table=table,
        urdf=urdf,
        frames=frames,
        urdf_joints=joints,
        engine_names=frames_file.engine,
        configurations=configurations,
        findings=findings,
        suspects=suspects,
        hashes=hashes,
    )


def _check_sources(file: ModelFile, frames: FrameMap, path: Path) -> None:
    names: list[str] = []
    for i, entry in enumerate(file.source):
        if entry.name in names:
            raise ModelFileError(f"source {entry.name!r} is there twice", where=path, key=f"source[{i}].name")
        if file.urdf is None and entry.name.startswith("urdf:"):
            raise ModelFileError(f"{entry.name!r} needs a [urdf] table", where=path, key=f"source[{i}].name")
        names.append(entry.name)
    seen: set[tuple[str, str]] = set()
    for i, accepted in enumerate(file.accepted):
        known = [f.name for f in frames.frames]
        for value in accepted.frames:
            if value not in known:
                raise MappingError(f"no frame {value!r}; {nearest(value, known)}", where=path, key=f"accepted[{i}].frame")
        for pair in ((s, f) for s in accepted.sources for f in accepted.frames):
            if pair in seen:
                raise ModelFileError(f"{pair[0]} at {pair[1]} is accepted twice", where=path, key=f"accepted[{i}]")
            seen.add(pair)
        if len(seen) > MOST_ACCEPTED:
            raise ModelFileError(f"expected at most {MOST_ACCEPTED} pairs of source and frame", where=path, key=f"accepted[{i}]")


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path, URDF_BYTES, ModelFileError)).hexdigest()
