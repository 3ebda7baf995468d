"""The table of the terminal output."""

from __future__ import annotations

import io

from rich.console import Console

from harness.rendering.tables import bare_table


def printed(width: int) -> list[str]:
    """Two columns and a third that is added, on a terminal of that width."""
    table = bare_table("joint", "name")
    table.add_column("size", justify="right")
    table.add_row("elbow", "a name of many words", "1.5")
    out = Console(file=io.StringIO(), width=width)
    out.print(table)
    assert isinstance(out.file, io.StringIO)
    return [line.rstrip() for line in out.file.getvalue().splitlines()]


def test_no_lines_and_two_spaces_between_columns() -> None:
    assert printed(80) == ["joint  name                  size", "elbow  a name of many words   1.5"]


def test_a_cell_too_wide_is_folded_and_not_cut() -> None:
    lines = printed(22)
    assert len(lines) > 2
    assert sorted("".join(lines).replace(" ", "")) == sorted("".join(printed(80)).replace(" ", ""))
