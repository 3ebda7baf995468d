"""The DH table: rows, conventions and constant parts. Reading it from a file is `dh_csv`; engines need no more than this.

Standard (Denavit & Hartenberg 1955; Siciliano et al., "Robotics", eq. 2.52):
    A_i = RotZ(theta_i) TransZ(d_i) TransX(a_i) RotX(alpha_i)
Modified (Craig, "Introduction to Robotics", eq. 3.6), a and alpha of the *previous* link on row i:
    A_i = RotX(alpha_i) TransX(a_i) RotZ(theta_i) TransZ(d_i)
Revolute: theta_i = q_i + theta. Prismatic: d_i = q_i + d. Fixed: no joint.
T_base_tool = base A_1 ... A_n tool.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

import numpy as np

from harness import se3
from harness.description.written import Written
from harness.errors import InputError, nearest

Convention: TypeAlias = Literal["standard", "modified"]
Kind: TypeAlias = Literal["revolute", "prismatic", "fixed"]


@dataclass(frozen=True, kw_only=True)
class DHRow:
    """One row of the table.

    Attributes:
        name: name of the joint, or of the row if it is fixed.
        kind: revolute, prismatic or fixed.
        a: length along x [m].
        alpha: twist about x [rad].
        d: distance along z [m]; of a prismatic row the offset added to q.
        theta: angle about z [rad]; of a revolute row the offset added to q.
    """

    name: str
    kind: Kind
    a: float
    alpha: float
    d: float
    theta: float

    @classmethod
    def of(cls, name: str, kind: Kind, numbers: Iterable[float]) -> DHRow:
        """A row from its four numbers.

        Args:
            name: name of the joint or row.
            kind: revolute, prismatic or fixed.
            numbers: in the order of the columns: a [m], alpha [rad], d [m], theta [rad].

        Raises:
            ValueError: there are not four numbers.
        """
        a, alpha, d, theta = (x if isinstance(x, Written) else float(x) for x in numbers)
        return cls(name=name, kind=kind, a=a, alpha=alpha, d=d, theta=theta)


def check_convention(convention: object) -> None:
    """Raise InputError unless it is `standard` or `modified`."""
    if convention not in get_args(Convention):
        raise InputError(f"expected 'standard' or 'modified', got {convention!r}", key="convention")


@dataclass(frozen=True)
class DHTable:
    """A serial chain in DH parameters.

    Frames are labelled `base` (where placements are expressed), `0` (after the base transform), `1` ... `n` (after each
    row, fixed rows included) and `tool` (after the tool transform).

    Attributes:
        rows: the rows, in order from the base.
        convention: standard or modified.
        base: T_base_0 (4, 4) [m].
        tool: T_n_tool (4, 4) [m].
    """

    rows: tuple[DHRow, ...]
    convention: Convention = "standard"
    base: se3.Array = field(default_factory=lambda: np.eye(4))
    tool: se3.Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        """Refuse another convention: it would be taken for one of the two. Raises InputError."""
        check_convention(self.convention)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the rows that move, in order from the base: the order of q."""
        return tuple(row.name for row in self.rows if row.kind != "fixed")

    @property
    def frames(self) -> tuple[str, ...]:
        """All frame labels in order from the base."""
        return ("base", *(str(i) for i in range(len(self.rows) + 1)), "tool")

    def kind(self, joint: str) -> Kind:
        """Kind of the named row.

        Raises:
            KeyError: there is no such row.
        """
        for row in self.rows:
            if row.name == joint:
                return row.kind
        raise KeyError(f"no row {joint!r}; {nearest(joint, (row.name for row in self.rows))}")
