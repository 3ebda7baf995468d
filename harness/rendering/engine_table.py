"""All engines over all robots of a run: version, verdict, largest discrepancies, or why one did not run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from harness.rendering.tables import bare_table
from harness.report.document import Report, Source
from harness.report.text import metres, plain
from harness.report.verdicts import Verdict


def show_engine_table(reports: Sequence[Report], console: Console) -> None:
    """Print one row an engine; robots are named where it did anything but agree."""
    by_engine: dict[str, list[tuple[Report, Source]]] = {}
    for report in reports:
        for source in report.sources:
            by_engine.setdefault(source.name, []).append((report, source))
    table = bare_table("engine", "version", "verdict", "largest, accepted aside", "")
    for name, entries in by_engine.items():
        counts = Counter(source.verdict for _, source in entries)
        verdict = ", ".join(f"{count} {text}" for text, count in counts.items())
        bad = {source.verdict for _, source in entries if not source.passes}
        style = "red" if bad - {Verdict.NOT_RUN} else "yellow" if bad else "green"
        cells = (name, _versions(entries), verdict, _largest(entries), _notes(entries))
        table.add_row(*(Text(plain(cell), style=style if cell is verdict else "") for cell in cells))
    console.print(table)
    console.print()


def _versions(entries: Sequence[tuple[Report, Source]]) -> str:
    texts = {
        ", ".join(f"{k} {v}" for k, v in report.environment.versions.get(source.name, {}).items())
        for report, source in entries
        if source.status == "ran"
    }
    return " / ".join(sorted(texts)) or "-"


def _largest(entries: Sequence[tuple[Report, Source]]) -> str:
    """The largest position discrepancy at a frame that has no accepted one, and the robot."""
    found = [(f.position.max, r.robot.name) for r, s in entries if s.status == "ran" for f in s.frames if f.accepted is None]
    if not found:
        return "-"
    worst, robot = max(found)
    return f"{metres(worst)} ({robot})"


def _notes(entries: Sequence[tuple[Report, Source]]) -> str:
    """Each reason why it did not run or did not agree, with the robots it holds for."""
    robots: dict[str, list[str]] = {}
    for report, source in entries:
        if not source.passes:
            robots.setdefault(source.reason or f"{source.verdict} at {source.worst_frame}", []).append(report.robot.name)
    total = len(entries)
    return "; ".join(why if len(names) == total else f"{why} ({','.join(names)})" for why, names in robots.items())
