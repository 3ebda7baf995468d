"""Comparing placements so that a failure says where, and Hypothesis strategies for tables and transforms."""

from __future__ import annotations

import functools
import math
import shutil
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from hypothesis import strategies as st
from pydantic import BaseModel

from harness import se3
from harness.description.dh import DHRow, DHTable
from harness.description.locate import default_models_dir
from harness.description.model import RobotModel
from harness.report.document import Report
from harness.run.options import Options
from harness.se3 import Array
from harness.verdict import crosscheck as module
from harness.verdict.accepted import AcceptedNumbers, since
from harness.verdict.gate import held_to
from harness.workers.pool import Workers

Edit = tuple[str, str, str]
P = TypeVar("P", bound=BaseModel)


def copied(folder: Path, robot: str, *edits: Edit) -> Path:
    """A packaged model in folder/models, its URDF beside it, edited: (file, old text, new text) or (file, "", all of it)."""
    models, urdf = folder / "models", folder / "urdf"
    shutil.copytree(default_models_dir() / robot, models / robot)
    if not urdf.exists():
        shutil.copytree(default_models_dir().parent / "urdf", urdf)
    for name, old, new in edits:
        path = urdf / name if name.endswith(".urdf") else models / robot / name
        text = path.read_text()
        assert old in text, f"{old!r} is not in {name}"
        path.write_text(text.replace(old, new) if old else new)
    return models / robot


@functools.cache
def shared_workers() -> Workers:
    """Workers that serve one test after the other, as they serve one robot after the other in a run."""
    return Workers()


def crosscheck(model: RobotModel, options: Options) -> Report:
    """`harness.verdict.crosscheck.crosscheck` without starting every engine anew."""
    return module.crosscheck(model, options, None, shared_workers())


def remade(part: P, **fields: Any) -> P:
    """A part of a document with other fields, through its constructor: what is misspelt or of another type fails."""
    return type(part)(**{**{name: getattr(part, name) for name in type(part).model_fields}, **fields})


def compared(report: Report, numbers: AcceptedNumbers, strict: bool) -> Report:
    """The report with what moved since these numbers were accepted, as a run with them on file gives it."""
    moved = since(numbers, report, strict)
    return remade(report, regression=moved, verdict=held_to(report.verdict, report.robot.name, moved))


def assert_placements_close(got: Array, expected: Array, atol: float) -> None:
    """Equal shapes, nothing that is not finite, every entry within `atol`; else names the worst entry."""
    assert got.shape == expected.shape, f"shape {got.shape}, expected {expected.shape}"
    assert np.isfinite(got).all(), f"{np.count_nonzero(~np.isfinite(got))} entries are not finite"
    assert np.isfinite(expected).all(), "the expected values are not finite"
    difference = np.abs(got - expected)
    if difference.size and difference.max() > atol:
        worst = np.unravel_index(difference.argmax(), difference.shape)
        raise AssertionError(f"entry {worst} is {got[worst]!r}, expected {expected[worst]!r}: off by {difference[worst]:.3g}")


# Right angles are what tables are made of, and where shortcuts go wrong.
angles = st.one_of(
    st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, -math.pi]),
    st.floats(-4.0, 4.0, allow_nan=False),
)
lengths = st.one_of(st.just(0.0), st.floats(-2.0, 2.0, allow_nan=False))
transforms = st.builds(se3.from_xyz_rpy, st.tuples(lengths, lengths, lengths), st.tuples(angles, angles, angles))


@st.composite
def tables(draw: st.DrawFn, max_rows: int = 6) -> DHTable:
    """Random DH tables: both conventions, all kinds of rows, base and tool transforms; at least one joint."""
    kinds = draw(st.lists(st.sampled_from(["revolute", "prismatic", "fixed"]), min_size=1, max_size=max_rows))
    if all(kind == "fixed" for kind in kinds):
        kinds[0] = "revolute"
    rows = tuple(
        DHRow(name=f"j{i}", kind=kind, a=draw(lengths), alpha=draw(angles), d=draw(lengths), theta=draw(angles))  # type: ignore[arg-type]
        for i, kind in enumerate(kinds)
    )
    return DHTable(rows, draw(st.sampled_from(["standard", "modified"])), draw(transforms), draw(transforms))


@st.composite
def tables_with_q(draw: st.DrawFn) -> tuple[DHTable, Array]:
    """A table and a batch of one to five configurations."""
    table = draw(tables())
    n, count = len(table.joints), draw(st.integers(1, 5))
    values = draw(st.lists(st.floats(-7.0, 7.0, allow_nan=False), min_size=n * count, max_size=n * count))
    return table, np.array(values).reshape(count, n)
