"""Descriptions as mechanisms of named numbers: placed as engines place them, exact derivatives, the fit of one number."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.cause import fit
from harness.description.dh import DHTable
from harness.description.model import RobotModel
from harness.engines.dh_numpy import DHNumpy
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.kinematics.descriptions import Z_AXIS, Reading, of_table
from harness.kinematics.recipes import TableRecipe, UrdfRecipe
from harness.se3 import Array, inverse
from tests.conftest import WITHOUT
from tests.helpers import assert_placements_close, tables_with_q


def labelled(table: DHTable) -> dict[str, tuple[str, Array]]:
    return {label: (label, np.eye(4)) for label in table.frames}


@given(tables_with_q())
def test_a_table_is_placed_as_the_in_house_fk_places_it(case: tuple[DHTable, Array]) -> None:
    table, q = case
    placed = TableRecipe(table, labelled(table)).mechanism.placements(q, table.frames)
    assert_placements_close(placed, DHNumpy(table).placements(q, table.frames), 1e-11)


@given(tables_with_q(), st.integers(0, 1000))
def test_twists_are_the_derivative_of_every_frame(case: tuple[DHTable, Array], pick: int) -> None:
    """Against a central difference in each parameter, gauges included."""
    table, q = case
    mechanism = of_table(table, labelled(table))
    parameter = mechanism.parameters[pick % len(mechanism.parameters)]
    names = table.frames
    T, xi, moves = mechanism.twists(q, names)
    k = mechanism.parameters.index(parameter)
    exact = fit.derivatives(T, xi[k : k + 1], moves[k : k + 1])[0]
    h = 1e-6
    ahead, behind = (mechanism.shifted({parameter: s}).placements(q, names) for s in (h, -h))
    velocity = (ahead[..., :3, 3] - behind[..., :3, 3]) / (2 * h)
    assert np.abs(exact[..., :3] - velocity).max() < 1e-7
    turned = (ahead[..., :3, :3] - behind[..., :3, :3]) / (2 * h) @ np.swapaxes(T[..., :3, :3], -1, -2)
    omega = np.stack([turned[..., 2, 1], turned[..., 0, 2], turned[..., 1, 0]], axis=-1)
    assert np.abs(exact[..., 3:] - omega).max() < 1e-7


def urdf_recipe(model: RobotModel, links: tuple[str, ...], reading: Reading | None = None) -> UrdfRecipe:
    assert model.urdf is not None
    assert model.urdf_joints is not None
    prismatic = tuple(model.table.kind(j) == "prismatic" for j in model.table.joints)
    names = {link: link for link in links}
    base = model.urdf.roots[0]
    return UrdfRecipe(
        urdf=model.urdf,
        base=base,
        frames=names,
        joints=model.urdf_joints,
        model_joints=model.table.joints,
        prismatic=prismatic,
        reading=reading or Reading(),
    )


@pytest.mark.parametrize("robot", ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur5", "ur5e"])
def test_a_urdf_is_placed_as_pinocchio_places_it(models: dict[str, RobotModel], robot: str) -> None:
    model = models[robot]
    assert model.urdf is not None
    assert model.urdf_joints is not None
    q = model.configurations.random(3, 0, 20)
    placed = urdf_recipe(model, model.urdf.links).mechanism.placements(q, model.urdf.links)
    engine = UrdfPinocchio(model.urdf)
    expected = engine.placements(model.urdf_joints.values(q, engine.joints), model.urdf.links)
    assert_placements_close(placed, expected, 1e-14)


def test_a_chain_passed_from_child_to_parent_is_the_inverse(models: dict[str, RobotModel]) -> None:
    model = models["stanford"]
    assert model.urdf is not None
    q = model.configurations.random(0, 0, 5)
    down = urdf_recipe(model, ("tip",)).mechanism.placements(q, ("tip",))
    up = replace(urdf_recipe(model, (model.urdf.roots[0],)), base="tip").mechanism.placements(q)
    assert_placements_close(up, inverse(down), 1e-14)


@pytest.mark.skipif("urdf:pytorch-kinematics" in WITHOUT, reason="declared absent")
def test_the_reading_with_z_is_that_of_pytorch_kinematics(models: dict[str, RobotModel]) -> None:
    """A joint without an axis: x as specified, and as pinocchio takes it; z there."""
    from harness.engines.urdf_pytorch_kinematics import UrdfPytorchKinematics  # noqa: PLC0415
    from harness.mutation.structure import of_axes  # noqa: PLC0415

    mutant = next(m for m in of_axes(models["ur5e"]) if m.operator == "axis left out" and "elbow" in m.name)
    assert mutant.model.urdf is not None
    assert mutant.model.urdf_joints is not None
    q = models["ur5e"].configurations.random(0, 0, 5)
    engine = UrdfPytorchKinematics(mutant.model.urdf)
    seen = engine.placements(mutant.model.urdf_joints.values(q, engine.joints), ("tool0",))
    as_z = urdf_recipe(mutant.model, ("tool0",), Reading(default_axis=Z_AXIS)).mechanism.placements(q)
    as_x = urdf_recipe(mutant.model, ("tool0",)).mechanism.placements(q)
    assert_placements_close(seen, as_z, 1e-6)
    assert np.abs(seen - as_x).max() > 0.1


@given(st.integers(0, 23), st.floats(-3.0, 3.0).filter(lambda x: abs(x) > 1e-6))
def test_one_number_is_found_whatever_its_size(models: dict[str, RobotModel], index: int, change: float) -> None:
    """Of all numbers of a UR5's rows: an angle is found globally, not only near zero."""
    table = models["ur5"].table
    mechanism = of_table(table, {"tip": ("6", np.eye(4))})
    rows = [p for p in mechanism.parameters if p.name in ("a", "alpha", "d", "theta")]
    parameter = rows[index]
    q = np.random.default_rng(0).uniform(-3, 3, (16, 6))
    wanted = mechanism.shifted({parameter: change}).placements(q)
    fits = {p: (residual, delta) for residual, p, delta in fit.each_alone(mechanism, fit.Target(q, ("tip",), wanted))}
    residual, delta = fits[parameter]
    off = math.remainder(delta - change, 2 * math.pi) if parameter.unit == "rad" else delta - change
    assert abs(off) < 1e-9
    assert residual < 1e-9
