"""What a comparison of two mechanisms found: the verdict, the causes, both tables, in words and numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from harness.cause.changes import Change, amount
from harness.cause.explain import Explanation
from harness.description.dh import Convention
from harness.difference.operands import Operand
from harness.difference.remarks import remarks
from harness.digits import discrepancy
from harness.errors import ExitCode
from harness.kinematics.invariants import Matching
from harness.kinematics.side_by_side import COLUMNS, Side, Unit, difference_of, with_matching_normals
from harness.report.notebook import html_lines, html_table, text_table
from harness.report.text import metres, plain, radians
from harness.theorem.statement import Theorem

CHANGED = 1e-9  # m, rad: below, two numbers of a table are the same
MOST_EQUIVALENTS = 4


class Largest(NamedTuple):
    """The largest discrepancies of the tip: position [m] and rotation [rad]."""

    position: float
    rotation: float


class Line(NamedTuple):
    """One line of the text, and what it is: `same`, `different`, `cause`, `warning` or nothing in particular."""

    text: str
    kind: str = ""


class Cell(NamedTuple):
    """One cell of the table, and what it is: b's number where it is `changed`, `by` how much, or nothing in particular."""

    text: str
    kind: str = ""


@dataclass(frozen=True, kw_only=True, repr=False)
class Difference:
    """Two mechanisms from base to tip, compared.

    a, b: the operands.
    same: whether they agree within `tolerance` at every configuration tried.
    largest: largest discrepancy seen.
    theorem: what is proven of the two, for every angle, and half a metre of each slide either way.
    tolerance: what counts as agreement [m], [rad].
    joints: b's joint for each of a's.
    explanation: the repair that makes both agree; None if they do, or none was found.
    unexplained: where the two part, if they differ and no repair was found.
    convention: DH convention of `tables`.
    tables: canonical tables of a and b.
    matching: how the tables match, base, tool, joint signs and zero offsets aside; None if one has no table.
    """

    a: Operand
    b: Operand
    same: bool
    largest: Largest
    theorem: Theorem
    tolerance: Largest
    joints: dict[str, str]
    explanation: Explanation | None
    unexplained: str
    convention: Convention
    tables: tuple[Side, Side]
    matching: Matching | None

    @property
    def bound(self) -> Largest | None:
        """No configuration has a larger discrepancy: position [m] and rotation [rad]. Proven."""
        return Largest(self.theorem.position, self.theorem.rotation) if self.theorem.frames else None

    @property
    def causes(self) -> tuple[Change, ...]:
        """The changes that make both agree, the plainest first; empty if they agree, or none was found.

        Each has its text, and for a number `subject`, `parameter`, `size` [m or rad] and `unit`.
        """
        return () if self.explanation is None else self.explanation.changes

    @property
    def exit_code(self) -> ExitCode:
        """What `crosscheck diff` ends with."""
        return ExitCode.AGREES if self.same else ExitCode.DISAGREES

    @property
    def report(self) -> str:
        """All that `crosscheck diff` prints, as text."""
        lines = [str(self), "", *(line.text for line in self.notes()), *self._table_text(), self.aside()]
        return "\n".join(lines).rstrip() + "\n"

    def __str__(self) -> str:
        return "\n".join(line.text for line in (self.headline(), *self.reasons()))

    def __repr__(self) -> str:
        return f"<Difference {self.headline().text}>"

    def _repr_html_(self) -> str:
        lines = [line.text for line in (self.headline(), *self.reasons(), *self.notes())]
        header, rows = self.table()
        cells = [[cell.text for cell in row] for row in rows]
        return html_lines(lines) + (html_table(header, cells) + html_lines([self.aside()]) if rows else "")

    def headline(self) -> Line:
        """The verdict and how far apart the two are."""
        word, kind = ("SAME", "same") if self.same else ("DIFFERENT", "different")
        if self.theorem.is_equal:
            return Line(plain(f"{word} {self.a.label} and {self.b.label}: equal at every configuration (proven)"), kind)
        seen = f"up to {metres(discrepancy(self.largest.position))}, {radians(discrepancy(self.largest.rotation))} apart"
        units = {joint: "m" if slides else "rad" for joint, slides in zip(self.a.joints, self.a.prismatic, strict=True)}
        slides = [f"{joint} from {low:.3g} to {high:.3g} {units[joint]}" for joint, (low, high) in self.theorem.ranges.items()]
        where = f"for all q{' with ' if slides else ''}{', '.join(slides)}"
        bound = self.bound
        proven = f"{where} at most {metres(bound.position)}, {radians(bound.rotation)} (proven)" if bound else "nothing is proven"
        return Line(plain(f"{word} {self.a.label} and {self.b.label}: {seen}; {proven}"), kind)

    def reasons(self) -> Iterator[Line]:
        """Why they differ, one change a line, each with what does the same in its place."""
        if self.unexplained:
            yield Line(plain(f"  unexplained: {self.unexplained}"))
        if self.explanation is None:
            return
        e = self.explanation
        for i, (change, others) in enumerate(zip(e.changes, e.equivalents, strict=True)):
            yield Line(plain(f"  {'why: ' if i == 0 else '     '}{change.text}"), "cause")
            if others:
                yield Line(plain(f"         the same: {'; '.join(c.text for c in others[:MOST_EQUIVALENTS])}"))
        for text in remarks(e):
            yield Line(plain(f"  note: {text}"))
        before, after = (f"{metres(discrepancy(x))}, {radians(discrepancy(y))}" for x, y in (e.before, e.after))
        yield Line(f"  tried: {before} before, {after} after")

    def notes(self) -> Iterator[Line]:
        """What stands above the table: why there is none, or what its columns are."""
        for operand, side in zip((self.a, self.b), self.tables, strict=True):
            if side.problem:
                yield Line(plain(f"{operand.label} has no DH table: {side.problem}"), "warning")
        if all(not side.problem for side in self.tables):
            yield Line(plain(f"canonical {self.convention} DH: A = {self.a.label}, B = {self.b.label}; differences B - A"))

    def table(self) -> tuple[list[str], list[list[Cell]]]:
        """Both canonical tables, a row a joint, and what differs in mm and degrees: header and rows; no rows if there is none."""
        header = ["joint"]
        for name, unit in COLUMNS:
            header += [f"A {name} [{'mm' if unit == 'm' else 'deg'}]", f"B {name}", "difference"]
        one, other = self.tables
        if one.problem or other.problem:
            return header, []
        rows = []
        for a, b in zip(one.rows, with_matching_normals(one.rows, other.rows, self.convention), strict=True):
            row = [Cell(plain(a.name))]
            for name, unit in COLUMNS:
                row += _cells(float(getattr(a, name)), float(getattr(b, name)), unit)
            rows.append(row)
        return header, rows

    def aside(self) -> str:
        """The largest difference that no base, tool, joint sign or zero offset explains."""
        if self.matching is None or any(side.problem for side in self.tables):
            return ""
        largest = self.matching.largest
        if largest is None or largest.size <= CHANGED:
            return "base, tool, joint signs and zero offsets aside: the same mechanism"
        what = f"{largest.name} of {largest.joint} by {amount(largest.size, largest.unit).lstrip('+')}"
        return plain(f"base, tool, joint signs and zero offsets aside, most different: {what}")

    def _table_text(self) -> list[str]:
        header, rows = self.table()
        return text_table(header, [[cell.text for cell in row] for row in rows]) if rows else []


def _cells(a: float, b: float, unit: Unit) -> list[Cell]:
    scale = 1e3 if unit == "m" else 180.0 / math.pi
    difference = difference_of(b, a, unit)
    changed = abs(difference) > CHANGED
    return [
        Cell(f"{round(a * scale, 6) + 0.0:.9g}"),
        Cell(f"{round(b * scale, 6) + 0.0:.9g}", "changed" if changed else ""),
        Cell(f"{difference * scale:+.6g}" if changed else "", "by"),
    ]
