"""What a description can hold: larger numbers and longer texts are refused in one line that names file and key."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.description.locate import packaged_file
from harness.description.model import load_model
from harness.description.values import (
    LARGEST_ANGLE,
    LARGEST_LENGTH,
    LARGEST_NUMBER,
    parse_number,
    shown,
)
from harness.errors import CrosscheckError, InputError

BEYOND_FLOAT = "1" + "0" * 309
BEYOND_PYTHON = "9" * 5000


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("largest", "unit"), [(LARGEST_LENGTH, "m"), (LARGEST_ANGLE, "rad"), (LARGEST_NUMBER, "")])
def test_the_limit_itself_is_accepted(largest: float, unit: str, sign: int) -> None:
    assert parse_number(sign * largest, largest, unit) == sign * largest
    assert parse_number(str(sign * largest), largest, unit) == sign * largest
    with pytest.raises(ValueError, match=rf"expected at most 1e\+0\d {unit}.*in size, got -?1000000"):
        parse_number(sign * math.nextafter(largest, math.inf), largest, unit)


@pytest.mark.parametrize(
    "value",
    [10**309, -(10**309), 10**5000, "1e300", "1e999", "9" * 400, "9" * 5000, f"{'9' * 5000}*pi", f"{'9' * 400}*pi/3", [10**5000]],
    ids=lambda value: shown(value)[:20],
)
def test_numbers_that_no_description_can_hold(value: object) -> None:
    with pytest.raises(ValueError, match="expected") as refused:
        parse_number(value)
    assert len(str(refused.value)) < 200


@given(st.integers() | st.text() | st.floats() | st.lists(st.integers()) | st.integers(-5000, 5000).map(lambda n: 7 ** abs(n)))
def test_a_value_in_a_message_is_short(value: object) -> None:
    assert len(shown(value)) < 100


def test_short_values_are_shown_as_they_are() -> None:
    assert shown("nan") == "'nan'"
    assert shown(-3) == "-3"
    assert shown(10**300) == "an integer of about 301 digits"
    assert shown("x" * 100).endswith("... (102 characters)")


MODEL, FRAMES, CONFIGURATIONS = "model.toml", "frames.toml", "configurations.toml"


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        (MODEL, "position =", f"position = {BEYOND_FLOAT} #", r"position: expected at most 1e\+09 m in size, got an integer of"),
        (MODEL, "position =", f"position = {BEYOND_PYTHON} #", r"model.toml:\d+: expected numbers of at most 1000 digits"),
        (MODEL, "position =", f"position = 0x{'f' * 6000} #", r"tolerance.position: expected .* integer of about 7225 digits"),
        (MODEL, "position =", "position = 1e300 #", r"tolerance.position: expected at most 1e\+09 m in size, got 1e\+300"),
        (MODEL, "rotation =", "rotation = 1e7 #", r"tolerance.rotation: expected at most 1e\+06 rad in size"),
        (MODEL, "[tolerance]", "[base]\nxyz = [0, 0, 2e9]\n[tolerance]", r"base.xyz\[2\]: expected at most 1e\+09 m"),
        (MODEL, "[tolerance]", "[base]\nrpy = ['9999999*pi', 0, 0]\n[tolerance]", r"base.rpy\[0\]: expected at most 1e\+06 rad"),
        (MODEL, "name =", f"name = '{'x' * 5000}' #", r"model.toml: name: .*at most 128 characters, got 'xxx.*5002 characters"),
        (MODEL, "name =", 'name = "a/b" #', "model.toml: name: "),
        (MODEL, "name =", 'name = "a\\u0000" #', "model.toml: name: "),
        (MODEL, "description =", 'description = "a\\u0000" #', "description: expected a text without NUL characters"),
        (MODEL, "[urdf]", '[urdf]\npackage = ""', "urdf.package: string should match pattern"),
        (MODEL, "[urdf]", f"[urdf]\npackage = '{'p' * 5000}'", "urdf.package: string should have at most 200 characters"),
        (MODEL, "[urdf]", '[urdf]\npackage = "../x"', "urdf.package: string should match pattern"),
        (MODEL, "file =", 'file = "a\\u0000.urdf" #', "urdf.file: expected a text without NUL characters"),
        (MODEL, "[[source]]", f"[[source]]\nrequired = 0x{'f' * 6000}\n#", "required: .*integer of about 7225 digits"),
        (FRAMES, "dh = 0", f"dh = 0x{'f' * 6000}", r"frame\[0\].dh.*: expected base, a small number, or tool, got an integer of"),
        (FRAMES, "[[frame]]\n", '[[frame]]\nof = "a\\u0000"\n', r"frame\[0\].of: expected a text without NUL"),
        (CONFIGURATIONS, "q = [", "q = [1e300, ", r"q\[0\]: expected at most 1e\+09 in size, got 1e\+300"),
        (CONFIGURATIONS, "q = [", f"q = [{BEYOND_FLOAT}, ", r"q\[0\]: expected at most 1e\+09 in size"),
        ("dh.csv", None, "joint,a,alpha,d\nx,1e10,0,0\n", r"dh.csv:2: column 'a': expected at most 1e\+09 m in size, got '1e10'"),
        ("dh.csv", None, "joint,a,alpha,d\nx,0,1e300,0\n", r"dh.csv:2: column 'alpha': expected at most 1e\+06 rad in size"),
        ("dh.csv", None, "joint,a,alpha,d\nx,0,0,1e155\n", r"dh.csv:2: column 'd': expected at most 1e\+09 m in size"),
        ("dh.csv", None, f"joint,a,alpha,d\nx,0,{BEYOND_PYTHON}*pi,0\n", r"dh.csv:2: column 'alpha': expected a number of"),
        ("dh.csv", None, f"joint,a,alpha,d\nx,0,0,{BEYOND_PYTHON}\n", r"dh.csv:2: column 'd': expected a number of at most"),
        ("dh.csv", None, f"joint,a,alpha,d\n{'x' * 5000},0,0,0\n", r"dh.csv:2: column 'joint': expected at most 1000 characters"),
    ],
)  # fmt: skip
def test_what_no_model_can_hold(copy_model: Callable[..., Path], file: str, old: str | None, new: str, message: str) -> None:
    folder = copy_model("sixr")
    path = folder / file
    text = path.read_text()
    assert old is None or old in text
    path.write_text(new if old is None else text.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as refused:
        load_model(folder)
    assert str(path) in str(refused.value)
    assert len(str(refused.value)) < len(str(path)) + 300
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("unit", "value"), [("rad", "2e6"), ("deg", "6e7")])
def test_angles_whose_unit_another_key_tells(copy_model: Callable[..., Path], unit: str, value: str) -> None:
    entry = f'[[configuration]]\nname = "x"\nunit = "{unit}"\nq = [{value}, 0, 0, 0, 0, 0]\n'
    with pytest.raises(InputError, match=r"configuration\[0\].q\[0\]: expected at most 1e\+06 rad in size"):
        load_model(copy_model("sixr", (CONFIGURATIONS, "", entry)))


def test_the_zero_of_a_joint_is_an_angle(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("sixr")
    joint = load_model(folder).table.joints[0]
    with (folder / FRAMES).open("a") as file:
        file.write(f"\n[joints.{joint}]\noffset = 1e7\n")
    with pytest.raises(InputError, match=rf"joints.{joint}.offset: expected at most 1e\+06 rad in size"):
        load_model(folder)


def test_degrees_have_the_limit_of_radians(copy_model: Callable[..., Path]) -> None:
    entry = '[[configuration]]\nname = "x"\nunit = "deg"\nq = [5e7, 0, 0, 0, 0, 0]\n'
    assert load_model(copy_model("sixr", (CONFIGURATIONS, "", entry))).configurations.fixed[1].q[0] == math.radians(5e7)


def test_joint_limits_that_mean_none_are_no_error(copy_model: Callable[..., Path]) -> None:
    limits = "[random]\nlimits = { joint_1 = [-999999, 999999] }\n"
    folder = copy_model("sixr")
    names = load_model(folder).table.joints
    (folder / CONFIGURATIONS).write_text(limits.replace("joint_1", names[0]))
    assert load_model(folder).configurations.upper[0] == 999999.0


def test_a_package_without_a_name() -> None:
    with pytest.raises(CrosscheckError, match="expected the name of an installed package, got ''"):
        packaged_file("", "x.urdf")
