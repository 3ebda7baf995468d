"""Writes a derived DH table as a robot model folder."""

from __future__ import annotations

import re
from pathlib import Path

from harness.convert.result import Derived
from harness.description.dh import DHTable
from harness.description.joints import is_range
from harness.description.tidy import angle_text, is_identity, number_text, transform_toml
from harness.errors import InputError
from harness.se3 import Array
from harness.writing import LONGEST_ROBOT_NAME, RESERVED, ROBOT_NAME, replace_together

POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-9, 1e-8


def dh_csv(table: DHTable) -> str:
    """The rows of a table as dh.csv has them."""
    lines = ["joint,type,a,alpha,d,theta"]
    for row in table.rows:
        cells = (row.name, row.kind, number_text(row.a), angle_text(row.alpha), number_text(row.d), angle_text(row.theta))
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def write_model(derived: Derived, name: str, source: str, folder: Path) -> Path:
    """Write the four files of a robot model, and the URDF's kinematics beside them, to `folder`/`name`: all of them or none.

    Raises InputError if the folder cannot be written to, or a name cannot be that of a robot or stand in a CSV cell.
    """
    if not re.fullmatch(ROBOT_NAME.strip("^$"), name) or len(name) > LONGEST_ROBOT_NAME or name.lower() in RESERVED:
        expected = f"expected at most {LONGEST_ROBOT_NAME} letters, digits, '_', '.', '-', beginning with a letter or a digit"
        raise InputError(f"{expected}, and none of {', '.join(RESERVED)}; got {name[:80]!r}", key="name of the robot model")
    for row in derived.table.rows:
        if re.search(r'[,"#\n]', row.name):
            raise InputError(f"joint name {row.name!r} cannot stand in dh.csv", where=derived.urdf.path)
    robot = folder / name
    texts = {
        "dh.csv": dh_csv(derived.table),
        "model.toml": _model_toml(derived, name, source),
        "frames.toml": _frames_toml(derived),
        "configurations.toml": _configurations_toml(derived),
        f"{name}.urdf": derived.urdf.text,
    }
    try:
        robot.mkdir(parents=True, exist_ok=True)
        replace_together(robot, name, texts)
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
    """Ranges for prismatic joints that the URDF gives none, or numbers that mean none."""
    lines = []
    for row in derived.table.rows:
        limits = derived.urdf.joints[row.name].limits
        if row.kind == "prismatic" and (limits is None or not is_range(limits, slides=True)):
            lines.append(f"{_quoted(row.name)} = [-1, 1]")
    return "[random.limits]\n" + "\n".join(lines) + "\n" if lines else ""
