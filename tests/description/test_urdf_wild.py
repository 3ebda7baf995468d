"""URDFs as they lie about: prefixes nobody declared, slips of spelling, other formats, numbers that are none."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from harness.description.joints import complete, leader_of
from harness.description.urdf import Urdf
from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import check, lint
from harness.description.urdf_numbers import parsed
from harness.difference.operands import of_urdf
from harness.errors import UrdfError

HERE = Path("arm.urdf")
LIMIT = "<limit lower='-1' upper='1' effort='1' velocity='1'/>"
XACRO = "xacro, not URDF.*; expand it first: xacro FILE > robot.urdf"


def arm(inside: str = "<axis xyz='0 0 1'/>", kind: str = "revolute", limit: str = LIMIT, root: str = "<robot name='r'>") -> str:
    """One joint `j` between the links a and b."""
    joint = f"<joint name='j' type='{kind}'><parent link='a'/><child link='b'/>{inside}{limit}</joint>"
    return f"{root}<link name='a'/><link name='b'/>{joint}</robot>"


def read(text: str) -> Urdf:
    return parse_urdf(text.encode(), HERE)


def found(text: str) -> list[tuple[str, str]]:
    return [(f.code, f.level) for f in lint(read(text))]


PREFIXED = "<axis xyz='0 0 1'/><drake:x/>"
DRAKE = LIMIT.replace("/>", " drake:acceleration='3'/>")


@pytest.mark.parametrize("head", ["", "\ufeff", "<?xml version='1.0'?>\n<!-- <robot> -->\n<?x <robot?>\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_an_undeclared_prefix_is_read_with_a_warning(head: str, encoding: str) -> None:
    text = head.lstrip("\ufeff" if encoding == "utf-16" else "") + arm(PREFIXED, limit=DRAKE)
    urdf = parse_urdf(text.replace("<link name='b'/>", "<link name='b'/><sensor:camera/>").encode(encoding), HERE)
    (warning,) = check(urdf)
    assert (warning.code, warning.level) == ("undeclared-prefix", "warning")
    assert "prefixes 'sensor', 'drake'" in warning.message
    assert urdf.joints["j"].limits == (-1.0, 1.0)
    assert "drake" not in urdf.text
    assert "acceleration" not in urdf.text


def test_many_undeclared_attributes_hide_no_other_mistake() -> None:
    """libxml2 reports a hundred mistakes at most: what comes behind them is seen all the same."""
    many = "".join(f"<p{i % 7}:x/>" for i in range(2000))
    assert found(arm("<axis xyz='0 0 1'/>" + many)) == [("undeclared-prefix", "warning")]
    for broken in ("<link>", "</joint>", "&none;", "<link name='c' name='c'/>"):
        with pytest.raises(UrdfError, match="not well-formed XML") as refused:
            read(arm("<axis xyz='0 0 1'/>" + many).replace("</robot>", f"{broken}</robot>"))
        assert "prefix" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<!DOCTYPE robot [<!ENTITY a 'b'>]>" + arm(PREFIXED), "document type or entity declaration is not allowed"),
        (arm("".join(f"<p{i}:x/>" for i in range(60))), "not well-formed XML: Namespace prefix"),
        (arm("<axis xyz='0 0 1'/>" + "<q:a>" * 300 + "</q:a>" * 300), "not well-formed XML"),
        (arm(PREFIXED) + "<robot/>", "not well-formed XML: Extra content"),
        ("<p:robot name='r'/>", "expected the root element <robot>, got <p:robot>"),
    ],
)
def test_nothing_else_slips_through_with_a_prefix(text: str, message: str) -> None:
    with pytest.raises(UrdfError, match=message):
        read(text)


def test_a_default_namespace_is_read_with_a_warning() -> None:
    text = arm(root="<robot xmlns='http://drake.mit.edu' name='r'>")
    assert found(text) == [("default-namespace", "warning")]
    assert read(text).text == read(arm()).text


@pytest.mark.parametrize(
    ("axis", "code", "message"),
    [
        ("<axis xzy='0 0 1'/>", "fixed-axis-without-xyz", "it has 'xzy'; did you mean 'xyz'?"),
        ("<axis XYZ='0 0 1'/>", "fixed-axis-without-xyz", "it has 'XYZ'; did you mean 'xyz'?"),
        ("<axis/>", "fixed-axis-without-xyz", "no attribute 'xyz'"),
        ("<axis xyz='0 0'/>", "fixed-axis-not-numbers", "expected 3 finite numbers in xyz, got '0 0'"),
        ("<limit lower='a'/>", "fixed-limit-not-a-number", "expected a finite number in lower, got 'a'"),
        ("<limit uper='1' effort='1' velocity='1'/>", "unknown-attribute", "did you mean 'upper'?"),
        ("<mimic joint='j' offset='nan'/>", "fixed-mimic-not-finite", "expected a finite number in offset, got 'nan'"),
    ],
)
def test_what_a_fixed_joint_says_of_its_motion_is_a_warning(axis: str, code: str, message: str) -> None:
    warning = next(f for f in check(read(arm(axis, "fixed", ""))) if f.code == code)
    assert warning.level == "warning"
    assert message in warning.message
    assert warning.message.startswith("joint 'j': ")


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<axis xzy='0 0 1'/>", "<axis> has no attribute 'xyz', it has 'xzy'; did you mean 'xyz'"),
        ("<origin xzy='0 0 1'/>", "<origin> has no attribute 'xyz', it has 'xzy'; did you mean 'xyz'"),
        ("<origin zyx='0 0 1' rpy='0 0 0'/>", "did you mean 'xyz'"),
        ("<origin xyz='0 0 1' rpz='0 0 0'/>", "did you mean 'rpy'"),
        ("<origin xyz='0 0 1' quat_xyzw='0 0 0 1'/>", "did you mean 'rpy'"),
        ("<origin colour='red'/>", "<origin> has an attribute 'colour' that URDF does not know; known: xyz, rpy"),
        ("<mimic joint='k' multipler='2'/>", "did you mean 'multiplier'"),
        ("<mimic joint='k' offest='2'/>", "did you mean 'offset'"),
        ("<orgin xyz='0 0 1'/>", "no <origin>, it has <orgin>; did you mean <origin>"),
        ("<Axis xyz='0 0 1'/>", "did you mean <axis>"),
        ("<mimc joint='k'/>", "did you mean <mimic>"),
    ],
)
def test_a_slip_that_engines_take_for_a_default_is_refused(inside: str, message: str) -> None:
    with pytest.raises(UrdfError, match=re.escape(message)) as refused:
        read(arm(inside))
    assert "arm.urdf:1: joint 'j': " in str(refused.value)


@pytest.mark.parametrize(
    "inside",
    ["<origin xyz='0 0 0' rpy='0 0 0' colour='red'/>", "<origin xyz='0 0 0' xzy='0 0 1'/>", "<mimic joint='j' colour='red'/>"],
)
def test_an_attribute_that_replaces_nothing_is_a_warning(inside: str) -> None:
    assert ("unknown-attribute", "warning") in found(
        arm("<axis xyz='0 0 1'/>" + inside, "fixed" if "mimic" in inside else "revolute")
    )


def test_a_misspelt_limit_is_refused_and_a_misspelt_effort_is_not() -> None:
    with pytest.raises(UrdfError, match="did you mean 'lower'"):
        read(arm(limit="<limit lwoer='-1' upper='1' effort='1' velocity='1'/>"))
    codes = found(arm(limit="<limit lower='-1' upper='1' efort='1' velocity='1'/>"))
    assert codes == [("unknown-attribute", "warning"), ("limit-without-effort", "warning")]


def test_a_mimic_without_a_leader_is_an_error_for_chains_that_contain_it() -> None:
    more = "<link name='c'/><joint name='k' type='revolute'><parent link='a'/><child link='c'/><axis xyz='0 0 1'/>"
    urdf = read(arm("<axis xyz='0 0 1'/><mimic joint='nobody'/>").replace("</robot>", f"{more}{LIMIT}</joint></robot>"))
    assert ("unknown-mimic", "warning") in [(f.code, f.level) for f in check(urdf)]
    with pytest.raises(UrdfError, match="joint 'j' mimics 'nobody', which does not exist") as refused:
        leader_of(urdf, urdf.joints["j"])
    assert refused.value.line == 1
    joint_map = complete({"k": (np.ones(1), 0.0)}, urdf, 1)
    assert (joint_map.held, joint_map.followers) == (("j",), ())
    assert joint_map.values(np.array([[0.5]]), ("j", "k")).tolist() == [[0.0, 0.5]]
    assert of_urdf(urdf, "a", "c").joints == ("k",)
    with pytest.raises(UrdfError, match="mimics 'nobody'"):
        of_urdf(urdf, "a", "b")


def test_a_mimic_at_a_fixed_joint_moves_nothing_and_warns_of_nothing() -> None:
    for leader in ("j", "nobody"):
        levels = {level for _, level in found(arm(f"<mimic joint='{leader}'/>", "fixed", ""))}
        assert levels == {"note"}


def tree(*joints: tuple[str, str]) -> str:
    links = "".join(f"<link name='{name}'/>" for name in ("base", "l1", "l2"))
    texts = (
        f"<joint name='j{i}' type='fixed'><parent link='{a}'/><child link='{b}'/></joint>" for i, (a, b) in enumerate(joints)
    )
    return f"<robot name='r'>{links}{''.join(texts)}</robot>"


def test_a_missing_parent_is_the_only_message() -> None:
    with pytest.raises(UrdfError) as refused:
        check(read(tree(("world", "base"), ("base", "l1"), ("l1", "l2"))))
    assert "parent link 'world' does not exist (joint 'j0')" in str(refused.value)
    assert "cycle" not in str(refused.value)
    assert "more error" not in str(refused.value)
    assert found(tree(("base", "l1"), ("base", "ll2"))) == [("unknown-link", "error")]


def test_all_missing_links_are_named_up_to_a_cap() -> None:
    (error,) = (f for f in lint(read(tree(*((f"w{i}", f"c{i}") for i in range(9))))) if f.level == "error")
    assert error.message.count("does not exist (joint") == 6
    assert error.message.endswith("and 12 more links do not exist")
    with pytest.raises(UrdfError, match="cycle"):
        check(read(tree(("l1", "l2"), ("l2", "l1"), ("base", "nowhere")).replace("nowhere", "base")))


@pytest.mark.parametrize(
    ("limit", "kind", "code", "level"),
    [
        ("<limit lower='-1' upper='1' velocity='1'/>", "revolute", "limit-without-effort", "warning"),
        ("<limit velocity='1'/>", "continuous", "limit-without-effort", "warning"),
        ("<limit lower='-1' upper='1' effort='1'/>", "revolute", "limit-without-velocity", "warning"),
        ("<limit lower='-1' upper='1' effort='a' velocity='1'/>", "revolute", "limit-not-a-number", "warning"),
        ("<limit lower='-1' upper='1' effort='inf' velocity='1'/>", "revolute", "limit-not-finite", "warning"),
        ("<limit lower='-1' upper='1' effort='-1' velocity='1'/>", "revolute", "negative-effort", "warning"),
        ("<limit lower='-1' upper='1' effort='1' velocity='-1'/>", "prismatic", "negative-velocity", "warning"),
        ("", "prismatic", "prismatic-without-limit", "warning"),
        ("", "revolute", "revolute-without-limit", "warning"),
        ("<limit lower='.1' upper='1' effort='1' velocity='1'/>", "revolute", "limits-exclude-zero", "note"),
        ("<limit lower='1' upper='-1' effort='1' velocity='1'/>", "prismatic", "limits-reversed", "warning"),
    ],
)
def test_the_lint_of_limits(limit: str, kind: str, code: str, level: str) -> None:
    assert found(arm(kind=kind, limit=limit)) == [(code, level)]


def test_limits_that_nothing_is_wrong_with() -> None:
    assert found(arm()) == []
    assert found(arm(kind="continuous", limit="")) == []
    assert found(arm("", "fixed", "")) == []
    assert found(arm(limit="<limit lower='0' upper='0' effort='0' velocity='0'/>")) == []
    assert found(arm(root="<robot>")) == [("unnamed-robot", "warning")]
    assert found(arm(root="<robot name=''>")) == [("empty-name", "warning")]


GOOD = {"1": 1.0, "+1": 1.0, "-1.": -1.0, ".5": 0.5, "1e-3": 1e-3, "1E+3": 1e3, "007": 7.0, " 1\t": 1.0}
BAD = (
    *(
        "1_0",
        "1e5_0",
        "0x10",
        "infinity",
        "inf",
        "-INF",
        "nan",
        "1e999",
        "\u0661",
        "\uff11",
        "1,5",
        "1d0",
        "1e",
        "e1",
        ".",
        "+",
        "--1",
    ),
    *("1 m", "1m", "pi/2", "1\u00a0", "True", "", "1" * 2000, "1\x85"),
)


@pytest.mark.parametrize("text", GOOD)
def test_numbers_as_urdfdom_reads_them(text: str) -> None:
    assert parsed(text) == (GOOD[text],)


@pytest.mark.parametrize("text", BAD)
def test_numbers_that_urdfdom_does_not_read(text: str) -> None:
    assert parsed(text) is None or len(parsed(text) or ()) != 1
    with pytest.raises(UrdfError, match="expected 3 finite numbers in xyz"):
        read(arm(f"<axis xyz='0 1 {text}'/>" if text else "<axis xyz=''/>"))


def test_a_long_text_that_is_no_number_is_refused_at_once() -> None:
    assert parsed("1" * 3_000_000 + "x") is None
    with pytest.raises(UrdfError) as refused:
        read(arm(f"<axis xyz='0 0 {'1' * 5000}x'/>"))
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize(
    ("inside", "key"),
    [
        ("<origin xyz='0 0 1e10'/>", "<origin> xyz: expected at most 1e+09 m in xyz, got 1e+10"),
        (f"<origin xyz='0 -1{'0' * 300} 0'/>", "<origin> xyz: expected at most 1e+09 m in xyz, got -1e+300"),
        ("<origin rpy='0 2e6 0'/>", "<origin> rpy: expected at most 1e+06 rad in rpy, got 2e+06"),
        ("<axis xyz='0 0 1e300'/>", "<axis> xyz: expected at most 1e+09 in xyz, got 1e+300"),
        ("<mimic joint='k' multiplier='1e300'/>", "<mimic> multiplier: expected at most 1e+09 in multiplier"),
        ("<mimic joint='k' offset='1e7'/>", "<mimic> offset: expected at most 1e+06 rad in offset"),
    ],
)
def test_numbers_beyond_what_a_description_can_hold(inside: str, key: str) -> None:
    with pytest.raises(UrdfError, match=re.escape(f"arm.urdf:1: joint 'j' {key}")):
        read(arm(inside))


@pytest.mark.parametrize("size", ["1e9", "1e16", "1e308", "1" + "0" * 300])
def test_limits_that_mean_none_may_be_of_any_size(size: str) -> None:
    joint = read(arm(limit=f"<limit lower='-{size}' upper='{size}' effort='1' velocity='1'/>")).joints["j"]
    assert joint.range == (None, None)
    assert joint.limits == (-float(size), float(size))


ROBOT = "<robot name='r'><link name='a'/>"
SRDF = "<robot name='r'><group name='arm'><link name='a'/></group><disable_collisions link1='a' link2='b'/></robot>"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *(
            (f"<robot xmlns:xacro='{uri}' name='r'><link name='a'/><xacro:arm/></robot>", XACRO)
            for host in ("http://ros.org/wiki/xacro", "http://www.ros.org/wiki/xacro", "http://wiki.ros.org/xacro")
            for uri in (host, f"{host}/", host.replace("http", "https"))
        ),
        ("<robot name='r'><xacro:include filename='x'/></robot>", XACRO),
        (f"{ROBOT}<link name='${{p}}b'/></robot>", XACRO),
        (arm("<origin xyz='0 0 ${h}'/>"), XACRO),
        (arm("<origin xyz='$(find x)'/>"), XACRO),
        (arm("<axis xyz='0 0 $(arg z)'/>", "fixed"), XACRO),
        (arm(kind="${kind}"), XACRO),
        (arm("<xacro:axis/>", root="<robot xmlns:xacro='http://ros.org/wiki/xacro'>"), XACRO),
        (SRDF, "this is an SRDF; give the URDF that it belongs to"),
        ("<sdf version='1.9'><model name='m'/></sdf>", "got <sdf>: this is SDF"),
        ("<mujoco model='m'/>", "got <mujoco>: this is MJCF"),
        ("<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema'/>", "this is a COLLADA mesh"),
        ("<html xmlns='http://www.w3.org/1999/xhtml'><body/></html>", "this is an HTML page; download the raw file"),
        ("<!DOCTYPE html>\n<html><head><meta charset=utf-8>", "this is an HTML page; download the raw file"),
        ("<Robot name='r'/>", "write it in lower case: <robot>"),
        ('#usda 1.0\ndef Xform "robot" {}', "this is USD text"),
        ("PXR-USDC", "this is binary USD"),
        ('{"links": []}', "this is JSON"),
        ('[{"name": "a"}]', "this is JSON"),
        ("# a robot\nname: r\nlinks:\n  - a\n", "this is YAML"),
        ("---\nname: r\n", "this is YAML"),
        ('[model]\nname = "r"\n', "this is TOML"),
        ("joint,type,a,alpha,d,theta\nj,revolute,0,0,0,0\n", "this is a table in CSV"),
        (
            "version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
            "this is a pointer of Git LFS.*; fetch the file: git lfs pull",
        ),
        ("<gibberish/>", "expected the root element <robot>, got <gibberish>"),
        ("robot arm", "not well-formed XML"),
    ],
)
def test_other_formats_are_named(text: str, message: str) -> None:
    with pytest.raises(UrdfError, match=message) as refused:
        read(text)
    assert "\n" not in str(refused.value)


def test_traces_of_xacro_that_do_no_harm_are_read() -> None:
    root = "<robot xmlns:xacro='http://ros.org/wiki/xacro' name='r'>"
    mesh = "<link name='a'><visual><geometry><mesh filename='$(find x)/a.stl'/></geometry></visual>"
    assert found(arm(root=root).replace("<link name='a'/>", mesh + "</link>")) == []
