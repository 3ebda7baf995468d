"""What was derived from a URDF: the DH table, the links on it, and in words what people want to see of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from harness.description.dh import DHTable
from harness.description.tidy import angle_text, is_identity, number_text, transform_toml
from harness.description.urdf import Urdf
from harness.report.notebook import html_lines, html_table, text_table
from harness.report.text import plain
from harness.se3 import Array

HEADER = ("joint", "type", "a", "alpha", "d", "theta")


@dataclass(frozen=True)
class DerivedLink:
    """A URDF link of the chain: the DH frame it rides on and its constant offset from it, T_dh_link (4, 4)."""

    name: str
    dh: str
    offset: Array


@dataclass(frozen=True, kw_only=True, repr=False)
class Derived:
    """A DH table, the links of the chain, the free directions fixed by choice, and how well the screws rebuild the chain."""

    urdf: Urdf
    table: DHTable
    base: str
    tip: str
    links: tuple[DerivedLink, ...]
    free: tuple[str, ...]
    residual: float

    def headline(self) -> str:
        """Between which links, in which convention and units."""
        return plain(f"{self.base} to {self.tip}, {self.table.convention} DH, metres and radians")

    def rows(self) -> list[list[str]]:
        """The rows of the table as they are written to dh.csv, under HEADER."""
        rows = []
        for row in self.table.rows:
            numbers = (number_text(row.a), angle_text(row.alpha), number_text(row.d), angle_text(row.theta))
            rows.append([plain(cell) for cell in (row.name, row.kind, *numbers)])
        return rows

    def transforms(self) -> Iterator[str]:
        """Base and tool transform, where they are not the identity."""
        for name, T in (("base", self.table.base), ("tool", self.table.tool)):
            if not is_identity(T):
                yield f"{name}: " + ", ".join(f"{k} = {v}" for k, v in transform_toml(T).items())

    def choices(self) -> Iterator[str]:
        """The directions that parallel axes leave free."""
        return (f"fixed by choice: {plain(direction)}" for direction in self.free)

    def check(self) -> str:
        """How well the joint screws rebuild the chain; empty if that was not measured."""
        return f"the joint screws rebuild the chain to {self.residual:.1e}" if math.isfinite(self.residual) else ""

    def __str__(self) -> str:
        lines = [self.headline(), *text_table(HEADER, self.rows()), *self.transforms(), *self.choices(), self.check()]
        return "\n".join(line for line in lines if line)

    def __repr__(self) -> str:
        return f"<Derived {self.headline()}, {len(self.table.rows)} rows>"

    def _repr_html_(self) -> str:
        return html_lines([self.headline()]) + html_table(HEADER, self.rows()) + html_lines([*self.transforms(), *self.choices()])
