"""The DH table: rows, conventions, constant parts, and reading it from CSV.

Standard (Denavit & Hartenberg 1955; Siciliano et al., "Robotics", eq. 2.52):
    A_i = RotZ(theta_i) TransZ(d_i) TransX(a_i) RotX(alpha_i)
Modified (Craig, "Introduction to Robotics", eq. 3.6), a and alpha of the *previous* link on row i:
    A_i = RotX(alpha_i) TransX(a_i) RotZ(theta_i) TransZ(d_i)
Revolute: theta_i = q_i + theta. Prismatic: d_i = q_i + d. Fixed: no joint.
T_base_tool = base A_1 ... A_n tool.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias, cast, get_args

import numpy as np

from harness import se3
from harness.description.toml_file import read_text
from harness.description.values import Truncation, find_truncation, parse_number
from harness.errors import ModelFileError, nearest

Convention: TypeAlias = Literal["standard", "modified"]
Kind: TypeAlias = Literal["revolute", "prismatic", "fixed"]

MAX_ROWS = 1000


@dataclass(frozen=True)
class DHRow:
    """One row: `a`, `d` [m], `alpha`, `theta` [rad]; theta (d, if prismatic) is the offset added to q."""

    name: str
    kind: Kind
    a: float
    alpha: float
    d: float
    theta: float


@dataclass(frozen=True)
class DHTable:
    """A serial chain in DH parameters.

    Frames are labelled `base` (where placements are expressed), `0` (after the base transform), `1` ... `n` (after each
    row, fixed rows included) and `tool` (after the tool transform).
    """

    rows: tuple[DHRow, ...]
    convention: Convention = "standard"
    base: se3.Array = field(default_factory=lambda: np.eye(4))
    tool: se3.Array = field(default_factory=lambda: np.eye(4))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the rows that move, in order from the base: the order of q."""
        return tuple(row.name for row in self.rows if row.kind != "fixed")

    @property
    def frames(self) -> tuple[str, ...]:
        """All frame labels in order from the base."""
        return ("base", *(str(i) for i in range(len(self.rows) + 1)), "tool")

    def kind(self, joint: str) -> Kind:
        """Kind of the named joint. Raises KeyError."""
        return next(row.kind for row in self.rows if row.name == joint)


@dataclass(frozen=True)
class SuspectNumber:
    """A number in a table that is probably not what was meant: `where` it stands and `why`."""

    where: str
    why: str


_NAMES = {"joint": "joint", "name": "joint", "theta": "theta", "theta_offset": "theta"}
_COLUMNS = ("joint", "type", "a", "alpha", "d", "theta")


def read_dh_csv(path: Path) -> tuple[tuple[DHRow, ...], tuple[SuspectNumber, ...]]:
    """Rows of a DH CSV and the numbers in it that look truncated or like degrees.

    Header `joint,type,a,alpha,d,theta` or, as articles have it, `name,a,alpha,d,theta_offset`; `#` starts a comment;
    without a `type` column every row is revolute; an empty cell is zero. Raises ModelFileError with file and line.
    """
    table = csv.reader(io.StringIO(_without_comments(read_text(path))), skipinitialspace=True)
    header: list[str] | None = None
    rows: list[DHRow] = []
    suspects: list[SuspectNumber] = []
    seen: dict[str, int] = {}
    try:
        for cells in table:
            line = table.line_num
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = _header(cells, path, line)
                continue
            row = _row(header, cells, path, line, suspects)
            if row.name in seen:
                raise ModelFileError(f"duplicate joint {row.name!r}, first on line {seen[row.name]}", where=path, line=line)
            seen[row.name] = line
            rows.append(row)
    except csv.Error as error:
        raise ModelFileError(f"not CSV: {error}", where=path, line=table.line_num) from None
    if header is None or not rows:
        raise ModelFileError("expected a header and at least one row, got none", where=path, hint=f"header: {','.join(_COLUMNS)}")
    if len(rows) > MAX_ROWS:
        raise ModelFileError(f"expected at most {MAX_ROWS} rows, got {len(rows)}", where=path)
    return tuple(rows), tuple(suspects)


def _without_comments(text: str) -> str:
    return "\n".join(line.split("#", 1)[0] for line in text.splitlines())


def _header(cells: list[str], path: Path, line: int) -> list[str]:
    columns: list[str] = []
    for cell in (c.strip() for c in cells):
        column = _NAMES.get(cell, cell)
        if column not in _COLUMNS:
            raise ModelFileError(f"unknown column {cell!r}", where=path, line=line, hint=nearest(cell, (*_COLUMNS, *_NAMES)))
        if column in columns:
            raise ModelFileError(f"column {cell!r} is there twice", where=path, line=line)
        columns.append(column)
    if missing := [c for c in _COLUMNS if c not in columns and c not in ("type", "theta")]:
        raise ModelFileError(f"column {missing[0]!r} is missing", where=path, line=line, hint=f"header: {','.join(_COLUMNS)}")
    return columns


def _row(header: list[str], cells: list[str], path: Path, line: int, suspects: list[SuspectNumber]) -> DHRow:
    if len(cells) != len(header):
        raise ModelFileError(f"expected {len(header)} cells ({','.join(header)}), got {len(cells)}", where=path, line=line)
    text = {column: cell.strip() for column, cell in zip(header, cells, strict=True)}
    if not text["joint"]:
        raise ModelFileError("expected a joint name, got an empty cell", where=path, line=line)
    kind = text.get("type") or "revolute"
    if kind not in get_args(Kind):
        raise ModelFileError(f"unknown joint type {kind!r}", where=path, line=line, hint=nearest(kind, get_args(Kind)))
    numbers: dict[str, float] = {}
    for column in ("a", "alpha", "d", "theta"):
        try:
            numbers[column] = parse_number(text.get(column) or "0")
        except ValueError as error:
            raise ModelFileError(str(error), where=path, line=line, key=f"column {column!r}") from None
        if column in ("alpha", "theta") and (why := _suspect_angle(text.get(column, ""), numbers[column])):
            suspects.append(SuspectNumber(f"{path.name}:{line}: {text['joint']} {column}", why))
    return DHRow(text["joint"], cast(Kind, kind), **numbers)


def _suspect_angle(text: str, value: float) -> str | None:
    truncation: Truncation | None = find_truncation(text)
    if truncation:
        return f"{text} is {truncation.exact} cut short, off by {truncation.error:.1e} rad"
    if abs(value) > 6.5:
        return f"{text} rad is more than a turn: degrees?"
    return None
