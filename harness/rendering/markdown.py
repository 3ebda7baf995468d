"""The report in a screenful of Markdown, made to be pasted into a review."""

from __future__ import annotations

import re

from harness.report.document import Report, Source
from harness.report.proven import for_all
from harness.report.sentences import changed_text, difference, moved_text, why
from harness.report.tested import all_tested, further_out
from harness.report.text import metres, numbers, pasteable, plain, radians
from harness.report.verdicts import Verdict

_ENTITY = {"<": "&lt;", ">": "&gt;", "&": "&amp;"}
# A screenful, whatever the report holds: at most 60 lines.
SOURCES, CAUSES, OTHERS = 18, 8, 4


def render_markdown(report: Report) -> str:
    """The report as Markdown text."""
    compared = [source for source in report.sources if not source.reference]
    ranked = sorted(compared, key=lambda s: (s.passes, s.status != "ran" and not s.required))
    lines = [
        f"## {report.verdict.word}: {_md(report.robot.name)}",
        "",
        f"**{_md(report.verdict.sentence)}**",
        "",
        f"{_md(report.robot.description)}. Reference {_code(report.settings.reference)}; {report.settings.fixed} fixed and "
        f"{report.settings.samples} random configurations, seed {report.settings.seed}.",
        "",
        "| source | verdict | worst frame | position | rotation | files, every q | tolerance | magnitude |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(source) for source in ranked[:SOURCES]),
        *([f"| and {len(ranked) - SOURCES} more in the HTML report | | | | | | | |"] if len(ranked) > SOURCES else []),
        "",
        *_limited(_disagreements(report), CAUSES),
        *_limited([*_tested(report), *_parameters(report)], OTHERS),
        *_limited(_published(report), OTHERS),
        *_limited(_since(report), OTHERS),
        *_limited(_not_run(report), OTHERS),
        f"Reproduce: {_code(pasteable(report.settings.command))}",
    ]
    return "\n".join(lines) + "\n"


def _row(source: Source) -> str:
    if not source.frames:
        return f"| {_code(source.name)} | {source.status} | | | | | | {_md(source.reason)} |"
    frame = source.worst
    tolerance = f"{metres(source.tolerance.position)}, {radians(source.tolerance.rotation)}"
    return (
        f"| {_code(source.name)} | {source.verdict} | {_md(frame.frame)} | {metres(frame.position.max)} | "
        f"{radians(frame.rotation.max)} | {for_all(source)} | {tolerance} | {source.noise_text} |"
    )


def _disagreements(report: Report) -> list[str]:
    lines = []
    for source in report.sources:
        failing = [f for f in source.frames if not f.passes]
        if not failing:
            continue
        first = f"first {_md(source.first_disagreeing_frame)}" if source.first_disagreeing_frame else ""
        lines.append(f"- {_code(source.name)}: {len(failing)} of {len(source.frames)} frames are outside tolerance, {first}")
        lines += [f"  - why: {_md(text)}" if not text.startswith(" ") else f"    - {_md(text.strip())}" for text in why(source)]
        if r := source.reproducer:
            lines.append(f"  - {_md(r.frame)} at q = {_code(numbers(r.q))}: {metres(r.position)}, {radians(r.rotation)} off")
        lines += [f"  - {_md(text)}" for text in source.explained_by[:3]]
    accepted = {f.accepted.reason: f for s in report.sources for f in s.frames if f.verdict is Verdict.ACCEPTED and f.accepted}
    lines += [f"- accepted: {_md(reason)} ({metres(f.position.max)})" for reason, f in accepted.items()]
    return lines


def _tested(report: Report) -> list[str]:
    """Each engine against its own description, as far as there is something to say; what passes and what is odd."""
    lines = [f"- {_code(s.name)} {_md(text)}" for s in report.sources for text in further_out(s)]
    lines = [f"- {_code(s.name)}: {_md(s.tested.problem)}" for s in report.sources if s.tested and s.tested.problem] + lines
    text = all_tested(report.sources)
    return [f"- {_md(text)}", *lines] if text else lines


def _parameters(report: Report) -> list[str]:
    """The canonical numbers that differ."""
    side = report.parameters
    if side is None or side.problem:
        return [] if side is None else [f"- canonical parameters: {_md(side.problem)}"]
    marked = [p for p in side.rows if p.marked]
    if not marked:
        return [f"- canonical parameters: all {len(side.rows)} are the same in the table and in the URDF"]
    texts = [f"{p.parameter} of {p.subject} by {difference(p)}" for p in marked[:OTHERS]]
    more = f"; and {len(marked) - OTHERS} more" if len(marked) > OTHERS else ""
    return [f"- canonical parameters: {len(marked)} of {len(side.rows)} differ, URDF less table: {_md('; '.join(texts))}{more}"]


def _since(report: Report) -> list[str]:
    """What moved since it was accepted."""
    g = report.regression
    if g is None:
        return []
    if g.problem:
        return [f"- since {_md(g.accepted)}: not comparable, {_md(g.problem)}"]
    note = f" ({_md(g.note)})" if g.note else ""
    if not g.moved and not g.changed:
        return [f"- since {_md(g.accepted)}: nothing moved by more than the noise floor{note}"]
    counts = f"{len(g.grown)} numbers grew, {len(g.moved) - len(g.grown)} shrank, {len(g.changed)} things changed"
    head = f"- since {_md(g.accepted)}: {counts}{note}"
    worst = sorted(g.moved, key=lambda m: m.before - m.after)
    changed = [f"  - {_md(changed_text(c))}" for c in sorted(g.changed, key=lambda c: not c.worse)]
    return [head, *changed[:1], *(f"  - {_md(moved_text(m))}" for m in worst), *changed[1:]]


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
    return lines


def _not_run(report: Report) -> list[str]:
    return [
        f"- {s.status}: {_code(s.name)} {_md(s.reason)} {_code(s.install) if s.install else ''}".rstrip()
        for s in report.sources
        if s.status != "ran"
    ]


def _limited(lines: list[str], most: int) -> list[str]:
    """At most `most` lines and one that says how many were left out, and the blank line that ends a list."""
    if len(lines) > most + 1:
        lines = [*lines[:most], f"- and {len(lines) - most} more lines in the HTML report"]
    return [*lines, ""] if lines else []


def _md(text: str) -> str:
    """Text whose letters mean nothing but themselves in Markdown and HTML, nor to GitHub and GitLab afterwards."""
    text = re.sub(r"([\\`*_{}\[\]()#+!|~$<>&])", lambda found: _ENTITY.get(found[1], "\\" + found[1]), plain(text))
    # Mentions and issue numbers are looked for in the finished page, where no escape is left: a space of no width is.
    text = re.sub(r"@|#(?=\w)", lambda found: found[0] + "&#8203;", text)
    return text.replace("://", ":&#47;/").replace("www.", "www&#46;")


def _code(text: str) -> str:
    """Text in a code span; backticks and pipes, which would end it or a table cell, are replaced."""
    return "`" + plain(text).replace("`", "'").replace("|", "/") + "`"
