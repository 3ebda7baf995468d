"""The report in a screenful of Markdown, made to be pasted into a review."""

from __future__ import annotations

import re

from harness.report.document import Report, Source
from harness.report.text import for_all, metres, numbers, plain, radians, why

MARK = {0: "PASS", 1: "FAIL", 3: "INCOMPLETE"}
MAX_ROWS = 12


def render_markdown(report: Report) -> str:
    """The report as Markdown text."""
    lines = [
        f"## {MARK[report.verdict.exit_code]}: {_md(report.robot.name)}",
        "",
        f"**{_md(report.verdict.sentence)}**",
        "",
        f"{_md(report.robot.description)}. Reference {_code(report.settings.reference)}; {report.settings.fixed} fixed and "
        f"{report.settings.samples} random configurations, seed {report.settings.seed}.",
        "",
        "| source | verdict | worst frame | position | rotation | for all q | tolerance | size of |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(source) for source in report.sources if not source.reference),
        "",
        *_disagreements(report),
        *_published(report),
        *_not_run(report),
        f"Reproduce: {_code(report.settings.command)}",
    ]
    return "\n".join(lines) + "\n"


def _row(source: Source) -> str:
    if not source.frames:
        return f"| {_code(source.name)} | {source.status} | | | | | | {_md(source.reason)} |"
    frame = next(f for f in source.frames if f.frame == source.worst_frame)
    tolerance = f"{metres(source.tolerance.position)}, {radians(source.tolerance.rotation)}"
    return (
        f"| {_code(source.name)} | {source.verdict} | {_md(frame.frame)} | {metres(frame.position.max)} | "
        f"{radians(frame.rotation.max)} | {for_all(source)} | {tolerance} | {source.noise_text} |"
    )


def _disagreements(report: Report) -> list[str]:
    lines = []
    for source in report.sources:
        failing = [f for f in source.frames if f.verdict not in ("agrees", "accepted")]
        if not failing:
            continue
        first = f"first {_md(source.first_disagreeing_frame)}" if source.first_disagreeing_frame else ""
        lines.append(f"- {_code(source.name)}: {len(failing)} of {len(source.frames)} frames are outside tolerance, {first}")
        lines += [f"  - why: {_md(text)}" if not text.startswith(" ") else f"    - {_md(text.strip())}" for text in why(source)]
        if r := source.reproducer:
            lines.append(f"  - {_md(r.frame)} at q = {_code(numbers(r.q))}: {metres(r.position)}, {radians(r.rotation)} off")
        lines += [f"  - {_md(text)}" for text in source.explained_by[:3]]
    accepted = {f.accepted.reason: f for s in report.sources for f in s.frames if f.verdict == "accepted" and f.accepted}
    lines += [f"- accepted: {_md(reason)} ({metres(f.position.max)})" for reason, f in accepted.items()]
    return _limited(lines)


def _published(report: Report) -> list[str]:
    if not report.published:
        return []
    wrong = [p for p in report.published if p.found == "wrong"]
    lines = [f"- published placements: {len(report.published) - len(wrong)} hold, {len(wrong)} are wrong"]
    for p in wrong:
        filed = "" if p.status == p.found else f", **filed as {p.status}**"
        position = numbers([row[3] for row in p.computed[:3]])
        lines.append(
            f"  - {_md(p.configuration)}, DH frame {_md(p.frame)}: published {_code(numbers(p.claimed_position))}, computed "
            f"{_code(position)}{filed}"
        )
    lines += [
        f"  - {_md(p.configuration)}, DH frame {_md(p.frame)}: **filed as wrong, but it holds**"
        for p in report.published
        if p.found == "holds" and p.status == "wrong"
    ]
    return _limited(lines)


def _not_run(report: Report) -> list[str]:
    lines = [
        f"- {s.status}: {_code(s.name)} {_md(s.reason)} {_code(s.install) if s.install else ''}".rstrip()
        for s in report.sources
        if s.status != "ran"
    ]
    return _limited(lines)


def _limited(lines: list[str]) -> list[str]:
    """At most MAX_ROWS lines, saying how many were left out, and the blank line that ends a list."""
    if len(lines) > MAX_ROWS:
        lines = [*lines[:MAX_ROWS], f"- and {len(lines) - MAX_ROWS} more lines in the HTML report"]
    return [*lines, ""] if lines else []


def _md(text: str) -> str:
    """Text whose letters mean nothing but themselves in Markdown and HTML."""
    text = re.sub(r"([\\`*_{}\[\]()#+!|~$])", r"\\\1", plain(text))
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace("@", "&#64;").replace("://", ":&#47;/")


def _code(text: str) -> str:
    """Text in a code span; backticks and pipes, which would end it or a table cell, are replaced."""
    return "`" + plain(text).replace("`", "'").replace("|", "/") + "`"
