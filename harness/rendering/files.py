"""Writes reports: the four files of a robot together or not at all (see `harness.writing`), any other file in one step."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from harness.errors import InputError
from harness.rendering.html import render_html
from harness.rendering.index import write_index
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report.document import Report
from harness.report.json_file import to_json
from harness.writing import clean, replace_file, replace_together

__all__ = ["prepare", "write", "write_index", "write_rendered", "write_report", "write_summary"]


def prepare(folder: Path) -> None:
    """Create the output folder and make sure it can be written to, before any work. Raises InputError.

    What killed runs have left there is put in order: reports half exchanged, temporary files.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        clean(folder)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"cannot write reports here: {error.strerror}", where=folder, key="--out", hint="choose another --out"
        ) from None


def write_report(report: Report, folder: Path) -> list[Path]:
    """Write JSON, HTML, Markdown and JUnit of one robot into `folder`, all four or none. Raises InputError."""
    return _write_together(report, folder, {f"{report.robot.name}.json": to_json(report), **_rendered(report)})


def write_rendered(report: Report, folder: Path) -> list[Path]:
    """Write what is rendered from the document, HTML, Markdown and JUnit, all three or none. Raises InputError."""
    return _write_together(report, folder, _rendered(report))


def _rendered(report: Report) -> dict[str, str]:
    """By file name."""
    name = report.robot.name
    return {
        f"{name}.html": render_html(report),
        f"{name}.md": render_markdown(report),
        f"{name}.junit.xml": render_junit(report),
    }


def _write_together(report: Report, folder: Path, texts: Mapping[str, str]) -> list[Path]:
    try:
        replace_together(folder, report.robot.name, texts)
    except OSError as error:
        where = folder / f"{report.robot.name}.*"
        raise InputError(f"cannot be written: {error.strerror}", where=where, hint="choose another --out") from None
    return [folder / name for name in texts]


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


def write(path: Path, text: str) -> Path:
    """Replace `path` by `text` in one step. Raises InputError if the folder cannot be written to."""
    try:
        replace_file(path, text)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", where=path, hint="choose another --out") from None
    return path
