"""The report as a person reads it in a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from harness.rendering.tables import bare_table
from harness.report.document import Report, Source
from harness.report.proven import for_all
from harness.report.sentences import changed_text, moved_text, why
from harness.report.tested import all_tested, further_out
from harness.report.text import metres, numbers, plain, radians
from harness.report.verdicts import Verdict

_STYLE = {0: "bold green", 1: "bold red", 3: "bold yellow"}
MAX_REASONS = 6
MAX_WARNINGS = 4
MAX_MOVED = 6


def show(report: Report, console: Console) -> None:
    """Print verdict, one row a source, and where each disagreement is."""
    console.print(
        Text(report.verdict.word, style=_STYLE[report.verdict.exit_code]), Text(plain(report.verdict.sentence)), soft_wrap=True
    )
    table = bare_table("source", "verdict", "worst frame", "position", "rotation", "files, every q", "tolerance", "magnitude")
    for source in report.sources:
        if not source.reference:
            table.add_row(*_row(source))
    console.print(table)
    _causes(report, console)
    for source in report.sources:
        _located(source, report.settings.reference, console)
    _tested(report, console)
    for reason in report.verdict.reasons[1:MAX_REASONS]:
        console.print(Text(f"  also: {plain(reason)}"), soft_wrap=True)
    if (more := len(report.verdict.reasons) - MAX_REASONS) > 0:
        console.print(Text(f"  and {more} more reasons in the report"))
    wrong = [p for p in report.published if p.found == "wrong"]
    if report.published:
        note = f"  published placements: {len(report.published) - len(wrong)} hold, {len(wrong)} wrong"
        as_filed = all(p.found == p.status for p in report.published)
        console.print(Text(note + (" (as filed)" if as_filed else ""), style="" if as_filed else "red"))
    warnings = [finding for finding in report.lint if finding.level == "warning"]
    for finding in warnings[:MAX_WARNINGS]:
        console.print(Text(f"  {plain(finding.message)}", style="yellow"), soft_wrap=True)
    if (more := len(warnings) - MAX_WARNINGS) > 0:
        console.print(Text(f"  and {more} more warnings in the report", style="yellow"))
    _since(report, console)
    if report.unmapped:
        console.print(Text(f"  not mapped, so not checked: {plain(', '.join(report.unmapped))}", style="yellow"), soft_wrap=True)


def _since(report: Report, console: Console) -> None:
    """What moved since it was accepted."""
    g = report.regression
    if g is None:
        return
    if g.problem:
        console.print(Text(plain(f"  since {g.accepted}: not comparable, {g.problem}"), style="yellow"), soft_wrap=True)
        return
    if not g.moved and not g.changed:
        note = f" ({g.note})" if g.note else ""
        console.print(Text(plain(f"  since {g.accepted}: nothing moved by more than the noise floor{note}")), soft_wrap=True)
    for moved in g.moved[:MAX_MOVED]:
        style = "red" if moved.after > moved.before else ""
        console.print(Text(plain(f"  since {g.accepted}: {moved_text(moved)}"), style=style), soft_wrap=True)
    for change in g.changed[:MAX_MOVED]:
        text = plain(f"  since {g.accepted}: {changed_text(change)}")
        console.print(Text(text, style="red" if change.worse else ""), soft_wrap=True)
    if (more := max(0, len(g.moved) - MAX_MOVED) + max(0, len(g.changed) - MAX_MOVED)) > 0:
        console.print(Text(f"  and {more} more changes in the report"))


def _tested(report: Report, console: Console) -> None:
    """Each engine against its own description: one line for all that compute what it says, and one a source for what else is."""
    if (text := all_tested(report.sources)) and text not in report.verdict.sentence:
        console.print(Text(plain(f"  {text}")))
    for source in report.sources:
        for text in further_out(source):
            console.print(Text(plain(f"  {source.name}: {text}")), soft_wrap=True)


def _row(source: Source) -> tuple[Text, ...]:
    verdict = Text(source.verdict, style="green" if source.passes else "yellow" if source.verdict is Verdict.NOT_RUN else "red")
    name = Text(plain(source.name))
    if not source.frames:
        install = f" ({source.install})" if source.install else ""
        return name, verdict, *(Text("") for _ in range(5)), Text(plain(source.reason + install))
    frame = source.worst
    return (
        name,
        verdict,
        Text(plain(frame.frame)),
        Text(metres(frame.position.max)),
        Text(radians(frame.rotation.max)),
        Text(for_all(source)),
        Text(f"{metres(source.tolerance.position)}, {radians(source.tolerance.rotation)}"),
        Text(source.noise_text),
    )


def _causes(report: Report, console: Console) -> None:
    """Why sources disagree; those with the same cause together."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for source in report.sources:
        if source.explanation and not source.passes:
            groups.setdefault(tuple(line for line in why(source) if not line.startswith("  tried")), []).append(source.name)
    for lines, names in groups.items():
        for i, text in enumerate(lines):
            head = "  why: " if i == 0 else "       "
            said = f"{text}  [{', '.join(names)}]" if i == 0 else text
            console.print(Text(f"{head}{plain(said)}", style="" if text.startswith(" ") else "bold"), soft_wrap=True)


def _located(source: Source, reference: str, console: Console) -> None:
    """The frame, the configuration and the evidence of one disagreement."""
    if source.passes:
        return
    if source.first_disagreeing_frame:
        console.print(
            Text(f"  {source.name}: first frame that disagrees: {plain(source.first_disagreeing_frame)}"),
            soft_wrap=True,
        )
    if r := source.reproducer:
        p_a = numbers([row[3] for row in r.reference_placement[:3]])
        p_b = numbers([row[3] for row in r.source_placement[:3]])
        where = f"  {source.name}: {plain(r.frame)} at q = {numbers(r.q)} is {metres(r.position)}, {radians(r.rotation)} off"
        console.print(Text(where), soft_wrap=True)
        console.print(Text(f"    {reference} has it at {p_a}, {source.name} at {p_b}"), soft_wrap=True)
    if source.certificate and source.certificate.status == "refused":
        console.print(Text(f"    nothing proven counts for it: {plain(source.certificate.reason)}"), soft_wrap=True)
    for text in source.explained_by:
        console.print(Text(f"    known: {plain(text)}"), soft_wrap=True)
