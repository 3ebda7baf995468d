"""`crosscheck identify`: which known DH table a mechanism is, whatever its base, tool, joint signs and zero offsets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harness.cause.changes import amount
from harness.description.dh import DHRow
from harness.description.locate import model_folders
from harness.difference.operands import TIP, Operand
from harness.difference.reading import TOOLBOX, Ends, read_operand
from harness.errors import CrosscheckError, EngineFailed, EngineUnavailable, ExitCode, InputError, shortened
from harness.kinematics.canonical import canonical
from harness.kinematics.invariants import Matching, ParameterDifference, match
from harness.kinematics.screws import chain_screws, step_configurations
from harness.report.notebook import html_lines, html_table, text_table
from harness.report.text import plain
from harness.workers.packaged_tables import packaged_tables

ALIKE = 1e-3  # m, rad: a table as near as that is the same robot
CHANGED = 1e-9  # m, rad: below, two numbers are the same
NONE_LIKE_IT = "no known table has such joints"
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


@dataclass(frozen=True, repr=False)
class Identification:
    """Which known tables a mechanism is like.

    operand: the mechanism that was asked about.
    known: tables with the same kinds of joints, nearest first.
    left_out: what could not be asked, and why.
    """

    operand: Operand
    known: tuple[Likeness, ...]
    left_out: tuple[str, ...]

    @property
    def nearest(self) -> Likeness | None:
        """The table that is most like it; None if none has such joints."""
        return self.known[0] if self.known else None

    @property
    def same(self) -> bool:
        """Whether the nearest table is it, to within a millimetre and a milliradian."""
        return self.nearest is not None and self.nearest.size[0] <= ALIKE

    @property
    def exit_code(self) -> ExitCode:
        """What `crosscheck identify` ends with."""
        return ExitCode.AGREES if self.same else ExitCode.DISAGREES

    def headline(self) -> str:
        """What was asked about."""
        kinds = "".join("P" if slides else "R" for slides in self.operand.prismatic)
        return plain(
            f"{self.operand.label}: {len(kinds)} joints, {shortened(kinds)}; base, tool, joint signs and zero offsets aside"
        )

    def table(self, most: int = 10) -> tuple[list[str], list[list[str]]]:
        """Header and rows of the nearest tables, at most so many."""
        header = ["known table", "largest length difference", "largest angle difference", "joints that turn the other way"]
        rows = []
        for one in self.known[:most]:
            flipped = ", ".join(name for name, sign in zip(self.operand.joints, one.signs, strict=True) if sign < 0)
            rows.append([plain(cell) for cell in (one.name, _size(one.length), _size(one.angle), flipped)])
        return header, rows

    def __str__(self) -> str:
        header, rows = self.table()
        body = text_table(header, rows) if rows else [NONE_LIKE_IT]
        return "\n".join([self.headline(), *body, *(plain(f"left out: {text}") for text in self.left_out)])

    def __repr__(self) -> str:
        nearest = f"nearest {self.nearest.name!r}" if self.nearest else NONE_LIKE_IT
        return f"<Identification {self.operand.label}: {'same as ' if self.same else ''}{nearest}>"

    def _repr_html_(self) -> str:
        header, rows = self.table()
        body = html_table(header, rows) if rows else html_lines([NONE_LIKE_IT])
        return html_lines([self.headline()]) + body


def identify(operand: Operand, models: Path) -> Identification:
    """Known tables with the same kinds of joints, nearest first. Raises InputError if the mechanism has no DH table."""
    own = rows_of(operand)
    if isinstance(own, str):
        raise InputError(f"it has no DH table to compare: {own}", where=operand.label)
    likenesses: list[Likeness] = []
    left_out: list[str] = []
    for known in _known(models, left_out):
        if known.prismatic != operand.prismatic:
            continue
        rows = rows_of(known)
        if isinstance(rows, str):
            left_out.append(f"{known.name}: {rows}")
        else:
            likenesses.append(_likeness(known.name, match(own, rows)))
    return Identification(operand, tuple(sorted(likenesses, key=lambda one: one.size)), tuple(left_out))


def _size(difference: ParameterDifference | None) -> str:
    if difference is None or difference.size <= CHANGED:
        return "0"
    return f"{amount(difference.size, difference.unit).lstrip('+')} ({difference.name} of {difference.joint})"


def rows_of(operand: Operand) -> tuple[DHRow, ...] | str:
    """Standard canonical rows of a mechanism, axes that are nearly parallel taken for parallel; or why there are none."""
    mechanism = operand.recipe(operand.joints, {j: j for j in operand.joints}, False).mechanism
    q = step_configurations(operand.prismatic)
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
            yield read_operand(text if path.suffix else f"{path}/", models, Ends())
        except CrosscheckError as error:  # the others are still asked
            left_out.append(str(error))
    try:
        names = list(packaged_tables())
    except (EngineUnavailable, EngineFailed) as error:
        left_out.append(f"the Robotics Toolbox's tables: {error}")
        return
    for name in names:
        yield read_operand(f"{TOOLBOX}{name}", models, Ends())
