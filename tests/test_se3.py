from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness import se3
from harness.se3 import Array
from tests.helpers import assert_placements_close, transforms


@given(transforms)
def test_inverse_undoes(T: Array) -> None:
    assert_placements_close(se3.inverse(T) @ T, np.eye(4), 1e-14)
    assert_placements_close(se3.inverse(T), np.asarray(np.linalg.inv(T), dtype=np.float64), 1e-13)


@given(transforms)
def test_rpy_round_trip(T: Array) -> None:
    assert_placements_close(se3.from_xyz_rpy(tuple(T[:3, 3]), se3.to_rpy(T)), T, 1e-10)


@pytest.mark.parametrize("off", [0.0, 1e-13, 1e-11, 1e-9, 1e-6])
@pytest.mark.parametrize("sign", [1, -1])
def test_rpy_next_to_the_singular_pitch(off: float, sign: int) -> None:
    """Found by derive-dh: there roll and yaw are noise, and only what one leaves the other is accurate."""
    T = se3.from_xyz_rpy((0, 0, 0), (0.3, sign * (math.pi / 2 - off), -1.1))
    assert_placements_close(se3.from_xyz_rpy((0, 0, 0), se3.to_rpy(T)), T, 3e-11)


@given(st.floats(0.0, math.pi), st.sampled_from("xyz"), transforms)
def test_rotation_error_is_the_angle(angle: float, axis: str, T: Array) -> None:
    turned = T @ se3.rotation(axis, angle)
    # Near pi the chord is flat: the angle is known to the square root of rounding only.
    assert se3.rotation_error(T, turned) == pytest.approx(angle, abs=1e-13 if angle < 3 else 1e-7)
    assert se3.position_error(T, turned) == 0.0


@pytest.mark.parametrize("angle", [1e-14, 1e-12, 1e-9])
def test_rotation_error_resolves_what_the_trace_cannot(angle: float) -> None:
    assert se3.rotation_error(np.eye(4), se3.rotation("y", angle)) == pytest.approx(angle, rel=1e-9)


@pytest.mark.parametrize("quarters", range(-4, 5))
def test_right_angles_are_exact(quarters: int) -> None:
    s, c = se3.sincos(quarters * math.pi / 2)
    assert {abs(s), abs(c)} == {0.0, 1.0}
    assert (s, c) == pytest.approx((math.sin(quarters * math.pi / 2), math.cos(quarters * math.pi / 2)), abs=1e-15)


def test_urdf_rpy_convention() -> None:
    """R = Rz(yaw) Ry(pitch) Rx(roll), written out once."""
    roll, pitch, yaw = 0.3, -0.7, 1.9
    expected = se3.rotation("z", yaw) @ se3.rotation("y", pitch) @ se3.rotation("x", roll)
    assert_placements_close(se3.from_xyz_rpy((0, 0, 0), (roll, pitch, yaw)), expected, 1e-15)
    assert_placements_close((se3.rotation("z", math.pi / 2) @ [1, 0, 0, 1])[None], np.array([[0.0, 1.0, 0.0, 1.0]]), 0.0)
