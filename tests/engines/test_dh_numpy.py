"""The in-house FK against the definition, against Pinocchio, and against published numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

from harness import se3
from harness.description.dh import DHRow, DHTable
from harness.description.model import RobotModel
from harness.engines import dh_numpy
from harness.engines.dh_numpy import DHNumpy
from harness.engines.dh_pinocchio import DHPinocchio
from harness.errors import nearest
from harness.se3 import Array
from tests.helpers import assert_placements_close, tables_with_q


def by_definition(table: DHTable, q: Array) -> dict[str, Array]:
    """Every frame from the product of four elementary 4x4 matrices a row, one configuration at a time."""
    values = iter(q)
    T = {"base": np.eye(4), "0": table.base}
    current = table.base
    for i, row in enumerate(table.rows, start=1):
        moved = 0.0 if row.kind == "fixed" else next(values)
        theta = row.theta + (moved if row.kind == "revolute" else 0.0)
        d = row.d + (moved if row.kind == "prismatic" else 0.0)
        screw_z = se3.rotation("z", theta) @ se3.translation((0, 0, d))
        screw_x = se3.translation((row.a, 0, 0)) @ se3.rotation("x", row.alpha)
        current = current @ (screw_x @ screw_z if table.convention == "modified" else screw_z @ screw_x)
        T[str(i)] = current
    T["tool"] = current @ table.tool
    return T


@given(tables_with_q())
def test_matches_the_definition(case: tuple[DHTable, Array]) -> None:
    table, q = case
    got = DHNumpy(table).placements(q, table.frames)
    expected = np.array([[by_definition(table, q_k)[label] for label in table.frames] for q_k in q])
    assert_placements_close(got, expected, 1e-12)


@given(tables_with_q())
def test_matches_pinocchio_built_from_the_same_table(case: tuple[DHTable, Array]) -> None:
    table, q = case
    assert_placements_close(DHNumpy(table).placements(q, table.frames), DHPinocchio(table).placements(q, table.frames), 1e-12)


def test_block_borders_do_not_show(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    model = models["stanford"]
    q = model.configurations.random(3, 0, 25)
    engine = DHNumpy(model.table)
    whole = engine.placements(q, model.table.frames)
    monkeypatch.setattr(dh_numpy, "BLOCK", 7)
    assert np.array_equal(engine.placements(q, model.table.frames), whole)
    one_by_one = np.concatenate([engine.placements(q_k[None], model.table.frames) for q_k in q])
    assert np.array_equal(one_by_one, whole)


def test_frames_in_any_order_and_twice(models: dict[str, RobotModel]) -> None:
    table = models["ur5"].table
    q = np.full((2, 6), 0.4)
    every = DHNumpy(table).placements(q, table.frames)
    some = DHNumpy(table).placements(q, ["tool", "3", "3", "base"])
    assert np.array_equal(some, every[:, [table.frames.index(x) for x in ("tool", "3", "3", "base")]])


def test_no_configurations(models: dict[str, RobotModel]) -> None:
    assert DHNumpy(models["ur5"].table).placements(np.empty((0, 6)), ["6"]).shape == (0, 1, 4, 4)


def test_a_large_offset_is_not_rounded_into_q() -> None:
    """theta + q is formed on the circle: an offset of pi/2 stays exact for every q."""
    table = DHTable((DHRow(name="j", kind="revolute", a=1.0, alpha=0.0, d=0.0, theta=math.pi / 2),))
    q = np.linspace(-6, 6, 13)[:, None]
    got = DHNumpy(table).placements(q, ["1"])[:, 0, :2, 3]
    assert np.abs(got - np.column_stack([-np.sin(q[:, 0]), np.cos(q[:, 0])])).max() == 0.0


@pytest.mark.parametrize("shape", [(3,), (2, 5), (2, 7), (1, 1, 6)])
def test_q_of_the_wrong_shape(models: dict[str, RobotModel], shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"expected q of shape \(N, 6\)"):
        DHNumpy(models["ur5"].table).placements(np.zeros(shape), ["6"])


def test_unknown_frame(models: dict[str, RobotModel]) -> None:
    with pytest.raises(KeyError, match="has no frame '7'"):
        DHNumpy(models["ur5"].table).placements(np.zeros((1, 6)), ["7"])
    assert nearest("tol", ["tool", "base"]) == "did you mean 'tool'?"
