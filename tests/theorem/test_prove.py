"""The theorem: polynomials are the chains, bounds hold and are tight, equal descriptions come out as equal."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from harness.description.dh import DHRow, DHTable
from harness.description.model import RobotModel, load_model
from harness.description.urdf_file import parse_urdf
from harness.difference.operands import of_urdf as operand_of_urdf
from harness.kinematics.descriptions import of_table as mechanism_of_table
from harness.run.proving import slides_of
from harness.se3 import Array, chord_angle
from harness.theorem.balls import precision
from harness.theorem.chain import Chains
from harness.theorem.coefficients import of_terms
from harness.theorem.descriptions import of_model, of_table, of_urdf, posed
from harness.theorem.equality import equal
from harness.theorem.polynomial import Polynomial
from harness.theorem.prove import Effort, FrameBound, prove
from harness.theorem.scales import scales_of
from tests.theorem.independent import chord_at_least, found, perturbed, position_at_least, random_table

TIGHT = Effort(above=0.0, nodes=3_000_000)
SLIDE = 0.7


def chains(table: DHTable) -> Chains:
    """The end of a table without base and tool."""
    return of_table(table, {"end": (str(len(table.rows)), ())}, (), ())


def ranges(table: DHTable) -> Array:
    """Half a metre or so for every slide, none for joints that turn. (n, 2)."""
    reach = np.array([SLIDE * (table.kind(joint) == "prismatic") for joint in table.joints])
    return np.stack([-reach, reach], axis=1)


def bound(a: DHTable, b: DHTable, effort: Effort = TIGHT) -> FrameBound:
    """What is proven of two tables at their end."""
    return prove(chains(a), chains(b), ranges(a), effort)["end"]


def some_q(table: DHTable, rng: np.random.Generator, count: int) -> Array:
    """Configurations (count, n), several turns, slides within their range."""
    slides = np.array([table.kind(j) == "prismatic" for j in table.joints])
    reach = np.where(slides, SLIDE, 3 * math.pi)
    return np.asarray(rng.uniform(-reach, reach, (count, len(reach))))


def of_model_bounds(model: RobotModel, effort: Effort = TIGHT) -> dict[str, FrameBound]:
    """What is proven of a robot model's two descriptions."""
    both = of_model(model, {})
    slides = slides_of(model)
    limits = np.array([slides.get(joint, (0.0, 0.0)) for joint in model.table.joints])
    return prove(both["dh"], both["urdf"], limits, effort)


@given(st.integers(0, 10**9), st.integers(1, 6))
def test_a_polynomial_is_its_chain(seed: int, joints: int) -> None:
    rng = np.random.default_rng(seed)
    table = random_table(rng, joints)
    with precision(128):
        polynomial = Polynomial.one((1,) * joints)
        for step in chains(table).paths["end"]:
            polynomial.then(step)
        R, p = polynomial.finished()
    q = some_q(table, rng, 20)
    expected = mechanism_of_table(table, {"end": (str(joints), np.eye(4))}).placements(q)[:, 0]
    origin, rotation = (of_terms(terms, (1,) * joints, ranges(table)) for terms in (p, R))
    assert origin.values(q) == pytest.approx(expected[:, :3, 3], abs=1e-12)
    assert rotation.values(q) == pytest.approx(expected[:, :3, :3].reshape(-1, 9), abs=1e-12)


@settings(
    max_examples=40, phases=(Phase.explicit, Phase.reuse, Phase.generate)
)  # shrinking takes minutes, and a seed says it all
@given(st.integers(0, 10**9), st.integers(2, 5), st.floats(-14, 0), st.sampled_from([0, 400_000]))
def test_no_bound_lies_below_what_another_library_finds(seed: int, joints: int, size: float, nodes: int) -> None:
    """mpmath, 50 digits, in intervals, at random configurations and at the worst ones that were found."""
    rng = np.random.default_rng(seed)
    a = random_table(rng, joints)
    b = perturbed(a, rng, 10.0**size)
    proven = bound(a, b, Effort(above=0.0, nodes=nodes))
    chord = 2.0 * math.sqrt(2.0) * math.sin(min(proven.rotation, math.pi) / 2.0)
    for q in (*some_q(a, rng, 20), *proven.worst):
        assert position_at_least(a, b, q) <= proven.position
        assert chord_at_least(a, b, q) <= chord * (1 + 1e-12) + 1e-30
    assert proven.position_found <= proven.position
    assert proven.rotation_found <= proven.rotation
    assert proven.position_found == pytest.approx(found(a, b, proven.worst[0])[0], rel=1e-9, abs=1e-25)
    assert proven.rotation_found == pytest.approx(
        float(chord_angle(np.array(found(a, b, proven.worst[1])[1]))), rel=1e-9, abs=1e-25
    )


@pytest.mark.parametrize("seed", range(12))
def test_sharp_bounds_are_within_a_tenth(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = random_table(rng, 4 + seed % 3)
    proven = bound(a, perturbed(a, rng, 1e-3))
    assert proven.position <= 1.1 * proven.position_found
    assert proven.rotation <= 1.1 * proven.rotation_found


UR5 = [[0, 0.5, 0.089159], [-0.425, 0, 0], [-0.39225, 0, 0], [0, 0.5, 0.10915], [0, -0.5, 0.09465], [0, 0, 0.0823]]


def ur5(**changes: tuple[int, float]) -> DHTable:
    """The table of a UR5, with numbers changed: `d=(0, 0.000301)`."""
    rows = [
        DHRow(name=f"j{i}", kind="revolute", a=a, alpha=alpha * math.pi, d=d, theta=0.0) for i, (a, alpha, d) in enumerate(UR5)
    ]
    for name, (i, change) in changes.items():
        rows[i] = replace(rows[i], **{name: round(getattr(rows[i], name) + change, 9)})
    return DHTable(tuple(rows))


CONSTANT = [
    (ur5(d=(0, 0.000301)), 0.000301, 0.0),
    (ur5(d=(5, 0.1034)), 0.1034, 0.0),  # a tool of 103.4 mm
    (ur5(a=(2, -0.001)), 0.001, 0.0),
    (ur5(theta=(5, 0.01)), 0.0, 0.01),
]


@pytest.mark.parametrize(("other", "position", "rotation"), CONSTANT)
def test_a_constant_difference_comes_out_exactly(other: DHTable, position: float, rotation: float) -> None:
    for proven in (bound(ur5(), other), bound(other, ur5())):
        assert proven.position == pytest.approx(position, rel=1e-9, abs=1e-30)
        assert proven.rotation == pytest.approx(rotation, rel=1e-9, abs=1e-30)
        assert proven.position_found == pytest.approx(position, rel=1e-9, abs=1e-30)


def test_three_lengths_add_up() -> None:
    """They point the same way somewhere: 2.0 mm, and no more than a tenth above it is claimed."""
    proven = bound(ur5(), ur5(a=(1, 0.0007), d=(3, 0.0008), alpha=(5, 0.0)))
    assert proven.position_found <= proven.position <= 1.1 * proven.position_found


def test_identical_tables_are_equal() -> None:
    assert equal(chains(ur5()), chains(ur5())) == {"end": True}
    assert equal(chains(ur5()), chains(ur5(d=(3, 1e-9)))) == {"end": False}
    assert bound(ur5(), ur5()).position < 1e-30


def test_equality_in_other_angles_than_right_ones() -> None:
    """Thirty and forty-five degrees: cosines that are irrational, and a different order of the same moves."""

    def table(angle: Fraction, convention: str) -> DHTable:
        number = float(angle) * math.pi
        rows = [DHRow(name=f"j{i}", kind="revolute", a=0.1, alpha=number, d=0.2, theta=number / 2) for i in range(3)]
        return DHTable(tuple(rows), convention)  # type: ignore[arg-type]

    for angle in (Fraction(1, 6), Fraction(1, 4), Fraction(1, 3)):
        a = table(angle, "standard")
        assert equal(chains(a), chains(a)) == {"end": True}
        longer = replace(a, rows=(*a.rows[:2], replace(a.rows[2], d=0.2 + 1e-12)))
        assert equal(chains(a), chains(longer)) == {"end": False}


def test_angles_that_are_no_multiples_of_pi_are_not_decided() -> None:
    table = ur5(alpha=(0, 0.1))
    assert equal(chains(table), chains(table)) == {"end": False}
    assert bound(table, table).position < 1e-30


@pytest.mark.parametrize("robot", ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"])
def test_every_robot(models: dict[str, RobotModel], robot: str) -> None:
    proven = of_model_bounds(models[robot], Effort())
    mapped = [f.name for f in models[robot].frames.frames if f.urdf is not None and f.relation != "rigid"]
    assert list(proven) == mapped
    largest = max(b.position for b in proven.values())
    assert largest < (1e-3 if robot == "iiwa14" else 1e-9)
    for one in proven.values():
        assert one.position_found <= one.position
        assert one.rotation_found <= one.rotation


def test_the_published_examples(models: dict[str, RobotModel]) -> None:
    """UR5: 1.2e-11 m by its coefficients, found 5.3e-12; Stanford: equal."""
    tool = of_model_bounds(models["ur5"], Effort(nodes=0))["tool0"]
    assert 5e-12 < tool.position_found <= tool.position < 1.2e-11
    stanford = of_model(models["stanford"], {})
    assert set(equal(stanford["dh"], stanford["urdf"]).values()) == {True}


def test_thirty_joints_go_by_constants() -> None:
    rows = tuple(DHRow(name=f"j{i}", kind="revolute", a=0.1, alpha=math.pi / 2 * (-1) ** i, d=0.05, theta=0.0) for i in range(30))
    longer = tuple(replace(r, a=0.1001) if i == 12 else r for i, r in enumerate(rows))
    proven = bound(DHTable(rows), DHTable(longer))
    assert proven.position == pytest.approx(1e-4, rel=1e-9)
    assert proven.rotation == 0.0
    assert proven.position_found == pytest.approx(1e-4, rel=1e-9)


def test_nearly_parallel_axes() -> None:
    """A table of two axes 4e-6 rad from parallel, d of twenty kilometres: right to 1e-12, and known to be."""
    alpha, far = 4e-6, 20_000.0
    rows = [
        DHRow(name="a", kind="revolute", a=0.3, alpha=alpha, d=far, theta=0.2),
        DHRow(name="b", kind="revolute", a=0.2, alpha=-alpha, d=-far, theta=0.1),
        DHRow(name="c", kind="revolute", a=0.2, alpha=1.1, d=0.1, theta=0.1),
    ]
    table = DHTable(tuple(rows))
    assert bound(table, table).position < 1e-28
    proven = bound(table, replace(table, rows=(rows[0], rows[1], replace(rows[2], a=0.2001))))
    assert proven.position == pytest.approx(1e-4, rel=1e-9)


OBLIQUE = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="one" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/>
<axis xyz="1 2 -3"/><limit lower="-1" upper="1"/></joint>
<joint name="two" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.1 0 0"/><axis xyz="0 -2 1"/>
<limit lower="-1" upper="1"/></joint>
<joint name="three" type="continuous"><parent link="c"/><child link="d"/><origin rpy="0 0 1"/><axis xyz="0 0 -1"/>
<mimic joint="one" multiplier="-0.5" offset="0.25"/></joint></robot>"""


def urdf_chains(text: str) -> tuple[Chains, Callable[[Array], Array]]:
    """Chains of a URDF from its root to its leaf, and the in-house placements of its end."""
    urdf = parse_urdf(text.encode(), Path("text"))
    operand = operand_of_urdf(urdf)
    recipe = operand.recipe(operand.joints, {j: j for j in operand.joints}, False)
    made = of_urdf(urdf, operand.base, {"end": (operand.tip, ())}, recipe.joints, operand.joints)  # type: ignore[union-attr]
    return made, lambda q: recipe.mechanism.placements(q)[:, 0]


def test_a_urdf_with_oblique_axes_and_a_follower() -> None:
    made, placements = urdf_chains(OBLIQUE)
    scales = scales_of([made])
    assert scales == (2, 1)
    with precision(128):
        polynomial = Polynomial.one(scales)
        for step in made.paths["end"]:
            polynomial.then(step)
        R, p = polynomial.finished()
    q = np.random.default_rng(0).uniform(-6, 6, (20, 2))
    limits = np.array([[0.0, 0.0], [-6.0, 6.0]])
    assert of_terms(p, scales, limits).values(q) == pytest.approx(placements(q)[:, :3, 3], abs=1e-13)
    assert of_terms(R, scales, limits).values(q) == pytest.approx(placements(q)[:, :3, :3].reshape(-1, 9), abs=1e-13)


@pytest.mark.parametrize(
    ("old", "new", "position"),
    [
        ('multiplier="-0.5"', 'multiplier="-0.499"', 0.0),
        ('xyz="0 -2 1"', 'xyz="0 -2.001 1"', 2e-4),
        ("0.1 0.2 0.3", "0.1 0.2 0.301", 1e-3),
    ],
)
def test_urdfs_that_differ(old: str, new: str, position: float) -> None:
    a, _ = urdf_chains(OBLIQUE)
    b, _ = urdf_chains(OBLIQUE.replace(old, new, 1))
    limits = np.array([[0.0, 0.0], [-1.0, 1.0]])
    proven = prove(a, b, limits, TIGHT)["end"]
    assert proven.position_found <= proven.position
    assert proven.position == pytest.approx(position, rel=0.11, abs=1e-30)
    assert prove(a, a, limits, TIGHT)["end"].position < 1e-30


def test_numbers_at_the_edges() -> None:
    """Denormals, 400 digits: a right answer."""
    tiny = ur5(a=(0, 0.0))
    rows = (replace(tiny.rows[0], a=1e-308), *tiny.rows[1:])
    proven = bound(tiny, replace(tiny, rows=rows))
    assert 1e-308 <= proven.position < 1e-30
    assert posed([float("0." + "1" * 400), 0.0, 0.0], [0.0, 0.0, 0.0])[0].amount.rational == Fraction("0.1111111111111111")


def test_a_longer_d1_in_a_model(copy_model: Callable[..., Path]) -> None:
    model = load_model(copy_model("ur5", ("dh.csv", "0.089159", "0.089460")))
    tool = of_model_bounds(model)["tool0"]
    assert tool.position == pytest.approx(0.301e-3, rel=1e-7)
    assert tool.position_found == pytest.approx(0.301e-3, rel=1e-7)


SCREW = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="one" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="two" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="one" multiplier="0.1"/></joint></robot>"""


def test_a_screw_is_bounded_in_a_range_alone() -> None:
    """A joint that turns and slides: its slide grows with every turn, so there is no bound without a range."""
    a, _ = urdf_chains(SCREW)
    b, _ = urdf_chains(SCREW.replace('multiplier="0.1"', 'multiplier="0.2"'))
    assert prove(a, b, np.zeros((1, 2)), TIGHT) == {}
    proven = prove(a, b, np.array([[-3.0, 2.0]]), TIGHT)["end"]
    assert proven.position == pytest.approx(0.3, rel=1e-6)
    assert proven.position_found == pytest.approx(0.3, rel=1e-6)
    assert proven.slope == pytest.approx(0.1, rel=1e-6)


def side_branch(angle: str) -> Chains:
    """A trunk of three joints, and a frame beside it, after two that follow them with another geometry."""
    text = f"""<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="f"/>
<joint name="j1" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="j2" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/></joint>
<joint name="j3" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/></joint>
<joint name="m1" type="revolute"><parent link="a"/><child link="e"/><origin xyz="0 0.2 0" rpy="{angle} 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1"/><mimic joint="j1"/></joint>
<joint name="m2" type="revolute"><parent link="e"/><child link="f"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/><mimic joint="j2"/></joint></robot>"""
    urdf = parse_urdf(text.encode(), Path("text"))
    operand = operand_of_urdf(urdf, "a", "d")
    recipe = operand.recipe(operand.joints, {j: j for j in operand.joints}, False)
    frames = {"trunk": ("d", ()), "side": ("f", posed((0.1, 0.0, 0.2), (0.0, 0.0, 0.0)))}
    return of_urdf(urdf, "a", frames, recipe.joints, operand.joints)  # type: ignore[union-attr]


def test_a_frame_beside_the_trunk_has_a_start_of_its_own() -> None:
    proven = prove(side_branch("0"), side_branch("0.05"), np.zeros((3, 2)), TIGHT)
    assert proven["trunk"].position < 1e-30
    side = proven["side"]
    assert 0.01 < side.position_found <= side.position <= 1.1 * side.position_found
    assert 0.03 < side.rotation_found <= side.rotation


def test_a_factor_of_twenty_digits_is_no_fault() -> None:
    """Equal ones cancel; others beat against each other, so that whole turns are apart somewhere."""
    digits = "0.12345678901234567891"
    a, _ = urdf_chains(OBLIQUE.replace("-0.5", digits))
    b, _ = urdf_chains(OBLIQUE.replace("-0.5", digits[:-1] + "2"))
    limits = np.array([[0.0, 0.0], [-1.0, 1.0]])
    assert prove(a, a, limits, TIGHT)["end"].position < 1e-30
    assert prove(a, b, limits, TIGHT) == {}
