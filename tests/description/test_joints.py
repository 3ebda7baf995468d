"""The affine map from model joints to URDF joints: sign, zero, coupling, mimic, held joints, limits."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.description.model import RobotModel, load_model
from harness.errors import ModelFileError


def mapped_values(model: RobotModel, q: list[float]) -> dict[str, float]:
    assert model.urdf_joints is not None
    joints = model.urdf_joints
    return dict(zip(joints.names, joints.values(np.array([q]), joints.names)[0], strict=True))


def test_sign_offset_coupling(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("humanoid_arm")
    with (folder / "frames.toml").open("a") as file:
        file.write('[joints.elbow_flex]\nsign = -1\noffset = "pi/2"\ncoupling = {shoulder_lift = 0.5}\n')
    values = mapped_values(load_model(folder), [0.1, 0.2, 0.3, 0.4])
    assert values == pytest.approx(
        {"shoulder_pan": 0.1, "shoulder_lift": 0.2, "elbow_flex": -0.3 + 0.1 + np.pi / 2, "wrist_flex": 0.4}
    )


def test_names_that_differ(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("humanoid_arm", ("dh.csv", "elbow_flex", "J3"), ("dh.csv", "wrist_flex", "J4"))
    with (folder / "frames.toml").open("a") as file:
        file.write('[joints]\nJ3 = "elbow_flex"\n[joints.J4]\nurdf = "wrist_flex"\n')
    assert mapped_values(load_model(folder), [0.1, 0.2, 0.3, 0.4])["elbow_flex"] == 0.3


def test_followers_get_multiplier_times_leader_plus_offset(copy_model: Callable[..., Path]) -> None:
    """The wrist follows the elbow, and a joint off the chain follows the wrist."""
    mimic = '<mimic joint="elbow_flex" multiplier="-2" offset="0.1"/><axis xyz="0 0 1"/>'
    finger = """<link name="finger"/><joint name="a_finger" type="prismatic"><parent link="gripper_link"/><child link="finger"/>
    <axis xyz="1 0 0"/><mimic joint="wrist_flex" multiplier="3"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""
    folder = copy_model("humanoid_arm", ("humanoid_arm.urdf", "</robot>", finger))
    urdf = folder.parent.parent / "urdf" / "humanoid_arm.urdf"
    head, tail = urdf.read_text().split('<joint name="wrist_flex"')
    urdf.write_text(head + '<joint name="wrist_flex"' + tail.replace('<axis xyz="0 0 1"/>', mimic, 1))
    # Row 4 no longer moves by itself: it becomes part of the chain that the elbow drives.
    (folder / "dh.csv").write_text((folder / "dh.csv").read_text().replace("wrist_flex,revolute", "wrist_flex,fixed"))
    (folder / "configurations.toml").write_text("")
    model = load_model(folder)
    assert model.urdf_joints is not None
    assert model.urdf_joints.followers == ("wrist_flex", "a_finger")
    values = mapped_values(model, [0.0, 0.0, 0.3])
    assert values["wrist_flex"] == pytest.approx(-0.5)
    assert values["a_finger"] == pytest.approx(-1.5)


def test_joints_off_the_chain_are_held_at_zero(models: dict[str, RobotModel]) -> None:
    panda = models["panda"]
    assert panda.urdf_joints is not None
    assert panda.urdf_joints.held == ("panda_finger_joint1",)
    values = mapped_values(panda, [1.0] * 7)
    assert (values["panda_finger_joint1"], values["panda_finger_joint2"], values["panda_joint7"]) == (0.0, 0.0, 1.0)


def test_an_unknown_joint_is_named(models: dict[str, RobotModel]) -> None:
    joints = models["ur5"].urdf_joints
    assert joints is not None
    with pytest.raises(KeyError, match="no joint 'elbow'; did you mean 'elbow_joint'"):
        joints.values(np.zeros((1, 6)), ("elbow",))


def test_ranges_follow_the_urdf_limits_through_sign_and_zero(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("humanoid_arm")
    urdf = folder.parent.parent / "urdf" / "humanoid_arm.urdf"
    text = urdf.read_text().replace('lower="-3.141592653589793" upper="3.141592653589793"', 'lower="-1" upper="2"')
    urdf.write_text(text)
    with (folder / "frames.toml").open("a") as file:
        file.write("[joints.elbow_flex]\nsign = -1\noffset = 0.5\n[joints.wrist_flex]\ncoupling = {elbow_flex = 1}\n")
    configurations = load_model(folder).configurations
    assert configurations.lower == pytest.approx([-1, -1, -1.5, -np.pi])  # a coupled joint has no range of its own
    assert configurations.upper == pytest.approx([2, 2, 1.5, np.pi])


@pytest.mark.parametrize(
    ("lower", "upper", "expected"),
    [
        ("-1", "2", (-1.0, 2.0)),
        ("-999999", "999999", (-999999.0, 999999.0)),  # a description can hold that
        ("-1e9", "1e9", (-np.pi, np.pi)),  # more than an angle may be: means none
        ("-1e16", "1e16", (-np.pi, np.pi)),
        ("0", "0", (-np.pi, np.pi)),
        ("2", "-1", (-np.pi, np.pi)),  # the wrong way round: the lint says so
    ],
)
def test_limits_that_mean_none_give_no_range(
    copy_model: Callable[..., Path], lower: str, upper: str, expected: tuple[float, float]
) -> None:
    folder = copy_model("humanoid_arm")
    urdf = folder.parent.parent / "urdf" / "humanoid_arm.urdf"
    written = 'lower="-3.141592653589793" upper="3.141592653589793"'
    text = urdf.read_text()
    assert written in text
    urdf.write_text(text.replace(written, f'lower="{lower}" upper="{upper}"', 1))
    configurations = load_model(folder).configurations
    assert (configurations.lower[0], configurations.upper[0]) == pytest.approx(expected)


def test_a_slide_whose_limits_mean_none_has_no_range(copy_model: Callable[..., Path]) -> None:
    """No range can be assumed for it: the model has to give one."""
    folder = copy_model("stanford")
    urdf = folder.parent.parent / "urdf" / "stanford.urdf"
    head, tail = urdf.read_text().split('type="prismatic"')
    limit = re.search(r"<limit[^>]*>", tail)
    assert limit is not None
    wide = '<limit lower="-1e10" upper="1e10" effort="1" velocity="1"/>'
    urdf.write_text(head + 'type="prismatic"' + tail.replace(limit[0], wide, 1))
    configurations = folder / "configurations.toml"
    configurations.write_text(configurations.read_text().partition("[random")[0])
    with pytest.raises(ModelFileError, match=r"prismatic joint '\w+' has no range; add \[random.limits\]"):
        load_model(folder)
