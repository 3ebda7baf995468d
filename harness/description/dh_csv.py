"""Reads a DH table from CSV, and points out numbers that look cut short or like degrees."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

from harness.description.dh import DHRow, Kind
from harness.description.values import (
    LARGEST_ANGLE,
    LARGEST_LENGTH,
    LONGEST_NAME,
    Truncation,
    check_text,
    find_truncation,
    parse_number,
    shown,
)
from harness.errors import ModelFileError, nearest
from harness.reading import MODEL_BYTES, read_text

MAX_ROWS = 1000
FAR = 100.0  # [m]: no arm is as long


@dataclass(frozen=True)
class SuspectNumber:
    """A number in a table that is probably not what was meant: `where` it stands and `why`."""

    where: str
    why: str


_NAMES = {"joint": "joint", "name": "joint", "theta": "theta", "theta_offset": "theta"}
_COLUMNS = ("joint", "type", "a", "alpha", "d", "theta")
_LARGEST = {
    "a": (LARGEST_LENGTH, "m"),
    "alpha": (LARGEST_ANGLE, "rad"),
    "d": (LARGEST_LENGTH, "m"),
    "theta": (LARGEST_ANGLE, "rad"),
}


def read_dh_csv(path: Path) -> tuple[tuple[DHRow, ...], tuple[SuspectNumber, ...]]:
    """Rows of a DH CSV and the numbers in it that look truncated or like degrees.

    Header `joint,type,a,alpha,d,theta` or, as articles have it, `name,a,alpha,d,theta_offset`; `#` starts a comment;
    without a `type` column every row is revolute; an empty cell is zero. Raises ModelFileError with file and line.
    """
    return parse_dh_csv(read_text(path, MODEL_BYTES, ModelFileError), path)


def parse_dh_csv(text: str, path: Path) -> tuple[tuple[DHRow, ...], tuple[SuspectNumber, ...]]:
    """The same from text; `path` is for messages. Raises ModelFileError with file and line."""
    table = csv.reader(io.StringIO(_without_comments(text)), skipinitialspace=True)
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
            if len(rows) > MAX_ROWS:
                raise ModelFileError(f"expected at most {MAX_ROWS} rows, got more", where=path, line=line)
    except csv.Error as error:
        raise ModelFileError(f"not CSV: {error}", where=path, line=table.line_num) from None
    if header is None or not rows:
        raise ModelFileError("expected a header and at least one row, got none", where=path, hint=f"header: {','.join(_COLUMNS)}")
    return tuple(rows), tuple(suspects)


def _without_comments(text: str) -> str:
    return "\n".join(line.split("#", 1)[0] for line in text.splitlines())


def _header(cells: list[str], path: Path, line: int) -> list[str]:
    columns: list[str] = []
    for cell in (c.strip() for c in cells):
        column = _NAMES.get(cell, cell)
        if column not in _COLUMNS:
            raise ModelFileError(f"unknown column {shown(cell)}", where=path, line=line, hint=nearest(cell, (*_COLUMNS, *_NAMES)))
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
    try:
        check_text(text["joint"], LONGEST_NAME)
    except ValueError as error:
        raise ModelFileError(str(error), where=path, line=line, key="column 'joint'") from None
    kind = text.get("type") or "revolute"
    if kind not in get_args(Kind):
        raise ModelFileError(f"unknown joint type {shown(kind)}", where=path, line=line, hint=nearest(kind, get_args(Kind)))
    numbers: dict[str, float] = {}
    for column, (largest, unit) in _LARGEST.items():
        try:
            numbers[column] = parse_number(text.get(column) or "0", largest, unit)
        except ValueError as error:
            raise ModelFileError(str(error), where=path, line=line, key=f"column {column!r}") from None
        if column in ("a", "d") and abs(numbers[column]) > FAR:
            suspects.append(SuspectNumber(f"{path.name}:{line}: {text['joint']} {column}", _far(text[column], numbers[column])))
        if column in ("alpha", "theta") and (why := _suspect_angle(text.get(column, ""), numbers[column])):
            suspects.append(SuspectNumber(f"{path.name}:{line}: {text['joint']} {column}", why))
    return DHRow(name=text["joint"], kind=cast(Kind, kind), **numbers)


def _far(text: str, value: float) -> str:
    """What an enormous length means."""
    why = "axes that are nearly parallel make lengths enormous and ill-determined, only what is left of their sum counts"
    return f"{text} m: {why}; float64 resolves {math.ulp(value):.1e} m of it"


def _suspect_angle(text: str, value: float) -> str | None:
    truncation: Truncation | None = find_truncation(text)
    if truncation:
        return f"{text} is {truncation.exact} cut short, off by {truncation.error:.1e} rad"
    if abs(value) > 6.5:
        return f"{text} rad is more than a turn: degrees?"
    return None
