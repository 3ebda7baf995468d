"""One result of the lint of a URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Level = Literal["error", "warning", "note"]

MOST_NAMED = 6


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One lint result.

    Attributes:
        code: what kind of finding it is. A trait of an engine names the code that makes it matter.
        level: `error`: not a kinematic tree, refused; `warning`: engines are known to differ on it; `note`: worth knowing.
        subject: the joint or link it is about; the first of them if there are several.
        message: one sentence. It names no engine: what is known of engines is in their traits.
        line: line in the file; 0 if there is none.
        joint_type: type of the joint, where engines take the types differently; else empty.
    """

    code: str
    level: Level
    subject: str
    message: str
    line: int
    joint_type: str = ""


def about(code: str, level: Level, what: str, joints: Sequence[tuple[str, int]]) -> Finding:
    """One finding about one or many joints.

    Args:
        code: its code.
        level: its level.
        what: what was found, as a clause.
        joints: name and line of each joint; at least one.
    """
    names = [name for name, _ in joints]
    return Finding(code=code, level=level, subject=names[0], message=f"{listed(names, 'joint')}: {what}", line=joints[0][1])


def listed(names: Sequence[str], what: str) -> str:
    """`joint 'a'`, or `joints 'a', 'b' and 3 more`.

    Args:
        names: the names; at least one.
        what: what they name, in the singular.
    """
    plural = f"{what}es" if what.endswith("x") else f"{what}s"
    quoted = ", ".join(repr(name) for name in names[:MOST_NAMED])
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{plural if len(names) > 1 else what} {quoted}{more}"
