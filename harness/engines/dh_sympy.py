"""`dh:sympy`: the DH product written out by SymPy and compiled to NumPy by `lambdify` (https://www.sympy.org)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.engines.base import Engine, Trait
from harness.se3 import QUARTER_TURN, Array


class DHSympy(Engine):
    """The symbolic product of the rows, `lambdify(..., cse=True)`, called once on the columns of a batch."""

    source = "dh:sympy"
    requirements = ("sympy>=1.12",)
    traits = (
        Trait(
            "exact-right-angles",
            "an angle that is a multiple of pi/2 to the last bit enters the product as that exact number",
            "sympy 1.14.0: a row with alpha = pi/2 gives exact zeros, where cos(pi/2) in floating point is 6e-17",
        ),
        Trait(
            "constants-15-digits",
            "lambdify writes constants with 15 significant digits: each length or sine is off by up to 5e-15 of itself",
            "sympy 1.14.0: 1828 of 2000 random doubles change on their way through lambdify",
        ),
        Trait(
            "symbolic-growth",
            "the expanded product doubles to triples with each row that is not at right angles: 3 s for 8 such rows, 40 s for 12",
            "sympy 1.14.0, tables of random rows; a UR5 takes 0.1 s",
        ),
    )

    def __init__(self, description: DHTable) -> None:
        self._sympy = sympy = self.library("sympy")
        self.joints = description.joints
        self.frames = description.frames
        self._symbols = sympy.symbols(f"q:{len(self.joints)}", real=True)
        variables = iter(self._symbols)
        T = sympy.Matrix(description.base)
        self._products = {"base": sympy.eye(4), "0": T}
        for i, row in enumerate(description.rows, start=1):
            T = T * self._row(row, description.convention, 0 if row.kind == "fixed" else next(variables))
            self._products[str(i)] = T
        self._products["tool"] = T * sympy.Matrix(description.tool)
        self._compiled: dict[tuple[str, ...], Callable[..., Any]] = {}

    def _row(self, row: DHRow, convention: str, q: Any) -> Any:
        """A_i, written as in the textbooks."""
        sympy = self._sympy
        turn, slide = (0, q) if row.kind == "prismatic" else (q, 0)
        theta, alpha = turn + self._angle(row.theta), self._angle(row.alpha)
        a, d = sympy.Float(row.a), slide + sympy.Float(row.d)
        s, c, sa, ca = sympy.sin(theta), sympy.cos(theta), sympy.sin(alpha), sympy.cos(alpha)
        if convention == "modified":
            rows = [c, -s, 0, a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], [0, 0, 0, 1]
        else:
            rows = [c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]
        return sympy.Matrix(rows)

    def _angle(self, angle: float) -> Any:
        quarters = round(angle / QUARTER_TURN)
        return self._sympy.pi * quarters / 2 if angle == quarters * QUARTER_TURN else self._sympy.Float(angle)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        chosen = tuple(frames)
        if chosen not in self._compiled:
            cells = [self._products[frame][i, j] for frame in chosen for i in range(3) for j in range(4)]
            self._compiled[chosen] = self._sympy.lambdify(self._symbols, cells, modules="numpy", cse=True)
        cells = self._compiled[chosen](*np.ascontiguousarray(q.T))
        out = np.zeros((len(frames), 4, 4, q.shape[0]))  # one contiguous vector per cell
        for index, cell in enumerate(cells):  # constant cells are scalars
            frame, row, column = np.unravel_index(index, (len(frames), 3, 4))
            out[frame, row, column] = cell
        out[:, 3, 3] = 1.0
        return out.transpose(3, 0, 1, 2)
