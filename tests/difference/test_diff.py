"""`crosscheck diff` and `identify`: same, different and why; and the invariants they rest on."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness import se3
from harness.convert.derive import derive
from harness.convert.write_model import dh_csv
from harness.description.dh import DHRow, DHTable
from harness.description.locate import default_models_dir, packaged_file
from harness.description.model import RobotModel
from harness.difference.differences import diff
from harness.difference.identify import identify, rows_of
from harness.difference.operands import Operand
from harness.difference.reading import Ends, read_operand
from harness.difference.remarks import remarks
from harness.difference.result import Difference
from harness.engines.dh_numpy import DHNumpy
from harness.errors import DescriptionUnavailable, InputError
from harness.kinematics.invariants import match
from harness.kinematics.side_by_side import with_matching_normals
from tests.helpers import assert_placements_close, transforms

MODELS = default_models_dir()
TABLES = MODELS / "tables"
UR5 = "example-robot-data:ur_description/urdf/ur5_robot.urdf"
TOLERANCE = (1e-6, 1e-6)

Run = Callable[..., subprocess.CompletedProcess[str]]


def operand(text: str, base: str | None = None, tip: str | None = None) -> Operand:
    return read_operand(text, MODELS, Ends(base, tip))


def of_table(table: DHTable, name: str = "made") -> Operand:
    return Operand(
        name=name, joints=table.joints, prismatic=tuple(table.kind(j) == "prismatic" for j in table.joints), table=table
    )


def slots(found: Difference) -> list[set[tuple[str, str, str]]]:
    assert found.explanation is not None
    e = found.explanation
    pairs = zip(e.changes, e.equivalents, strict=True)
    return [{(c.kind, c.subject, c.parameter) for c in (change, *others)} for change, others in pairs]


def changes(found: Difference) -> dict[tuple[str, str], float]:
    """(subject, parameter): size in mm or degrees, of every change and what is the same."""
    assert found.explanation is not None
    e = found.explanation
    every = [c for change, others in zip(e.changes, e.equivalents, strict=True) for c in (change, *others)]
    return {(c.subject, c.parameter): c.size * 1e3 if c.unit == "m" else math.degrees(c.size) for c in every}


def test_the_same_is_proven_for_all_configurations() -> None:
    found = diff(operand("ur5"), operand(UR5, "base", "tool0"), TOLERANCE)
    assert found.same
    assert found.largest.position <= found.bound.position < 1e-10


def test_base_link_for_base() -> None:
    found = diff(operand("ur5"), operand(UR5, "base_link", "tool0"), TOLERANCE)
    assert not found.same
    (same,) = slots(found)
    assert {
        ("base frame", "base_link", "base"),
        ("parameter", "base", "turn z"),
        ("parameter", "shoulder_pan_joint", "theta"),
    } <= same


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ("puma560", ("rtb-data:unimation_puma560_description/urdf/puma560_robot.urdf", None, None),
         {("j3", "a"): -20.3, ("j4", "d"): 1.3}),
        ("irb140", ("rtb-data:abb_irb140_description/urdf/irb140.urdf", None, "tool0"),
         {("joint1", "a"): 210.0, ("joint1", "d"): 1028.0, ("joint2", "a"): 1060.0, ("joint4", "d"): 1110.0}),
        ("baxter_left", ("example-robot-data:baxter_description/urdf/baxter.urdf", "torso", "left_wrist"),
         {("left_e0", "d"): 0.42, ("left_w0", "d"): 0.29, ("left_s0", "d"): 10.976}),
    ],
)  # fmt: skip
def test_published_tables_against_packaged_urdfs(
    a: str, b: tuple[str, str | None, str | None], expected: dict[tuple[str, str], float]
) -> None:
    """What each pair is known for; see the comments in the tables."""
    found = diff(operand(str(TABLES / f"{a}.csv")), operand(*b), TOLERANCE)
    told = changes(found)
    assert {key: told.get(key) for key in expected} == {key: pytest.approx(size, abs=1e-3) for key, size in expected.items()}
    assert found.explanation is not None
    assert max(found.explanation.after) <= 1e-6
    if a == "irb140":
        assert "4 lengths are 3.92 to 4 times as large" in " ".join(remarks(found.explanation))
    if a == "baxter_left":
        assert "rounded there" in " ".join(remarks(found.explanation))


def test_the_two_shifts_of_the_iiwa() -> None:
    urdf = "rtb-data:kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf"
    told = changes(diff(operand("iiwa14"), operand(urdf, None, "tool0"), TOLERANCE))
    assert told[("joint_a2", "a")] == pytest.approx(-0.43624, abs=1e-9)
    assert told[("joint_a4", "a")] == pytest.approx(0.43624, abs=1e-9)


def test_two_tables_and_two_urdfs(tmp_path: Path, models: dict[str, RobotModel]) -> None:
    table = models["ur5"].table
    longer = replace(table, rows=(replace(table.rows[0], d=0.089459), *table.rows[1:]))
    found = diff(of_table(table, "ours"), of_table(longer, "theirs"), TOLERANCE)
    assert ("parameter", "shoulder_pan_joint", "d") in slots(found)[0]
    text = packaged_file("example-robot-data", UR5.split(":")[1]).read_text()
    (tmp_path / "other.urdf").write_text(text.replace("0.089159", "0.089459"))
    ends = ("base_link", "tool0")
    found = diff(operand(UR5, *ends), operand(str(tmp_path / "other.urdf"), *ends), TOLERANCE)
    assert changes(found)[("shoulder_pan_joint", "origin z")] in (pytest.approx(0.3), pytest.approx(-0.3))
    assert diff(operand(UR5, *ends), operand(UR5, *ends), TOLERANCE).same


def test_a_table_that_was_derived_from_the_urdf_is_the_same(tmp_path: Path) -> None:
    urdf = operand(UR5, "base_link", "tool0").urdf
    assert urdf is not None
    derived = derive(urdf, "base_link", "tool0", "modified", "urdf:pinocchio")
    assert diff(of_table(derived.table), operand(UR5, "base_link", "tool0"), TOLERANCE).same


@pytest.mark.parametrize("convention", ["standard", "modified"])
@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_turned_normals_are_the_same_table(convention: str, seed: int) -> None:
    """What the side-by-side view shows of B is still B."""
    rng = np.random.default_rng(seed)
    numbers = rng.uniform(-1, 1, (2, 4, 4))
    a, b = (tuple(DHRow.of(f"j{i}", "revolute", row) for i, row in enumerate(rows)) for rows in numbers)
    shown = with_matching_normals(a, b, convention)  # type: ignore[arg-type]
    q = rng.uniform(-3, 3, (5, 4))
    tables = [DHTable(tuple(rows), convention) for rows in (b, shown)]  # type: ignore[arg-type]
    before, after = (DHNumpy(table).placements(q, ("4",)) for table in tables)
    assert_placements_close(after, before, 1e-12)


# Invariants -------------------------------------------------------------------------------------------


@given(
    st.sampled_from(["ur5", "panda", "iiwa14", "stanford", "sixr"]),
    st.integers(0, 2**16),
    transforms,
    transforms,
)
@settings(max_examples=40)
def test_base_tool_signs_and_zero_offsets_do_not_matter(
    models: dict[str, RobotModel], robot: str, seed: int, base: se3.Array, tool: se3.Array
) -> None:
    table = models[robot].table
    rng = np.random.default_rng(seed)
    rows = tuple(replace(r, theta=r.theta + rng.uniform(-3, 3)) if r.kind == "revolute" else r for r in table.rows)
    changed = replace(table, rows=rows, base=base @ table.base, tool=table.tool @ tool)
    own, other = rows_of(of_table(table)), rows_of(of_table(changed))
    assert not isinstance(own, str)
    assert not isinstance(other, str)
    largest = match(own, other).largest
    assert largest is not None
    assert largest.size < 1e-6


def test_a_joint_that_turns_the_other_way_is_found(models: dict[str, RobotModel]) -> None:
    """Axes 3 and 5 of a Panda turned round, in its URDF. Where d is 0 and axes meet, a sign is a zero offset."""
    model = models["panda"]
    assert model.urdf is not None
    joints = tuple(
        replace(j, axis=(0.0, 0.0, -1.0)) if j.name in ("panda_joint3", "panda_joint5") else j for j in model.urdf.joint_list
    )
    urdf = replace(model.urdf, joint_list=joints)
    chain = Operand(
        name="turned", joints=model.table.joints, prismatic=(False,) * 7, urdf=urdf, base="panda_link0", tip="panda_link8"
    )
    own, other = rows_of(of_table(model.table)), rows_of(chain)
    assert not isinstance(own, str)
    assert not isinstance(other, str)
    matching = match(own, other)
    assert matching.largest is not None
    assert matching.largest.size < 1e-9
    flipped = {n for n, s in zip(model.table.joints, matching.signs, strict=True) if s < 0}
    assert flipped == {"panda_joint3", "panda_joint5"}
    found = diff(of_table(model.table), chain, TOLERANCE)
    assert {c.subject for c in found.explanation.changes} == flipped if found.explanation else False


def test_a_length_that_differs_is_the_largest_difference(models: dict[str, RobotModel]) -> None:
    table = models["ur5"].table
    longer = replace(table, rows=(*table.rows[:3], replace(table.rows[3], d=0.2), *table.rows[4:]))
    own, other = rows_of(of_table(table)), rows_of(of_table(longer))
    assert not isinstance(own, str)
    assert not isinstance(other, str)
    largest = match(own, other).largest
    assert largest is not None
    assert (largest.joint, largest.name) == ("wrist_1_joint", "d")
    assert largest.size == pytest.approx(0.2 - 0.10915)


def test_identify_is_nearest_first(tmp_path: Path) -> None:
    found = identify(operand(UR5, "base_link", "ee_link"), MODELS).known
    assert found[0].name.lower().endswith("ur5")
    assert found[0].size == (0.0, 0)
    sizes = [one.size for one in found]
    assert sizes == sorted(sizes)
    assert {one.name for one in found} >= {"ur3", "ur5", "ur10", "ur5e", "puma560", "irb140"}


def test_a_calibrated_arm_is_identified(tmp_path: Path) -> None:
    """A real UR10e: nearly parallel axes put 439 m into d; they are taken for parallel."""
    rows = (
        (2.12234865571206e-05, 1.57014608044242, 0.180539811714259, -2.4147806894359e-07),
        (0.0193171326277006, 0.0013941666682559, 439.140974079901, 1.60233952386695),
        (-0.569251663611088, 0.00693818880325995, -446.027059806332, -1.68607190752171),
        (-4.61409023720934e-05, 1.56998468543761, 7.0603368964236, 0.0837331147700119),
        (-6.39280053471802e-05, -1.57038520649543, 0.119811341150314, -1.01260355871158e-07),
        (0.0, 0.0, 0.115670917257426, 3.91986209186124e-08),
    )
    names = [f"j{i}" for i in range(1, 7)]
    calibrated = DHTable(tuple(DHRow.of(n, "revolute", row) for n, row in zip(names, rows, strict=True)))
    nominal = ((0.0, math.pi / 2, 0.1807), (-0.6127, 0.0, 0.0), (-0.57155, 0.0, 0.0), (0.0, math.pi / 2, 0.17415),
               (0.0, -math.pi / 2, 0.11985), (0.0, 0.0, 0.11655))  # fmt: skip
    own = rows_of(of_table(calibrated))
    other = rows_of(of_table(DHTable(tuple(DHRow.of(n, "revolute", (*r, 0.0)) for n, r in zip(names, nominal, strict=True)))))
    assert not isinstance(own, str)
    assert not isinstance(other, str)
    largest = match(own, other).largest
    assert largest is not None
    assert largest.size < 0.02


# The command line --------------------------------------------------------------------------------------


def test_diff_says_what_and_why(cli: Run) -> None:
    done = cli("diff", "ur5", UR5, "--base", "base_link", "--tip", "tool0")
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("DIFFERENT ur5 and ur5_robot.urdf (base_link to tool0)")
    assert "why: base frame: with placements in base instead of base_link both agree" in done.stdout
    assert "canonical standard DH" in done.stdout
    same = cli("diff", "ur5", UR5, "--base", "base", "--tip", "tool0")
    assert same.returncode == 0
    assert same.stdout.startswith("SAME")


def test_diff_of_csvs(cli: Run, tmp_path: Path, models: dict[str, RobotModel]) -> None:
    table = models["ur5"].table
    (tmp_path / "a.csv").write_text(dh_csv(table))
    (tmp_path / "b.csv").write_text(dh_csv(table).replace("0.10915", "0.11"))
    done = cli("diff", "a.csv", "b.csv")
    assert done.returncode == 1
    assert "d of wrist_1_joint: 0.10915 m in a, 0.11 m in b (+0.85 mm)" in done.stdout


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("ur5", "panda"), "no two of one kind: ur5 has 6 joints"),
        (("ur5", UR5), "expected --tip: the file has"),
        (("ur5", UR5, "--tip", "tool1"), "no link 'tool1' in ur5_robot.urdf; did you mean 'tool0'"),
        (("ur5", "nothing.urdf"), "nothing.urdf: no such file"),
        (("ur5", "nothing.csv"), "no such file"),
        (("ur5", "example-robot-data:nothing.urdf"), "no such file 'nothing.urdf' in example-robot-data"),
        (("ur5", "ur55"), "no robot model 'ur55'; did you mean 'ur5'"),
        (("ur5", "ur3", "--base", "a", "--base", "b", "--base", "c"), "expected at most two"),
        (("sixr", "stanford"), "joint 'joint3' slides in stanford, and turns in sixr"),
    ],
)
def test_wrong_input_is_one_line(cli: Run, args: tuple[str, ...], message: str) -> None:
    done = cli("diff", *args)
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_package_that_is_missing(cli: Run) -> None:
    done = cli("diff", "ur5", "no-such-package:a.urdf")
    assert done.returncode == 3
    assert "pip install no-such-package" in done.stderr
    with pytest.raises(DescriptionUnavailable):
        packaged_file("no-such-package", "a.urdf")


def test_the_toolbox_that_is_missing(cli: Run, tmp_path: Path) -> None:
    """In an environment without it: diff cannot, identify says what it leaves out."""
    nowhere = {"FK_CROSSCHECK_CACHE": str(tmp_path / "empty")}
    done = cli("diff", "ur5", "roboticstoolbox:UR5", **nowhere)
    assert done.returncode == 3
    assert "crosscheck engines install" in done.stderr
    done = cli("identify", "ur5", **nowhere)
    assert done.returncode == 0
    assert "left out: the Robotics Toolbox's tables" in done.stdout


def test_identify_tells_which(cli: Run) -> None:
    done = cli("identify", "rtb-data:kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf", "--tip", "tool0", "--most", "1")
    assert done.returncode == 0, done.stderr
    assert "iiwa14" in done.stdout
    assert "0.43624 mm (a of joint_a1 to joint_a2)" in done.stdout


def test_no_joint_at_all(tmp_path: Path) -> None:
    (tmp_path / "fixed.csv").write_text("joint,type,a,alpha,d,theta\nflange,fixed,0,0,0.1,0\n")
    with pytest.raises(InputError, match="every row is fixed"):
        operand(str(tmp_path / "fixed.csv"))


def test_what_is_proven_names_the_range_of_slides() -> None:
    rows = [DHRow.of("j1", "revolute", [0.3, 0.0, 0.0, 0.0]), DHRow.of("j2", "prismatic", [0.0, 0.0, 0.1, 0.0])]
    longer = [DHRow.of("j1", "revolute", [0.301, 0.0, 0.0, 0.0]), rows[1]]
    found = diff(of_table(DHTable(tuple(rows))), of_table(DHTable(tuple(longer))), TOLERANCE)
    assert "for all q with j2 from -0.5 to 0.5 m at most 1.000 mm, 0 rad (proven)" in str(found)
