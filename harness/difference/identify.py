"""`crosscheck identify`: which known DH table a mechanism is, whatever its base, tool, joint signs and zero offsets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.description.dh import DHRow
from harness.description.locate import model_folders
from harness.difference.operands import TIP, TOOLBOX, Operand, read_operand
from harness.errors import CrosscheckError, EngineFailed, EngineUnavailable, InputError
from harness.kinematics.canonical import canonical
from harness.kinematics.invariants import Matching, ParameterDifference, match
from harness.kinematics.screws import chain_screws, finite_steps
from harness.workers.packaged_tables import packaged_tables

PARALLEL = 0.02  # rad: calibrated axes are as parallel as that, and have no common normal worth the name


@dataclass(frozen=True)
class Likeness:
    """How a known table differs: its largest length and angle differences, None if there is none to differ, and joint signs."""

    name: str
    length: ParameterDifference | None
    angle: ParameterDifference | None
    signs: tuple[int, ...]

    @property
    def size(self) -> tuple[float, int]:
        """The larger difference, a metre counted as a radian; then how many joints turn the other way."""
        return round(max((d.size for d in (self.length, self.angle) if d), default=0.0), 9), self.signs.count(-1)


def identify(operand: Operand, models: Path) -> tuple[list[Likeness], list[str]]:
    """Known tables with the same kinds of joints, nearest first; and what could not be asked. Raises InputError."""
    own = rows_of(operand)
    if isinstance(own, str):
        raise InputError(f"it has no DH table to compare: {own}", where=operand.label)
    found: list[Likeness] = []
    left_out: list[str] = []
    for known in _known(models, left_out):
        if known.prismatic != operand.prismatic:
            continue
        rows = rows_of(known)
        if isinstance(rows, str):
            left_out.append(f"{known.name}: {rows}")
        else:
            found.append(_likeness(known.name, match(own, rows)))
    return sorted(found, key=lambda likeness: likeness.size), left_out


def rows_of(operand: Operand) -> tuple[DHRow, ...] | str:
    """Standard canonical rows of a mechanism, axes that are nearly parallel taken for parallel; or why there are none."""
    n = len(operand.joints)
    mechanism = operand.recipe(operand.joints, {j: j for j in operand.joints}, False).mechanism
    q = np.concatenate([np.zeros((1, n)), np.diag(finite_steps(operand.prismatic))])
    prismatic = list(operand.prismatic)
    try:
        screws = chain_screws(mechanism.placements(q, (TIP,))[:, 0], prismatic)
        return canonical(screws, prismatic, "standard", list(operand.joints), PARALLEL).rows
    except ValueError as error:
        return str(error)


def _likeness(name: str, matching: Matching) -> Likeness:
    def largest(unit: str) -> ParameterDifference | None:
        return max((d for d in matching.differences if d.unit == unit), key=lambda d: d.size, default=None)

    return Likeness(name, largest("m"), largest("rad"), matching.signs)


def _known(models: Path, left_out: list[str]) -> Iterator[Operand]:
    """Every robot model, every table beside them, every table of the Robotics Toolbox."""
    texts = [*(str(p) for p in model_folders(models).values()), *(str(p) for p in sorted(models.glob("tables/*.csv")))]
    for text in texts:
        try:
            path = Path(text)
            yield read_operand(text if path.suffix else f"{path}/", models, None, None, "standard")
        except CrosscheckError as error:  # the others are still asked
            left_out.append(str(error))
    try:
        names = list(packaged_tables())
    except (EngineUnavailable, EngineFailed) as error:
        left_out.append(f"the Robotics Toolbox's tables: {error}")
        return
    for name in names:
        yield read_operand(f"{TOOLBOX}{name}", models, None, None, "standard")
