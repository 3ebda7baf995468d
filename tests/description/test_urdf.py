"""Reading URDFs: what is refused, what is kept as written, what the lint says."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from harness.description.urdf import Urdf
from harness.description.urdf_file import MAX_LINKS, parse_urdf, read_urdf
from harness.description.urdf_lint import check, lint
from harness.errors import InputError, UrdfError

HERE = Path("arm.urdf")


def robot(body: str) -> bytes:
    return f"<robot name='r'>{body}</robot>".encode()


def joint(name: str, parent: str, child: str, inside: str = "", kind: str = "revolute", axis: str = "0 0 1") -> str:
    axis_text = f"<axis xyz='{axis}'/>" if axis else ""
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{axis_text}{inside}"
        "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
    )


def links(*names: str) -> str:
    return "".join(f"<link name='{name}'/>" for name in names)


BOMB = b"""<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
<!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;"><!ENTITY e "&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;">
<!ENTITY f "&e;&e;&e;&e;&e;&e;&e;&e;&e;&e;"><!ENTITY g "&f;&f;&f;&f;&f;&f;&f;&f;&f;&f;">
]><robot name="&g;"><link name="a"/></robot>"""
EXTERNAL = b"""<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r"><link name="a">&x;</link></robot>"""
EXTERNAL_DTD = b"""<!DOCTYPE robot SYSTEM "http://localhost:9/x.dtd"><robot name="r"><link name="a"/></robot>"""


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not well-formed XML"),
        (b"<robot><link name='a'></robot>", r"arm.urdf:1: not well-formed XML"),
        (b"\x00\x01", "not well-formed XML"),
        (BOMB, "entity"),
        (EXTERNAL, "document type or entity declaration is not allowed"),
        (EXTERNAL_DTD, "document type or entity declaration is not allowed"),
        (b"<sdf/>", "expected the root element <robot>, got <sdf>"),
        (b"<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:arm/></robot>", "xacro, not URDF; expand it first"),
        (robot(""), "expected at least one <link>"),
        (robot("<link/>"), "<link> has no attribute 'name'"),
        (robot(links("a", "b") + joint("j", "a", "b", kind="revolut")), r"unknown type 'revolut'; did you mean 'revolute'\?"),
        (robot(links("a") + "<joint name='j' type='fixed'><parent link='a'/></joint>"), "joint 'j' has no <child>"),
        (robot(links("a", "b") + joint("j", "a", "b", axis="0 0 nan")), "expected 3 finite numbers in xyz, got '0 0 nan'"),
        (robot(links("a", "b") + joint("j", "a", "b", axis="0 0")), "expected 3 finite numbers in xyz, got '0 0'"),
        (robot(links("a", "b") + joint("j", "a", "b", "<origin xyz='0 0 inf'/>")), "expected 3 finite numbers in xyz"),
        (robot(links("a", "b") + joint("j", "a", "b", "<origin rpy='a b c'/>")), "expected 3 finite numbers in rpy"),
        (robot(links("a", "b") + joint("j", "a", "b", "<mimic joint='k' multiplier='x'/>")), "expected a finite number"),
        (robot("".join(links(f"l{i}") for i in range(10_000))), f"expected at most {MAX_LINKS} links"),
        (robot("<a>" * 10_000 + "</a>" * 10_000), "not well-formed XML"),
    ],
)
def test_refused_in_one_line(data: bytes, message: str) -> None:
    with pytest.raises(UrdfError, match=message) as caught:
        parse_urdf(data, HERE)
    assert "\n" not in str(caught.value)
    assert "root:" not in str(caught.value)


def test_a_file_too_large_or_absent(tmp_path: Path) -> None:
    with pytest.raises(UrdfError, match="no such file"):
        read_urdf(tmp_path / "arm.urdf")
    with pytest.raises(UrdfError, match="expected a file, got a folder"):
        read_urdf(tmp_path)
    large = tmp_path / "large.urdf"
    with large.open("wb") as file:
        file.truncate(40_000_000)
    with pytest.raises(UrdfError, match="expected at most 32000000 bytes"):
        read_urdf(large)


def codes(body: str) -> list[str]:
    return [f.code for f in lint(parse_urdf(robot(body), HERE))]


@pytest.mark.parametrize(
    ("body", "code", "level"),
    [
        (links("a", "b") + joint("j", "a", "b", axis=""), "missing-axis", "warning"),
        (links("a", "b") + joint("j", "a", "b", axis="0 0 2"), "unnormalised-axis", "warning"),
        (links("a", "b") + joint("j", "a", "b", axis="0 0 0"), "zero-axis", "error"),
        (links("a", "b") + joint("j", "a", "b", axis="0 1e-16 1"), "oblique-axis", "note"),
        (links("a", "b") + joint("j", "a", "b", "<origin rpy='0 1.5708 0'/>"), "truncated-pi", "note"),
        (links("a", "b", "c") + joint("j", "a", "b") + joint("k", "b", "c", "<mimic joint='j'/>"), "mimic", "warning"),
        (links("a", "b") + joint("j", "a", "b", "<mimic joint='z'/>"), "unknown-mimic", "warning"),
        (links("a", "b") + joint("j", "a", "b", "<mimic joint='j'/>"), "mimic-cycle", "error"),
        (links("a", "a", "b") + joint("j", "a", "b"), "duplicate-link", "error"),
        (links("a", "b", "c") + joint("j", "a", "b") + joint("j", "b", "c"), "duplicate-joint", "error"),
        (links("a", "b", "c") + joint("j", "a", "c") + joint("k", "b", "c"), "two-parents", "error"),
        (links("a", "b", "c") + joint("i", "b", "c") + joint("j", "c", "b"), "cycle", "error"),
        (links("a", "b") + joint("j", "a", "b") + joint("k", "b", "a"), "cycle", "error"),
        (links("a", "b", "c") + joint("j", "a", "b"), "unreachable-link", "error"),
        (links("a", "b") + joint("j", "a", "bb"), "unknown-link", "error"),
        (links("a", "b") + joint("j", "a", "b", kind="floating"), "unsupported-joint", "warning"),
        (
            links(*(f"l{i}" for i in range(1200))) + "".join(joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(1199)),
            "too-deep",
            "error",
        ),
    ],
)
def test_lint_finds(body: str, code: str, level: str) -> None:
    urdf = parse_urdf(robot(body), HERE)
    assert (code, level) in [(f.code, f.level) for f in lint(urdf)]
    if level == "error":
        with pytest.raises(UrdfError, match=r"arm\.urdf(:[1-9]\d*)?: "):
            check(urdf)
    else:
        assert code in [f.code for f in check(urdf)]


def test_a_clean_file_has_no_findings() -> None:
    exact = "<origin xyz='0 0.785 1.57' rpy='0 1.5707963267948966 -3.141592653589793'/>"
    assert (
        codes(links("a", "b", "c") + joint("j", "a", "b", exact, axis="-1 0 0") + joint("k", "b", "c", kind="fixed", axis=""))
        == []
    )


def test_text_for_engines_keeps_what_has_meaning_and_nothing_else() -> None:
    body = """<material name='m'/><link name='a'><visual><geometry><mesh filename='package://x/y.stl'/></geometry></visual>
    <inertial><mass value='1'/></inertial></link><link name='b'/><link name='c'/>
    <joint name='j' type='continuous'><origin xyz=' 1  2 3' rpy='0 0 1.5708'/><parent link='a'/><child link='b'/>
    <dynamics damping='1'/><safety_controller k_velocity='1'/></joint>
    <joint name='k' type='prismatic'><parent link='b'/><child link='c'/><axis xyz='0 0 2'/>
    <mimic joint='j' multiplier='-0.5' offset='.1'/><limit effort='1' velocity='1' lower='0' upper='1'/></joint>
    <gazebo/><transmission name='t'/>"""
    text = parse_urdf(robot(body), HERE).text
    for kept in ('xyz=" 1  2 3"', "1.5708", 'xyz="0 0 2"', 'multiplier="-0.5"', 'offset=".1"', 'upper="1"'):
        assert kept in text
    for gone in ("mesh", "package://", "inertial", "dynamics", "gazebo", "transmission", "material", "safety"):
        assert gone not in text
    assert text.count("<axis") == 1
    again = parse_urdf(text.encode(), HERE)
    assert again.text == text
    assert list(again.joints) == ["j", "k"]


def packaged_urdfs() -> list[Path]:
    files = metadata.files("example-robot-data") or []
    return [Path(str(f.locate())) for f in files if str(f).endswith(".urdf")]


def test_stripping_changes_no_placement_of_any_packaged_robot() -> None:
    """Every URDF of example-robot-data, whole against stripped, through Pinocchio: the same placements to the last bit."""
    paths, compared = packaged_urdfs(), 0
    assert len(paths) > 50
    for path in paths:
        try:
            whole = pin.buildModelFromUrdf(str(path))
        except ValueError:
            continue  # Pinocchio refuses the file itself
        stripped = pin.buildModelFromXML(read_urdf(path).text)
        assert list(stripped.names) == list(whole.names)
        q = pin.neutral(whole)
        rng = np.random.default_rng(0)
        for i in range(1, whole.njoints):
            if (whole.joints[i].nq, whole.joints[i].nv) == (1, 1):
                q[whole.joints[i].idx_q] = rng.uniform(-1, 1)
        data = [model.createData() for model in (whole, stripped)]
        for model, d in zip((whole, stripped), data, strict=True):
            pin.framesForwardKinematics(model, d, q)
        for frame in whole.frames:
            if frame.type == pin.FrameType.BODY:
                T_a = data[0].oMf[whole.getFrameId(frame.name, frame.type)].homogeneous
                T_b = data[1].oMf[stripped.getFrameId(frame.name, frame.type)].homogeneous
                assert np.array_equal(T_a, T_b), f"{path.name}: {frame.name}"
        compared += 1
    assert compared > 50


def test_every_packaged_robot_is_read_or_refused_with_a_reason() -> None:
    refused = []
    for path in packaged_urdfs():
        try:
            check(read_urdf(path))
        except UrdfError as error:
            refused.append(str(error))
    assert all(".urdf" in text and "\n" not in text for text in refused)
    assert len(refused) < 5, refused


def tree() -> Urdf:
    body = links("root", "a", "b", "c", "d") + joint("ja", "root", "a") + joint("jb", "a", "b")
    return parse_urdf(robot(body + joint("jc", "a", "c") + joint("jd", "c", "d", kind="fixed")), HERE)


def test_the_tree() -> None:
    urdf = tree()
    assert urdf.roots == ("root",)
    assert [j.name for j in urdf.children("a")] == ["jb", "jc"]
    assert [j.name for j in urdf.between("root", "d")] == ["ja", "jc", "jd"]
    assert [j.name for j in urdf.between("b", "d")] == ["jb", "jc", "jd"]
    assert urdf.between("a", "a") == ()
    with pytest.raises(KeyError, match="no link 'e'"):
        urdf.to_root("e")


def test_a_link_that_is_required_and_not_there() -> None:
    urdf = parse_urdf(robot(links("base_link", "tool0") + joint("j", "base_link", "tool0")), Path("arm.urdf"))
    urdf.require_link("tool0", "--tip")
    with pytest.raises(InputError, match=r"no link 'tool' in arm.urdf; did you mean 'tool0'") as refused:
        urdf.require_link("tool", "--tip")
    assert refused.value.key == "--tip"


def test_the_lint_names_no_engines() -> None:
    """What is known of each engine is in its traits; see tests/engines/test_lint_traits.py."""
    followed = robot(links("a", "b", "c") + joint("j", "a", "b") + joint("k", "b", "c", "<mimic joint='j'/>"))
    (message,) = [f.message for f in lint(parse_urdf(followed, Path("arm.urdf"))) if f.code == "mimic"]
    assert message == "joint 'k' mimics 'j'"
