"""Small tables and paragraphs for a REPL and a notebook; everything that came from an input is escaped."""

from __future__ import annotations

import html
from collections.abc import Sequence

from harness.report.text import plain


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Header and rows as lines, columns two spaces apart, numbers to the right."""
    cells = [[plain(cell) for cell in row] for row in (header, *rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(header))]
    right = [k > 0 and all(_numeric(row[k]) for row in cells[1:]) for k in range(len(header))]

    def padded(k: int, cell: str) -> str:
        return cell.rjust(widths[k]) if right[k] else cell.ljust(widths[k])

    return ["  ".join(padded(k, cell) for k, cell in enumerate(row)).rstrip() for row in cells]


def html_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same as an HTML table."""
    head = "".join(f"<th>{escaped(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escaped(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def html_lines(lines: Sequence[str]) -> str:
    """A paragraph a line, the first one bold."""
    paragraphs = [f"<p>{escaped(line.strip())}</p>" for line in lines if line.strip()]
    if paragraphs:
        paragraphs[0] = paragraphs[0].replace("<p>", "<p><b>", 1).replace("</p>", "</b></p>")
    return "".join(paragraphs)


def escaped(text: str) -> str:
    """Text for HTML: markup characters escaped, control characters replaced."""
    return html.escape(plain(text))


def _numeric(text: str) -> bool:
    try:
        float(text or "0")
    except ValueError:
        return False
    return True
