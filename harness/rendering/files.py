"""Writes reports whole or not at all: under a temporary name, then renamed."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from pathlib import Path

from harness.errors import InputError
from harness.rendering.html import render_html, render_index
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report.document import Report
from harness.report.json_file import FORMAT, read_report, schema, to_json

SCHEMA_NAME = "report.schema.json"


def prepare(folder: Path) -> None:
    """Create the output folder and make sure it can be written to, before any work. Raises InputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"cannot write reports here: {error.strerror}", where=folder, key="--out", hint="choose another --out"
        ) from None


def write_report(report: Report, folder: Path) -> list[Path]:
    """Write JSON, HTML, Markdown and JUnit of one robot into `folder`. Raises InputError."""
    name = report.robot.name
    return [write(folder / f"{name}.json", to_json(report)), *write_rendered(report, folder)]


def write_rendered(report: Report, folder: Path) -> list[Path]:
    """Write what is rendered from the document: HTML, Markdown and JUnit. Raises InputError."""
    name = report.robot.name
    return [
        write(folder / f"{name}.html", render_html(report)),
        write(folder / f"{name}.md", render_markdown(report)),
        write(folder / f"{name}.junit.xml", render_junit(report)),
    ]


def write_summary(report: Report) -> None:
    """Append the Markdown to the job's summary, if a CI server gives a file for it: $GITHUB_STEP_SUMMARY. Raises InputError."""
    path = os.environ.get("GITHUB_STEP_SUMMARY")
    if not path:
        return
    try:
        with Path(path).open("a", encoding="utf-8") as file:
            file.write(render_markdown(report) + "\n")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where=path, key="GITHUB_STEP_SUMMARY") from None


def write_index(folder: Path) -> Path:
    """Write `index.html` over every report in `folder`, and the schema beside it. Raises InputError."""
    write(folder / SCHEMA_NAME, json.dumps(schema(), indent=2) + "\n")
    reports = []
    for path in sorted(folder.glob("*.json")):
        # Other JSON, and reports of another version, are not ours to judge: they are left out of the list.
        with contextlib.suppress(InputError):
            if path.name != SCHEMA_NAME and FORMAT in path.read_text(encoding="utf-8", errors="replace")[:200]:
                reports.append(read_report(path))
    return write(folder / "index.html", render_index(reports))


def write(path: Path, text: str) -> Path:
    """Replace `path` by `text` in one step. Raises InputError if the folder cannot be written to."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        try:
            temporary.write_text(text, encoding="utf-8")
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where=path, hint="choose another --out") from None
    return path
