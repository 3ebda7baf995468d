from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.description.values import find_truncation, parse_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi", math.pi),
        ("-pi", -math.pi),
        ("pi/2", math.pi / 2),
        ("-pi/2", -math.pi / 2),
        (" 3*pi/4 ", 3 * math.pi / 4),
        ("-2*pi", -2 * math.pi),
        ("0.089159", 0.089159),
        ("-1e-3", -1e-3),
        (3, 3.0),
    ],
)
def test_numbers(text: object, value: float) -> None:
    assert parse_number(text) == value


@pytest.mark.parametrize(
    "text",
    ["pi*2", "2pi", "pi/0", "pi/2.5", "sin(1)", "1+1", "", "nan", "inf", "-inf", "0x10", True, None, [1], "__import__('os')"],
)
def test_what_is_not_a_number(text: object) -> None:
    with pytest.raises(ValueError, match="expected a"):
        parse_number(text)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("1.5708", "pi/2"),
        ("1.57079632679", "pi/2"),
        ("1.570796327", "pi/2"),
        ("-3.14159265359", "-pi"),
        ("3.1416", "pi"),
        ("3.14", "pi"),
        ("0.7854", "pi/4"),
        ("1.0472", "pi/3"),
        ("2.3562", "3*pi/4"),
        ("-6.28318530718", "-2*pi"),
    ],
)
def test_pi_cut_short(text: str, exact: str) -> None:
    found = find_truncation(text)
    assert found is not None
    assert found.exact == exact
    assert found.error == pytest.approx(abs(float(text) - parse_number(exact)))


@pytest.mark.parametrize(
    "text", ["1.5707963267948966", "3.141592653589793", "0.0", "0", "1.5", "0.79", "1.2", "0.333", "-0.425", "1e-3"]
)
def test_not_pi(text: str) -> None:
    assert find_truncation(text) is None


@given(st.integers(-8, 8).filter(bool), st.sampled_from([1, 2, 3, 4, 6]), st.integers(5, 12))
def test_every_rounding_of_a_fraction_of_pi_is_recognised(times: int, over: int, places: int) -> None:
    exact = times * math.pi / over
    if abs(exact) <= 2 * math.pi:
        found = find_truncation(f"{exact:.{places}f}")
        assert found is not None
        assert parse_number(found.exact) == pytest.approx(exact, rel=1e-15)
