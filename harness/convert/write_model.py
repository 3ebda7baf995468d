"""Writes a derived DH table as a robot model folder, and a DH table as a URDF."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from lxml import etree

from harness import se3
from harness.convert.derive import Derived
from harness.description.dh import DHRow, DHTable
from harness.description.model import RobotModel
from harness.description.tidy import angle_text, is_identity, number_text, transform_toml
from harness.errors import InputError
from harness.se3 import Array

POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-9, 1e-8


def dh_csv(table: DHTable) -> str:
    """The rows of a table as dh.csv has them."""
    lines = ["joint,type,a,alpha,d,theta"]
    for row in table.rows:
        cells = (row.name, row.kind, number_text(row.a), angle_text(row.alpha), number_text(row.d), angle_text(row.theta))
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def write_model(derived: Derived, name: str, source: str, folder: Path) -> Path:
    """Write the four files of a robot model, and the URDF's kinematics beside them, to `folder`/`name`.

    Raises InputError if the folder cannot be written to, or a name cannot stand in a CSV cell.
    """
    for row in derived.table.rows:
        if re.search(r'[,"#\n]', row.name):
            raise InputError(f"joint name {row.name!r} cannot stand in dh.csv", where=derived.urdf.path)
    robot = folder / name
    try:
        robot.mkdir(parents=True, exist_ok=True)
        (robot / "dh.csv").write_text(dh_csv(derived.table), encoding="utf-8")
        (robot / "model.toml").write_text(_model_toml(derived, name, source), encoding="utf-8")
        (robot / "frames.toml").write_text(_frames_toml(derived), encoding="utf-8")
        (robot / "configurations.toml").write_text(_configurations_toml(derived), encoding="utf-8")
        (robot / f"{name}.urdf").write_text(derived.urdf.text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where=robot, hint="choose another --out") from None
    return robot


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = "".join(
        f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else c for c in text.replace("\\", "\\\\").replace('"', '\\"')
    )
    return f'"{escaped}"'


def _table(name: str, T: Array) -> str:
    return "" if is_identity(T) else f"\n[{name}]\n" + "".join(f"{k} = {v}\n" for k, v in transform_toml(T).items())


def _model_toml(derived: Derived, name: str, source: str) -> str:
    table = derived.table
    free = "; ".join(derived.free) or "none"
    return (
        f"name = {_quoted(name)}\n"
        f"description = {_quoted(f'{derived.urdf.name or name}, from {derived.base} to {derived.tip}')}\n"
        f"convention = {_quoted(table.convention)}\n"
        'gate = "certified"\n\n'
        "[provenance]\n"
        f"document = {_quoted(f'derived from {derived.urdf.path.name} as {source} places it')}\n"
        f"note = {_quoted(f'fixed by choice: {free}')}\n\n"
        f"[urdf]\nfile = {_quoted(f'{name}.urdf')}\n\n"
        f"[tolerance]\nposition = {POSITION_TOLERANCE:g}\nrotation = {ROTATION_TOLERANCE:g}\n"
        f"{_table('base', table.base)}{_table('tool', table.tool)}"
        f"\n[[source]]\nname = {_quoted(source)}\n"
    )


def _frames_toml(derived: Derived) -> str:
    """One entry a link; a link without an offset is its DH frame, unless another has taken that already."""
    base_label = "base" if not is_identity(derived.table.base) else "0"
    taken = {base_label, "base"}
    entries = [f"[[frame]]\nname = {_quoted(derived.base)}\ndh = {_quoted(base_label)}\nurdf = {_quoted(derived.base)}\n"]
    mapped = {base_label}
    for link in derived.links:
        label = base_label if link.dh == "base" else link.dh
        mapped.add(label)
        entry = f"[[frame]]\nname = {_quoted(link.name)}\ndh = {_quoted(label)}\nurdf = {_quoted(link.name)}\n"
        offset = transform_toml(link.offset)
        if not offset and label in taken:
            offset = {"xyz": "[0, 0, 0]"}
        if not offset:
            taken.add(label)
        entries.append(entry + "".join(f"{k} = {v}\n" for k, v in offset.items()))
    # A DH frame that no link rides on, frame n in front of a tool for one, is still compared among DH sources.
    bare = [label for label in derived.table.frames if label.isdigit() and label not in mapped]
    entries += [f'[[frame]]\nname = "dh frame {label}"\ndh = {label}\n' for label in bare]
    return "\n".join(entries)


def _configurations_toml(derived: Derived) -> str:
    """Ranges for prismatic joints that the URDF gives none."""
    lines = []
    for row in derived.table.rows:
        limits = derived.urdf.joints[row.name].limits
        if row.kind == "prismatic" and (limits is None or not limits[0] < limits[1]):
            lines.append(f"{_quoted(row.name)} = [-1, 1]")
    return "[random.limits]\n" + "\n".join(lines) + "\n" if lines else ""


def export_urdf(model: RobotModel) -> str:
    """The model's DH table as URDF text: a link for every joint, and one for every DH frame (`dh_1` ...) fixed to it."""
    table = model.table
    robot = etree.Element("robot", name=model.name)
    etree.SubElement(robot, "link", name="dh_base")
    at, T = "dh_base", table.base
    _fixed(robot, at, "dh_0", T)
    moved = 0
    for i, row in enumerate(table.rows, start=1):
        pre, post = _parts(row, table.convention)
        T = T @ pre
        if row.kind != "fixed":
            limits = (model.configurations.lower[moved], model.configurations.upper[moved])
            at = _joint(robot, at, row, T, (float(limits[0]), float(limits[1])))
            T, moved = np.eye(4), moved + 1
        T = T @ post
        _fixed(robot, at, f"dh_{i}", T)
    _fixed(robot, at, "dh_tool", T @ table.tool)
    return str(etree.tostring(robot, encoding="unicode", pretty_print=True))


def _parts(row: DHRow, convention: str) -> tuple[Array, Array]:
    """The constant transforms before and behind a row's joint; see engines/dh_pinocchio.py."""
    about_z = se3.rotation("z", row.theta) @ se3.translation((0.0, 0.0, row.d))
    along_x = se3.translation((row.a, 0.0, 0.0)) @ se3.rotation("x", row.alpha)
    return (along_x, about_z) if convention == "modified" else (np.eye(4), about_z @ along_x)


def _origin(joint: etree._Element, T: Array) -> None:
    xyz, rpy = " ".join(repr(float(x)) for x in T[:3, 3]), " ".join(repr(float(x)) for x in se3.to_rpy(T))
    etree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)


def _fixed(robot: etree._Element, parent: str, child: str, T: Array) -> None:
    etree.SubElement(robot, "link", name=child)
    joint = etree.SubElement(robot, "joint", name=f"{child}_fixed", type="fixed")
    _origin(joint, T)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)


def _joint(robot: etree._Element, parent: str, row: DHRow, T: Array, limits: tuple[float, float]) -> str:
    child = f"{row.name}_link"
    etree.SubElement(robot, "link", name=child)
    joint = etree.SubElement(robot, "joint", name=row.name, type=row.kind)
    _origin(joint, T)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)
    etree.SubElement(joint, "axis", xyz="0 0 1")
    etree.SubElement(joint, "limit", lower=repr(limits[0]), upper=repr(limits[1]), effort="0", velocity="0")
    return child
