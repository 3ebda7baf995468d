"""What a view shows: the sources at one configuration, and the configurations worth seeing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from harness.description.locate import packaged_file
from harness.description.model import RobotModel, load_model
from harness.engines.dh_numpy import DHNumpy
from harness.errors import DescriptionUnavailable, EngineFailed
from harness.kinematics.singular import SINGULAR, jacobian, singular, smallest
from harness.run.binding import bind
from harness.run.options import Options
from harness.se3 import Array
from harness.view.meshes import mesh_path
from harness.view.page import table
from harness.view.scene import quaternion
from harness.view.session import Session
from harness.workers.pool import Workers
from tests.helpers import copied, transforms

FAST = Options(samples=50, seed=0, sources=("dh:pinocchio", "urdf:pinocchio"), certify=False, explain=False)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    folder = copied(tmp_path_factory.mktemp("view"), "ur5", ("dh.csv", "0.089159", "0.089460"))
    with FAST.worker_pool() as workers:
        yield Session(load_model(folder), FAST, workers)


def tip_of(model: RobotModel) -> Callable[[Array], Array]:
    bound = bind(DHNumpy(model.table), model, {})
    return lambda q: bound.mapped(q)[len(model.frames.frames) - 1]


@given(transforms)
def test_a_quaternion_is_its_rotation(T: Array) -> None:
    w, x, y, z = quaternion(T[:3, :3])
    R = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    np.testing.assert_allclose(R, T[:3, :3], atol=1e-12)


def test_the_jacobian_moves_the_tip_as_a_step_does(models: dict[str, RobotModel]) -> None:
    model = models["panda"]
    tip, rng = tip_of(model), np.random.default_rng(1)
    q = rng.uniform(model.configurations.lower, model.configurations.upper, (20, 7))
    dq = 1e-4 * rng.standard_normal((20, 7))
    J = jacobian(tip, q, 1.0)
    T_a, T_b = tip(q), tip(q + dq)
    moved = np.einsum("nji,nj->ni", T_a[:, :3, :3], T_b[:, :3, 3] - T_a[:, :3, 3])
    np.testing.assert_allclose(np.einsum("nij,nj->ni", J, dq)[:, :3], moved, atol=1e-7)
    D = np.swapaxes(T_a[:, :3, :3], 1, 2) @ T_b[:, :3, :3]
    turned = 0.5 * np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], axis=1)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", J, dq)[:, 3:], turned, atol=1e-7)


def test_singular_configurations_are_singular_and_a_known_one_is_seen(models: dict[str, RobotModel]) -> None:
    model, law = models["ur5"], models["ur5"].configurations
    tip = tip_of(model)
    found = singular(tip, law.lattice()[:512], law.lower, law.upper, 1.0)
    assert found
    for q, value in found:
        assert value < SINGULAR
        assert smallest(tip, q[None, :], 1.0)[0] == pytest.approx(value)
        assert (q >= law.lower).all()
        assert (q <= law.upper).all()
    # The wrist of a UR arm is singular where its fifth joint is at zero (Hawkins 2013), the elbow where the arm is stretched.
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.0, 0.5])
    assert smallest(tip, q[None, :], 1.0)[0] < 1e-8
    assert smallest(tip, (q + 0.3)[None, :], 1.0)[0] > 1e-2


def test_what_is_shown_is_what_is_compared(session: Session) -> None:
    assert session.sources == ["dh:numpy", "dh:pinocchio", "urdf:pinocchio"]
    assert session.frames[0] == "base"
    assert session.frames[-1] == "ee_link"
    rows = {(row.source, row.frame): row for row in session.apart(session.placements(np.zeros(6)))}
    assert rows["urdf:pinocchio", "tool0"].position == pytest.approx(3.01e-4, abs=1e-9)
    assert not rows["urdf:pinocchio", "tool0"].within
    assert rows["dh:pinocchio", "tool0"].within
    assert rows["urdf:pinocchio", "base"].within
    page = table(session.reference, session.sources[1:], session.absent, np.zeros(6), list(rows.values()))
    assert "✗ 0.301 mm" in page
    assert "outside tolerance: urdf:pinocchio" in page


def test_places_are_the_published_the_worst_and_the_singular(session: Session) -> None:
    kinds = [place.kind for place in session.places]
    assert kinds.count("worst") == 2
    assert {"published", "fixed", "singular"} <= set(kinds)
    worst = next(place for place in session.places if place.name.startswith("urdf:pinocchio at"))
    rows = [row for row in session.apart(session.placements(worst.q)) if row.source == "urdf:pinocchio"]
    assert max(row.position for row in rows) == pytest.approx(3.01e-4, abs=1e-9)


def test_a_source_that_fails_later_is_left_out(models: dict[str, RobotModel]) -> None:
    with Options(
        samples=10, seed=0, sources=("dh:pinocchio",), certify=False, explain=False, in_process=True
    ).worker_pool() as workers:
        session = Session(
            models["sixr"], Options(samples=10, seed=0, sources=("dh:pinocchio",), certify=False, explain=False), workers
        )
        bound = session.run.others[0].bound
        assert bound is not None

        def broken(q: Array, frames: object) -> Array:
            raise RuntimeError("gone")

        bound.engine.placements = broken  # type: ignore[method-assign]
        assert list(session.placements(np.zeros(6))) == ["dh:numpy"]
        assert "gone" in session.absent["dh:pinocchio"]


def test_a_reference_that_does_not_run_is_told(models: dict[str, RobotModel], tmp_path: Path) -> None:
    options = Options(
        samples=10,
        seed=0,
        sources=("dh:numpy",),
        reference="missing",
        workers=(("missing", (sys.executable, str(tmp_path / "none.py"))),),
        explain=False,
    )
    with Workers() as workers, pytest.raises(EngineFailed, match="the reference does not run"):
        Session(models["sixr"], options, workers)


def test_meshes_are_found_beside_the_urdf(tmp_path: Path) -> None:
    (tmp_path / "robot" / "urdf").mkdir(parents=True)
    (tmp_path / "robot" / "meshes").mkdir()
    mesh = tmp_path / "robot" / "meshes" / "a.stl"
    mesh.write_text("")
    urdf = tmp_path / "robot" / "urdf" / "x.urdf"
    for name in ("package://robot/meshes/a.stl", "package://other/meshes/a.stl", "meshes/a.stl"):
        assert mesh_path(name, urdf) == mesh
    assert mesh_path("package://robot/meshes/b.stl", urdf) is None
    try:
        packaged = packaged_file("example-robot-data", "ur_description/urdf/ur5_robot.urdf")
    except DescriptionUnavailable:
        pytest.skip("example-robot-data is not installed")
    assert mesh_path("package://example-robot-data/robots/ur_description/meshes/ur5/visual/base.dae", packaged)


def test_without_viser_the_way_out_is_told(tmp_path: Path) -> None:
    code = "import sys; sys.modules['viser'] = None; sys.argv = ['crosscheck', 'view', 'ur5']; "
    code += "from harness.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
    assert done.returncode == 3
    assert "pip install 'fk-crosscheck[view]'" in done.stderr
    assert "Traceback" not in done.stderr
