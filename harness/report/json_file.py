"""The report document as JSON: its schema, writing it, and reading one back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticSerializationError

from harness.errors import InputError
from harness.reading import REPORT_BYTES, parsed_json, read_text
from harness.report.document import Report

FORMAT = Report.model_fields["format"].default
VERSION = Report.model_fields["version"].default

# How many a report may have of what every format goes through, some of them each with each.
MOST_SOURCES = 200
MOST_FRAMES = 1000  # mapped frames
MOST_RESULTS = 50_000  # frames of all sources together
MOST_JOINTS = 1000
LONGEST_NAME = 1000  # letters of what stands in many places: the name of a source, of a frame


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the document, generated from the types."""
    generated = Report.model_json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **generated}


def to_json(report: Report) -> str:
    """The document as JSON text."""
    return report.model_dump_json(indent=2) + "\n"


def read_report(path: Path) -> Report:
    """Read a report document. Raises InputError if it cannot be read or is not one of this version."""
    return report_of(read_text(path, REPORT_BYTES), path)


def report_of(text: str, path: Path) -> Report:
    """The report document that a text is. path: for messages. Raises InputError if it is none of this version."""
    data = parsed_json(text, path)
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f'expected a document with "format": "{FORMAT}"', where=path)
    if data.get("version") != VERSION:
        raise InputError(
            f"expected report version {VERSION}, got {data.get('version')!r}",
            where=path,
            hint="run the cross-check again",
        )
    try:
        report = Report.model_validate(data)
        to_json(report)  # what cannot be written, a half of a surrogate pair, is refused here
    except PydanticSerializationError:
        raise InputError("not a report: it holds characters that are none", where=path) from None
    except ValidationError as failure:
        first = failure.errors(include_url=False)[0]
        key = ".".join(str(step) for step in first["loc"])
        problem = first["msg"].removeprefix("Value error, ")
        raise InputError(f"not a report: {problem}", where=path, key=key or None) from None
    _require_bounded(report, path)
    return report


def _require_bounded(report: Report, path: Path) -> None:
    """Refuse what would make a page that is many times as large as its report."""
    results = sum(len(source.frames) for source in report.sources)
    for count, most, what in (
        (len(report.sources), MOST_SOURCES, "sources"),
        (len(report.frames), MOST_FRAMES, "frames"),
        (results, MOST_RESULTS, "frames of all sources together"),
        (len(report.robot.joints), MOST_JOINTS, "joints"),
    ):
        if count > most:
            raise InputError(f"expected at most {most} {what}, got {count}", where=path)
    names = [report.settings.reference, *(s.name for s in report.sources), *(f.name for f in report.frames)]
    if (longest := max(map(len, names))) > LONGEST_NAME:
        raise InputError(f"expected names of at most {LONGEST_NAME} letters, got one of {longest}", where=path)
