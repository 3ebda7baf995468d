"""Writes the list of all reports in a folder. A file that is no report is left out, and named; it never ends the run."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from harness.errors import InputError
from harness.reading import REPORT_BYTES, read_text
from harness.rendering.html import render_index
from harness.report.document import Report
from harness.report.json_file import FORMAT, report_of, schema
from harness.report.text import plain
from harness.writing import locked, put

SCHEMA_NAME = "report.schema.json"
BEGINNING = 200  # letters, which name the format of a document
OTHER_DOCUMENTS = FORMAT.partition(" ")[0]  # how the formats of all our documents begin
TOLD = 5  # files named in the line on stderr
LONGEST = 200  # letters of a name or a reason


@dataclass(frozen=True)
class LeftOut:
    """A file that is not in the list: its name, and why."""

    name: str
    reason: str

    def __str__(self) -> str:
        return f"{self.name[:LONGEST]} ({self.reason[:LONGEST]})"


def to_stderr(line: str) -> None:
    """Print one line on stderr, if there is one."""
    if sys.stderr is not None:
        print(plain(line), file=sys.stderr)


def write_index(folder: Path, tell: Callable[[str], None] = to_stderr) -> Path:
    """Write `index.html` over every report in `folder`, and the schema beside it. Raises InputError if it cannot be written.

    folder: the folder of the reports.
    tell: is given one line if files were left out, because they cannot be read or are no reports.
    """
    path = folder / "index.html"
    try:
        # Under one lock: of two runs at once, the last to write has seen the reports of both.
        with locked(folder):
            put(folder / SCHEMA_NAME, _schema_text())
            reports, left_out = _reports(folder)
            without_page = {r.robot.name for r in reports if not (folder / f"{r.robot.name}.html").is_file()}
            put(path, render_index(reports, [str(one) for one in left_out], without_page))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where=path, hint="choose another --out") from None
    if left_out:
        more = f", and {len(left_out) - TOLD} more" if len(left_out) > TOLD else ""
        tell(f"note: not listed in {path}: {', '.join(str(one) for one in left_out[:TOLD])}{more}")
    return path


@cache
def _schema_text() -> str:
    return json.dumps(schema(), indent=2) + "\n"


def _reports(folder: Path) -> tuple[list[Report], list[LeftOut]]:
    reports, left_out = [], []
    for path in sorted(folder.glob("*.json")):
        if path.name == SCHEMA_NAME:
            continue
        try:
            report = _read(path)
        except InputError as error:
            left_out.append(LeftOut(path.name, error.problem))
        except (OSError, ValueError, RecursionError, MemoryError) as error:
            left_out.append(LeftOut(path.name, f"cannot be read: {getattr(error, 'strerror', None) or type(error).__name__}"))
        else:
            reports += [report] if report else []
    return reports, left_out


def _read(path: Path) -> Report | None:
    """The report that a file holds; None if it is another document of ours. Raises InputError and what reading raises."""
    text = read_text(path, REPORT_BYTES)
    try:
        report = report_of(text, path)
    except InputError:
        if OTHER_DOCUMENTS in text[:BEGINNING] and FORMAT not in text[:BEGINNING]:
            return None
        raise
    if path.stem != report.robot.name:
        raise InputError(f"is a report of {report.robot.name}, which belongs into {report.robot.name}.json", where=path)
    return report
