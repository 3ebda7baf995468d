from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.description.configurations import ConfigurationSet
from harness.description.model import RobotModel, load_model
from harness.errors import ModelFileError

UNIT = ConfigurationSet((), np.array([-1.0, 0.0, 5.0]), np.array([1.0, 0.5, 6.0]), (True, True, False))


@given(st.integers(0, 2**64 - 1), st.integers(0, 5000), st.integers(0, 3000), st.integers(0, 3000))
def test_any_configuration_is_regenerated_from_seed_and_index(seed: int, start: int, count: int, cut: int) -> None:
    whole = UNIT.random(seed, start, count)
    cut = min(cut, count)
    assert np.array_equal(whole, np.concatenate([UNIT.random(seed, start, cut), UNIT.random(seed, start + cut, count - cut)]))
    assert whole.shape == (count, 3)
    assert (whole >= UNIT.lower).all()
    assert (whole <= UNIT.upper).all()


def test_the_stream_is_pinned() -> None:
    """These numbers are part of every report's reproducibility: they must never change."""
    expected = [
        [-0.9769064914273369, 0.12077459828135906, 5.111425855514939],
        [0.12882924321426747, 0.2511898021367527, 5.277605576884554],
    ]
    got = UNIT.random(0, 0, 2)
    assert got.shape == (2, 3)
    assert got == pytest.approx(np.array(expected), abs=1e-15)


def test_seeds_differ_and_the_range_is_covered() -> None:
    q = UNIT.random(1, 0, 20_000)
    assert not np.array_equal(q, UNIT.random(2, 0, 20_000))
    assert q.mean(axis=0) == pytest.approx([0.0, 0.25, 5.5], abs=0.02)
    assert q.min(axis=0) == pytest.approx(UNIT.lower, abs=1e-3)
    assert q.max(axis=0) == pytest.approx(UNIT.upper, abs=1e-3)
    assert len(np.unique(q[:, 0])) == len(q)


def test_fixed_ones(models: dict[str, RobotModel]) -> None:
    configurations = models["stanford"].configurations
    names = [c.name for c in configurations.fixed]
    assert names[:2] == ["zero", "reaching"]
    assert {"joint1 +90 deg", "joint1 -90 deg", "joint3 +0 m", "joint3 +1.5 m"} <= set(names)
    reaching = configurations.fixed[1].q
    assert reaching == pytest.approx([*np.deg2rad([20, -35]), 0.6, *np.deg2rad([50, -70, 15])])  # metres stay metres
    single = configurations.fixed_q[names.index("joint2 -90 deg")]
    assert single == pytest.approx([0, -np.pi / 2, 0, 0, 0, 0])


def test_blocks_run_through_fixed_and_random_ones(models: dict[str, RobotModel]) -> None:
    model = models["ur5"]
    k = len(model.configurations.fixed)
    block = model.configurations.block(7, k - 2, k + 3)
    assert np.array_equal(block, np.concatenate([model.configurations.fixed_q[-2:], model.configurations.random(7, 0, 3)]))
    assert model.configurations.label(k + 2) == "random[2]"
    assert np.array_equal(model.configurations.one(7, k + 1), model.configurations.random(7, 1, 1)[0])


def test_declared_ranges_replace_the_urdf_limits(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur5")
    with (folder / "configurations.toml").open("a") as file:
        file.write('[random.limits]\nelbow_joint = ["-pi/2", 0.5]\n')
    configurations = load_model(folder).configurations
    assert (configurations.lower[2], configurations.upper[2]) == (-np.pi / 2, 0.5)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ("elbow = [0, 1]", "no joint 'elbow'; did you mean 'elbow_joint'"),
        ("elbow_joint = [1, 0]", r"expected \[lower, upper\] with lower < upper"),
        ("elbow_joint = [0]", r"expected \[lower, upper\]"),
        ("elbow_joint = [0, nan]", "expected a finite number"),
    ],
)
def test_wrong_ranges(copy_model: Callable[..., Path], limits: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "configurations.toml").open("a") as file:
        file.write(f"[random.limits]\n{limits}\n")
    with pytest.raises(ModelFileError, match=message):
        load_model(folder)


@given(st.lists(st.integers(-2, 2), min_size=7, max_size=7).filter(lambda k: 0 < sum(map(abs, k)) <= 6))
def test_the_lattice_averages_out_every_low_harmonic(k: list[int]) -> None:
    """What rigid offsets are averaged over: no harmonic of total degree 6 or less leaves anything behind."""
    q = ConfigurationSet((), np.zeros(7), np.ones(7), (True,) * 7).lattice()
    assert abs(np.exp(1j * (q @ np.array(k))).mean()) < 1e-12


def test_the_lattice_stays_within_the_range_of_prismatic_joints() -> None:
    q = UNIT.lattice()
    assert q.shape == (1021, 3)
    assert (q[:, 2].min(), q[:, 2].max()) == (5.0, pytest.approx(6.0, abs=1e-3))
    assert q[:, 0].max() > 6.2  # FK has no limits: a whole turn, whatever the limits are
