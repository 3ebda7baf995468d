"""Operands from whatever they are given as: a name, a path, text, a table, an array of rows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from harness.description.dh import Convention, DHRow, DHTable, check_convention
from harness.description.dh_csv import parse_dh_csv, read_dh_csv
from harness.description.locate import find_model, packaged_file
from harness.description.model import RobotModel, load_model, load_table
from harness.description.urdf import Urdf
from harness.description.urdf_file import parse_urdf, read_urdf
from harness.difference.operands import Operand, of_table, of_urdf
from harness.errors import DescriptionUnavailable, InputError
from harness.workers.packaged_tables import packaged_table

TOOLBOX = "roboticstoolbox:"

Description: TypeAlias = "str | Path | DHTable | RobotModel | Urdf | ArrayLike"


@dataclass(frozen=True)
class Ends:
    """What an operand does not say itself: the links a URDF's chain runs between, and the convention of bare rows.

    base: link to start from; None: the root.
    tip: link to end at; None: the only leaf.
    convention: DH convention of a CSV or of rows.
    """

    base: str | None = None
    tip: str | None = None
    convention: Convention = "standard"

    def __post_init__(self) -> None:
        """Refuse what is neither convention. Raises InputError."""
        check_convention(self.convention)


def read_operand(text: str, models: Path, ends: Ends) -> Operand:
    """A robot model's name or folder, `roboticstoolbox:NAME`, FILE.csv, FILE.urdf, or PACKAGE:FILE.urdf.

    Raises InputError and its kind for what cannot be read.
    """
    if text.startswith(TOOLBOX):
        return of_table(packaged_table(text.removeprefix(TOOLBOX)), text)
    if is_packaged(text):
        return of_urdf(urdf_named(text), ends.base, ends.tip)
    path = Path(text)
    if path.suffix.lower() == ".csv":
        rows, _ = read_dh_csv(path)
        return of_table(DHTable(rows, ends.convention), path.stem)
    if path.is_file() or path.suffix.lower() in (".urdf", ".xml", ".xacro"):
        return of_urdf(read_urdf(path), ends.base, ends.tip)
    folder = find_model(text, models)
    try:
        model = load_model(folder)
    except DescriptionUnavailable:  # its URDF is not installed here; the table is all that is asked for
        model_file, table, _ = load_table(folder)
        return of_table(table, model_file.name)
    return of_table(model.table, model.name)


def is_packaged(text: str) -> bool:
    """Whether it names a file of an installed package, as PACKAGE:FILE.urdf does."""
    return ":" in text and not Path(text).exists()


def urdf_named(text: str) -> Urdf:
    """The URDF of a path, of PACKAGE:FILE.urdf, or the text itself. Raises InputError and its kind."""
    if text.lstrip().startswith("<"):
        return parse_urdf(text.encode(), Path("text"))
    if is_packaged(text):
        package, _, file = text.partition(":")
        if not package or not file:
            raise InputError(f"expected PACKAGE:FILE.urdf, got {text!r}")
        return read_urdf(packaged_file(package, file))
    return read_urdf(Path(text))


def operand_of(description: Description, name: str, models: Path, ends: Ends) -> Operand:
    """An operand from an object, from text, or from what `read_operand` reads.

    description: a `DHTable`, a `RobotModel`, a `Urdf`, rows (n, 4) of a [m], alpha [rad], d [m], theta [rad], all of them
        revolute, the text of a URDF or of a DH CSV, or a name or path.
    name: what an operand without a name of its own is called.
    models: folder of robot models.
    ends: what the description does not say itself.

    Raises InputError and its kind for what cannot be read.
    """
    if isinstance(description, DHTable):
        return of_table(description, name)
    if isinstance(description, RobotModel):
        return of_table(description.table, description.name)
    if isinstance(description, Urdf):
        return of_urdf(description, ends.base, ends.tip)
    if isinstance(description, Path):
        return read_operand(f"{description}/" if description.is_dir() else str(description), models, ends)
    if isinstance(description, str):
        return _of_text(description, name, models, ends)
    return of_table(DHTable(_rows(description, name), ends.convention), name)


def _of_text(text: str, name: str, models: Path, ends: Ends) -> Operand:
    """A string with several lines or an XML tag is a description itself; any other is a name or a path."""
    if text.lstrip().startswith("<"):
        return of_urdf(parse_urdf(text.encode(), Path(name)), ends.base, ends.tip)
    if "\n" in text.strip():
        rows, _ = parse_dh_csv(text, Path(name))
        return of_table(DHTable(rows, ends.convention), name)
    return read_operand(text, models, ends)


def _rows(values: ArrayLike, name: str) -> tuple[DHRow, ...]:
    """Rows of an array. Raises InputError for another shape, or a number that is not finite."""
    try:
        numbers: NDArray[np.float64] = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        kind = type(values).__name__
        raise InputError(f"expected a name, a path, text, a DHTable or rows of numbers, got {kind}", where=name) from None
    if np.iscomplexobj(values):
        raise InputError("expected real numbers, got complex ones", where=name)
    if numbers.ndim == 0:
        kind = type(values).__name__
        raise InputError(f"expected a name, a path, text, a DHTable or rows of numbers, got {kind}", where=name)
    if numbers.ndim != 2 or numbers.shape[1] != 4 or not len(numbers):
        raise InputError(f"expected rows of a, alpha, d, theta, shape (n, 4), got shape {numbers.shape}", where=name)
    if not np.isfinite(numbers).all():
        row, column = np.argwhere(~np.isfinite(numbers))[0]
        raise InputError(f"expected finite numbers, got {numbers[row, column]} in row {row}, column {column}", where=name)
    return tuple(DHRow.of(f"j{i}", "revolute", row) for i, row in enumerate(numbers, start=1))
