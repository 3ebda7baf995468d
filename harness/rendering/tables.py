"""The table of the terminal output: no lines, two spaces between columns, a dim header."""

from __future__ import annotations

from rich.table import Table


def bare_table(*columns: str) -> Table:
    """A table with these columns, to which more may be added. Cells that are too wide fold: nothing is cut off."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column in columns:
        table.add_column(column, overflow="fold")
    return table
