"""The Python API: what the command line does, as functions. `import harness` hands it on.

Every function raises the errors of `harness.errors`, with their facts as fields; docs/api.md shows each at work.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TypeAlias, TypeVar

from harness.convert.derive import derive
from harness.convert.result import Derived
from harness.description.dh import Convention, DHTable, check_convention
from harness.description.locate import default_models_dir, find_model
from harness.description.model import RobotModel
from harness.description.model import load_model as load_folder
from harness.description.urdf import Urdf
from harness.description.urdf_lint import check
from harness.difference import differences
from harness.difference import identify as identifying
from harness.difference.operands import Operand, named_after, only_leaf
from harness.difference.reading import Description, Ends, operand_of, urdf_named
from harness.difference.result import Difference
from harness.engines.registry import REFERENCE
from harness.errors import InputError
from harness.rendering import files
from harness.rendering.index import to_stderr
from harness.report.document import Report
from harness.report.json_file import read_report as read_document
from harness.run.checkpoint import Checkpoints
from harness.run.options import Options
from harness.run.streaming import Progress
from harness.verdict import crosscheck as verdict
from harness.verdict.accepted import AcceptedNumbers, read_accepted

T = TypeVar("T")
Each: TypeAlias = "T | tuple[T, T]"  # one value for both operands, or one for each


def load_model(robot: str | Path, *, models: str | Path | None = None) -> RobotModel:
    """Read and validate a robot model.

    robot: a name, or the folder with its model.toml.
    models: the folder in which names are looked up; None: the models that come with the package.

    Raises InputError (a file is wrong) or DescriptionUnavailable (the package that holds its URDF is not installed).
    """
    if isinstance(robot, Path):
        return load_folder(robot)
    _check_text(robot, "a name or a folder")
    return load_folder(find_model(robot, Path(models or default_models_dir())))


def _check_text(value: object, expected: str) -> None:
    """Raise InputError for what is neither text nor a path."""
    if not isinstance(value, str | Path):
        raise InputError(f"expected {expected}, got {type(value).__name__}")


class Session:
    """Cross-checks one robot after the other and keeps the engines running in between: `with Session(options) as session:`."""

    def __init__(self, options: Options | None = None, *, checkpoints: str | Path | None = None) -> None:
        """Start nothing yet.

        options: what is asked; None: the defaults.
        checkpoints: a folder in which a long run keeps how far it has come. If the session is interrupted, one with the same
            inputs continues there. One that ends removes what it has kept. None: nothing is kept.
        """
        self.options = _options(options)
        self._pool = self.options.worker_pool()
        self._checkpoints = None if checkpoints is None else Checkpoints(Path(checkpoints), to_stderr)

    def __enter__(self) -> Session:
        self._pool.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._pool.__exit__(kind, error, trace)
        if self._checkpoints is not None and error is None:
            self._checkpoints.remove()

    def crosscheck(
        self, model: RobotModel | str | Path, *, progress: Progress | None = None, options: Options | None = None
    ) -> Report:
        """Cross-check one robot model.

        model: a `RobotModel`, or what `load_model` takes.
        progress: called as `progress(done, total)` after each block of configurations.
        options: for this robot, instead of the session's; limits and jobs stay those of the session.

        Raises InputError. A missing or failing engine is part of the report.
        """
        model = model if isinstance(model, RobotModel) else load_model(model)
        options = options or self.options
        return verdict.crosscheck(model, options, progress, self._pool, _on_file(model, options), self._checkpoints)


def _options(given: Options | None) -> Options:
    """The options, or those that nothing was said of. Raises InputError for another type."""
    if given is not None and not isinstance(given, Options):
        raise InputError(f"expected harness.Options, got {type(given).__name__}", key="options")
    return given or Options()


def _on_file(model: RobotModel, options: Options) -> AcceptedNumbers | None:
    """The accepted numbers, before any work is done. Raises InputError if they are wrong, or not there in a strict run."""
    if options.accepted is None:
        if options.strict:
            raise InputError("expected the folder of accepted numbers for a strict run", key="accepted")
        return None
    path = options.accepted / f"{model.name}.json"
    return read_accepted(path) if options.strict or path.exists() else None


def crosscheck(
    model: RobotModel | str | Path,
    *,
    sources: str | Sequence[str] = (),
    samples: int = Options.samples,
    seed: int = Options.seed,
    reference: str = REFERENCE,
    certify: bool = True,
    explain: bool = True,
    options: Options | None = None,
) -> Report:
    """Cross-check a robot model: its DH table against its URDF in every source, at every mapped frame.

    model: a `RobotModel`, a name that comes with the package, or a folder.
    sources: the sources to compare, such as `urdf:pinocchio`, one or several; empty: those of model.toml.
    samples: random configurations, besides the fixed ones.
    seed: their seed.
    reference: the source that the others are compared with.
    certify: prove how far the table and the URDF can be apart, and test each engine against its own description.
    explain: look for the cause of each disagreement.
    options: everything else that can be asked; the arguments above then take the place of its fields.

    Raises InputError for wrong input. A missing or failing engine is part of the report.
    """
    asked = replace(
        _options(options),
        sources=(sources,) if isinstance(sources, str) else tuple(sources),
        samples=samples,
        seed=seed,
        reference=reference,
        certify=certify,
        explain=explain,
    )
    with Session(asked) as session:
        return session.crosscheck(model)


def diff(
    a: Description,
    b: Description,
    *,
    base: Each[str | None] = None,
    tip: Each[str | None] = None,
    convention: Each[Convention] = "standard",
    tolerance: float = 1e-6,
    models: str | Path | None = None,
) -> Difference:
    """Whether two mechanisms are the same from base to tip, and why not.

    a, b: each a name of a robot model, the path of a DH CSV or a URDF, `PACKAGE:FILE.urdf`, `roboticstoolbox:NAME`, the text
        of a URDF or a CSV, a `DHTable`, a `RobotModel`, or rows (n, 4) of a [m], alpha [rad], d [m], theta [rad].
    base, tip: links of a URDF between which it is compared, default the root and the only leaf; a pair: of a, then of b.
    convention: DH convention of a CSV or of rows; a pair likewise.
    tolerance: what counts as the same [m, rad].
    models: folder of robot models; None: those that come with the package.

    Raises InputError if one cannot be read, or if they do not have the same number and kinds of joints.
    """
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"expected a tolerance above 0 and finite, got {tolerance!r}", key="tolerance")
    folder = Path(models or default_models_dir())
    bases, tips = _each(base), _each(tip)
    conventions: tuple[Convention, Convention] = _each(convention)
    one = operand_of(a, "A", folder, Ends(bases[0], tips[0], conventions[0]))
    other = operand_of(b, "B", folder, Ends(bases[1], tips[1], conventions[1]))
    one, other = _with_names(a, one, b, other)
    return differences.diff(one, other, (tolerance, tolerance))


def _each(value: Each[T]) -> tuple[T, T]:
    """The value for a and that for b. Raises InputError for a tuple of another length."""
    if not isinstance(value, tuple):
        return value, value
    if len(value) != 2:
        raise InputError(f"expected one value, or one for a and one for b, got {len(value)}")
    return value


def _with_names(a: Description, one: Operand, b: Description, other: Operand) -> tuple[Operand, Operand]:
    """Rows of an array have no joint names: they get those of the other operand."""
    if not isinstance(a, str | Path | DHTable | RobotModel | Urdf):
        return named_after(one, other), other
    if not isinstance(b, str | Path | DHTable | RobotModel | Urdf):
        return one, named_after(other, one)
    return one, other


def identify(
    mechanism: Description,
    *,
    base: str | None = None,
    tip: str | None = None,
    convention: Convention = "standard",
    models: str | Path | None = None,
) -> identifying.Identification:
    """Which known DH table a mechanism is, whatever its base, tool, joint signs and zero offsets.

    mechanism, base, tip, convention, models: as for `diff`.

    Raises InputError if it cannot be read, or has no DH table.
    """
    folder = Path(models or default_models_dir())
    return identifying.identify(operand_of(mechanism, "the mechanism", folder, Ends(base, tip, convention)), folder)


def derive_dh(
    urdf: str | Path | Urdf,
    *,
    base: str | None = None,
    tip: str | None = None,
    convention: Convention = "standard",
    source: str = "urdf:pinocchio",
) -> Derived:
    """The DH table of a chain in a URDF, from its placements alone.

    urdf: a path, `PACKAGE:FILE.urdf`, the text of a URDF, or a `Urdf`.
    base, tip: links the chain runs between; None: the root, the only leaf.
    convention: DH convention of the table.
    source: the engine whose placements are believed.

    Raises InputError (among them UrdfError if there is no such table) or EngineUnavailable.
    """
    check_convention(convention)
    if isinstance(urdf, Urdf):
        read = urdf
    else:
        _check_text(urdf, "a path, PACKAGE:FILE.urdf, the text of a URDF or a Urdf")
        read = urdf_named(str(urdf))
    check(read)
    return derive(read, base or read.roots[0], tip or only_leaf(read), convention, source)


def read_report(path: str | Path) -> Report:
    """Read a report's JSON. Raises InputError if it is none, or one of another version."""
    _check_text(path, "the path of a report's JSON")
    return read_document(Path(path))


def write_report(report: Report, folder: str | Path) -> list[Path]:
    """Write JSON, HTML, Markdown and JUnit of a report into a folder, which is made. Raises InputError."""
    if not isinstance(report, Report):
        raise InputError(f"expected a Report, got {type(report).__name__}")
    files.prepare(Path(folder))
    return files.write_report(report, Path(folder))
