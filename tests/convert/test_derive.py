"""Screws, canonical parameters, derive-dh and export-urdf: what a mechanism is, whatever file it came from."""

from __future__ import annotations

import math
import re
import subprocess
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from harness import se3
from harness.convert.derive import derive
from harness.convert.export_urdf import export_urdf
from harness.convert.verify import verify
from harness.description.dh import Convention, DHRow, DHTable
from harness.description.model import RobotModel, load_model
from harness.description.tidy import angle_text, number_text, tidy_angle, tidy_length
from harness.description.urdf_file import parse_urdf, read_urdf
from harness.description.values import parse_number
from harness.engines import requirements
from harness.engines.dh_numpy import DHNumpy
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.errors import InputError, UrdfError
from harness.kinematics.canonical import canonical
from harness.kinematics.screws import Chain, adjoint, exp, fit_gauge, log, rebuild, screws
from harness.run.binding import bind
from harness.run.options import Options
from harness.se3 import Array
from tests.helpers import assert_placements_close, crosscheck, tables, transforms

Cli = Callable[..., "subprocess.CompletedProcess[str]"]


def chain_of(table: DHTable) -> Chain:
    return lambda q: DHNumpy(table).placements(q, ["tool"])[:, 0]


def slides(table: DHTable) -> list[bool]:
    return [table.kind(joint) == "prismatic" for joint in table.joints]


@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6), st.floats(-1, 1))
def test_exp_and_log_undo_each_other(twist: list[float], q: float) -> None:
    S = np.array(twist)
    assume(np.linalg.norm(S[3:]) * abs(q) < 3.0)
    T = exp(S, q)
    assert_placements_close(T[:3, :3].T @ T[:3, :3], np.eye(3), 1e-12)
    assert log(T) == pytest.approx(S * q, abs=1e-7)


@given(st.floats(-2, 2), st.floats(-3, 3))
def test_exp_of_a_joint_is_the_joint(d: float, q: float) -> None:
    assert_placements_close(exp(np.array([0, 0, 0, 0, 0, 1.0]), q), se3.rotation("z", q), 1e-14)
    assert_placements_close(exp(np.array([0, d, 0, 0, 0, 0.0]), q), se3.translation((0, d * q, 0)), 1e-14)


@given(tables())
def test_screws_rebuild_every_dh_chain(table: DHTable) -> None:
    found = screws(chain_of(table), slides(table), np.random.default_rng(0))
    assert found.residual < 1e-11
    q = np.random.default_rng(1).uniform(-2, 2, (3, len(table.joints)))
    for q_k, T in zip(q, chain_of(table)(q), strict=True):
        assert_placements_close(rebuild(found.M, found.S, q_k), T, 1e-11)


def test_what_is_no_chain_is_not_rebuilt() -> None:
    """Joint 2 turned by the square of q: no screws can rebuild it, and the residual says so."""
    table = DHTable(
        (
            DHRow(name="a", kind="revolute", a=0.3, alpha=0.5, d=0.1, theta=0.0),
            DHRow(name="b", kind="revolute", a=0.2, alpha=0.0, d=0.0, theta=0.0),
        )
    )

    def bent(q: Array) -> Array:
        return chain_of(table)(np.column_stack([q[:, 0], q[:, 1] * np.abs(q[:, 1])]))

    assert screws(bent, [False, False], np.random.default_rng(0)).residual > 0.1


@settings(max_examples=150)
@given(tables(), st.sampled_from(["standard", "modified"]))
def test_canonical_parameters_are_the_same_mechanism(table: DHTable, convention: Literal["standard", "modified"]) -> None:
    """Whatever table it came from, whichever convention it is written in: the same placements, base and tool included."""
    found = screws(chain_of(table), slides(table), np.random.default_rng(0))
    form = canonical(found, slides(table), convention, list(table.joints))
    # Nearly parallel axes have their common normal far away: accuracy is lost in proportion, and the form says so.
    reach = max([1.0, *(abs(x) for row in form.rows for x in (row.a, row.d))])
    assume(reach < 1e4)
    again = DHTable(form.rows, convention, form.base, form.tool)
    q = np.random.default_rng(2).uniform(-3, 3, (5, len(form.rows)))
    assert_placements_close(chain_of(again)(q), chain_of(table)(q), 1e-7 * reach)


@pytest.mark.parametrize(
    ("robot", "convention"), [("ur5", "standard"), ("ur3", "standard"), ("panda", "modified"), ("ur5e", "standard")]
)
def test_published_tables_come_back(models: dict[str, RobotModel], robot: str, convention: Convention) -> None:
    """From the URDF's placements alone: the very numbers of the manufacturer's table."""
    model = models[robot]
    assert model.urdf is not None
    base, tip = ("panda_link0", "panda_link8") if robot == "panda" else ("base", "tool0")
    derived = derive(model.urdf, base, tip, convention, "urdf:pinocchio")
    rows = [row for row in model.table.rows if row.kind != "fixed"]
    for got, expected in zip(derived.table.rows, rows, strict=True):
        d = expected.d + (0.107 if got.name == "panda_joint7" else 0.0)
        assert (got.a, got.alpha, got.d, got.theta) == pytest.approx((expected.a, expected.alpha, d, expected.theta), abs=5e-11)
        assert angle_text(got.alpha) in ("0", "pi/2", "-pi/2")
    if robot != "panda":
        assert [text.split(":")[0] for text in derived.free] == [
            "shoulder_lift_joint and elbow_joint are parallel",
            "elbow_joint and wrist_1_joint are parallel",
        ]


def test_the_gauge_between_two_bases(models: dict[str, RobotModel]) -> None:
    """base against base_link: half a turn about z, found from the screws alone."""
    model = models["ur5"]
    assert model.urdf is not None
    bound = bind(requirements.build(UrdfPinocchio, model.urdf), model, {})
    index = [f.name for f in model.frames.frames].index("tool0")
    S_base = screws(lambda q: bound.mapped(q)[index], [False] * 6, np.random.default_rng(0)).S
    T_link_base = se3.rotation("z", math.pi)
    gauge = fit_gauge(S_base, S_base @ adjoint(T_link_base).T)
    assert_placements_close(gauge.T_b_a, T_link_base, 1e-10)
    assert np.abs(gauge.residuals).max() < 1e-12
    assert (gauge.rank, gauge.free) == ((3, 3), ())


@given(transforms, tables())
def test_the_gauge_carries_one_chain_to_the_other(T: Array, table: DHTable) -> None:
    S = screws(chain_of(table), slides(table), np.random.default_rng(0)).S
    gauge = fit_gauge(S, S @ adjoint(T).T)
    assert np.abs(gauge.residuals).max() < 1e-7


def test_parallel_axes_leave_the_gauge_free() -> None:
    """Three parallel axes fix the turn about them by where they stand; one alone does not."""
    planar = DHTable(tuple(DHRow(name=f"j{i}", kind="revolute", a=0.5, alpha=0.0, d=0.0, theta=0.0) for i in range(3)))
    S = screws(chain_of(planar), [False] * 3, np.random.default_rng(0)).S
    T = se3.from_xyz_rpy((0.1, -0.2, 0.7), (0, 0, 0.4))
    gauge = fit_gauge(S, S @ adjoint(T).T)
    assert (gauge.rank, gauge.free) == ((3, 2), ("translation along the one direction that all axes share",))
    assert_placements_close(gauge.T_b_a[:2], T[:2], 1e-9)
    alone = fit_gauge(S[:1], S[:1] @ adjoint(T).T)
    assert alone.rank == (2, 2)
    assert len(alone.free) == 2


@pytest.mark.parametrize("value", ["pi/2", "-pi", "3*pi/4", "-pi/12", "0", "0.3", "5*pi/6", "-2*pi"])
def test_angles_are_written_as_they_are_read(value: str) -> None:
    assert angle_text(parse_number(value)) == value


@given(st.floats(-10, 10))
def test_numbers_read_back_exactly(x: float) -> None:
    assert float(number_text(x)) == x
    assert parse_number(angle_text(x)) == x
    assert abs(tidy_angle(x) - x) < 5e-10
    assert abs(tidy_length(x) - x) < 2e-11


# The commands ------------------------------------------------------------------------------------


def packaged(name: str) -> Path:
    return next(Path(str(f.locate())) for f in metadata.files("example-robot-data") or [] if f.name == name)


CHAINS = [
    ("ur5_robot.urdf", "base_link", "ee_link"),
    ("panda.urdf", "panda_link0", "panda_leftfinger"),  # ends in a prismatic joint
    ("baxter.urdf", "base", "right_gripper"),  # next to a singular pitch
    ("z1.urdf", "link00", "gripperMover"),
    ("talos_full_v2.urdf", "base_link", "wrist_right_ft_tool_link"),
    ("anymal.urdf", "base", "LH_FOOT"),
    ("hyq_no_sensors.urdf", "base_link", "lf_foot"),
    ("ur5_robot.urdf", "tool0", "base"),  # backwards: from the tip to the base
]


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize(("name", "base", "tip"), CHAINS)
def test_derived_tables_are_proven_close_to_their_urdf(name: str, base: str, tip: str, convention: Convention) -> None:
    derived = derive(read_urdf(packaged(name)), base, tip, convention, "urdf:pinocchio")
    report = verify(derived, "robot", "urdf:pinocchio", None)
    assert report.verdict.exit_code == 0, report.verdict.sentence
    proof = report.sources[1].certificate
    assert proof is not None
    assert max(bound.position_upper for bound in proof.frames) < 1e-9
    assert report.unmapped == []


def test_chains_without_a_table_say_why() -> None:
    panda = read_urdf(packaged("panda.urdf"))
    with pytest.raises(UrdfError, match="'panda_finger_joint2' mimics 'panda_finger_joint1', and a row has a joint of its own"):
        derive(panda, "panda_link0", "panda_rightfinger", "standard", "urdf:pinocchio")
    with pytest.raises(UrdfError, match="nothing moves between 'panda_link7' and 'panda_hand'"):
        derive(panda, "panda_link7", "panda_hand", "standard", "urdf:pinocchio")
    with pytest.raises(InputError, match=r"no link 'panda_link88' in panda\.urdf; did you mean 'panda_link8'"):
        derive(panda, "panda_link0", "panda_link88", "standard", "urdf:pinocchio")
    two = "<link name='a'/><link name='b'/>"
    text = f"<robot name='r'>{two}<joint name='j' type='floating'><parent link='a'/><child link='b'/></joint></robot>"
    with pytest.raises(UrdfError, match="joint 'j' is floating"):
        derive(parse_urdf(text.encode(), Path("x.urdf")), "a", "b", "standard", "urdf:pinocchio")


def test_derive_dh_writes_a_model_that_runs(cli: Cli, tmp_path: Path) -> None:
    result = cli(
        "derive-dh", str(packaged("ur5_robot.urdf")), "--base", "base", "--tip", "tool0", "--name", "mine", "--out", "models"
    )
    assert result.returncode == 0, result.stderr
    assert "shoulder_pan_joint   revolute  0         pi/2   0.089159  0" in result.stdout
    assert "fixed by choice: shoulder_lift_joint and elbow_joint are parallel" in result.stdout
    assert "mine AGREES" in result.stdout
    assert {p.name for p in (tmp_path / "models" / "mine").iterdir()} == {
        "dh.csv", "model.toml", "frames.toml", "configurations.toml", "mine.urdf",
    }  # fmt: skip
    again = cli("run", "--models", "models", "--samples", "50")
    assert again.returncode == 0, again.stdout
    assert "differ by at most" in again.stdout


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("nowhere.urdf",), "nowhere.urdf: no such file"),
        (("PANDA",), "expected --tip: the file has 3 leaves; panda_hand_tcp"),
        (("PANDA", "--tip", "panda_linc8"), "--tip: no link 'panda_linc8'.*did you mean 'panda_link"),
        (("PANDA", "--tip", "panda_rightfinger"), "no DH table: joint 'panda_finger_joint2' mimics"),
        (("PANDA", "--tip", "panda_link8", "--source", "urdf:pinochio"), "did you mean 'urdf:pinocchio'"),
        (("PANDA", "--tip", "panda_link8", "--source", "dh:numpy"), "--source: expected a source that reads a URDF"),
        (("PANDA", "--tip", "panda_link8", "--out", "/proc/nowhere"), "cannot be written"),
    ],
)
def test_derive_dh_refuses_in_one_line(cli: Cli, args: tuple[str, ...], message: str) -> None:
    result = cli("derive-dh", *(str(packaged("panda.urdf")) if arg == "PANDA" else arg for arg in args))
    assert result.returncode == 2
    (line,) = result.stderr.strip().splitlines()
    assert "Traceback" not in line
    assert re.search(message, line), line


REFUSED = """<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='revolute'><parent link='a'/><child link='b'/>
<axis xyz='0 0 1'/>LIMIT</joint></robot>"""


@pytest.mark.parametrize(
    ("limit", "reason"),
    [
        ("<limit lower='-1' upper='1' velocity='1'/>", "joint 'j': <limit> has no attribute 'effort'"),
        ("", "joint 'j': revolute without a <limit>"),
        ("<limit lower='-1' upper='1' effort='-1' velocity='1'/>", "joint 'j': <limit> has a negative effort"),
    ],
)
def test_a_file_that_the_engine_refuses_is_one_line_with_the_reason(cli: Cli, tmp_path: Path, limit: str, reason: str) -> None:
    """Pinocchio's own lines on stderr do not reach the terminal."""
    (tmp_path / "arm.urdf").write_text(REFUSED.replace("LIMIT", limit))
    result = cli("derive-dh", "arm.urdf")
    assert result.returncode == 2
    expected = f"error: arm.urdf:1: urdf:pinocchio refuses the file: {reason}; choose another --source, or mend the file\n"
    assert result.stderr == expected
    assert result.stdout == ""


def test_a_refusal_that_no_trait_knows_has_the_words_of_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "arm.urdf").write_text(REFUSED.replace("LIMIT", ""))
    monkeypatch.setattr("harness.convert.derive.refused_for", lambda *_: None)
    with pytest.raises(UrdfError, match=r"urdf:pinocchio: buildModelFromXML refused the URDF: .*; stderr ends: ") as refused:
        derive(read_urdf(tmp_path / "arm.urdf"), "a", "b", "standard", "urdf:pinocchio")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "limit", ["lower='-1' upper='1e16'", "lower='-1e16' upper='1e16'", "lower='1' upper='1'", "lower='-1e10' upper='0'"]
)
def test_a_slide_whose_limits_mean_none_gets_a_range(cli: Cli, tmp_path: Path, limit: str) -> None:
    """Without one the model that was derived could not be read back."""
    text = REFUSED.replace("LIMIT", f"<limit {limit} effort='1' velocity='1'/>").replace("revolute", "prismatic")
    (tmp_path / "arm.urdf").write_text(text)
    result = cli("derive-dh", "arm.urdf", "--out", "models")
    assert (result.returncode, result.stderr) == (0, "")
    assert "j = [-1, 1]" in (tmp_path / "models" / "arm" / "configurations.toml").read_text().replace('"', "")


def test_a_follower_without_a_leader_is_refused_on_the_chain(tmp_path: Path) -> None:
    limit = "<limit lower='-1' upper='1' effort='1' velocity='1'/><mimic joint='nobody'/>"
    (tmp_path / "arm.urdf").write_text(REFUSED.replace("LIMIT", limit))
    with pytest.raises(UrdfError, match="joint 'j' mimics 'nobody', which does not exist"):
        derive(read_urdf(tmp_path / "arm.urdf"), "a", "b", "standard", "urdf:pinocchio")


@pytest.mark.parametrize("robot", ["humanoid_arm", "panda", "sixr", "stanford", "ur5"])
def test_exported_urdfs_are_the_table(models: dict[str, RobotModel], tmp_path: Path, robot: str) -> None:
    """Out as a URDF and checked against the table it came from, every DH frame, for all configurations."""
    model = models[robot]
    folder = tmp_path / "models" / robot
    folder.mkdir(parents=True)
    (folder / "arm.urdf").write_text(export_urdf(model))
    text = (model.folder / "model.toml").read_text().split("[tolerance]")[0]
    head, _, _ = text.partition("[urdf]")
    (folder / "model.toml").write_text(
        head.replace('convention = "', 'gate = "certified"\nconvention = "')
        + '[urdf]\nfile = "arm.urdf"\n[tolerance]\nposition = 1e-10\nrotation = 1e-10\n[[source]]\nname = "urdf:pinocchio"\n'
    )
    (folder / "dh.csv").write_text((model.folder / "dh.csv").read_text())
    (folder / "configurations.toml").write_text("")
    entries = [("base", "dh_base"), *((str(i), f"dh_{i}") for i in range(len(model.table.rows) + 1)), ("tool", "dh_tool")]
    if np.array_equal(model.table.base, np.eye(4)):
        entries = entries[1:]
    frames = "".join(f'[[frame]]\nname = "{link}"\ndh = "{label}"\nurdf = "{link}"\n' for label, link in entries)
    (folder / "frames.toml").write_text(frames)
    report = crosscheck(load_model(folder), Options(samples=100, seed=0))
    assert report.verdict.exit_code == 0, report.verdict.sentence
    assert len(report.sources[1].frames) == len(entries)


def test_export_urdf_command(cli: Cli, tmp_path: Path) -> None:
    printed = cli("export-urdf", "sixr")
    assert printed.returncode == 0
    cli("export-urdf", "sixr", "--out", "sixr.urdf")
    assert (tmp_path / "sixr.urdf").read_text() == printed.stdout
    shown = cli("frames", "sixr.urdf")
    assert shown.returncode == 0
    assert "joint4_link" in shown.stdout


def test_a_calibrated_arm_with_nearly_parallel_axes() -> None:
    """Factory calibration of a real UR10e: d of hundreds of metres. Named as ill-determined, and still the same mechanism."""
    theta = [
        -2.4147806894359e-07,
        1.60233952386695,
        -1.68607190752171,
        0.0837331147700119,
        -1.01260355871158e-07,
        3.91986209186124e-08,
    ]
    a = [2.12234865571206e-05, 0.0193171326277006, -0.569251663611088, -4.61409023720934e-05, -6.39280053471802e-05, 0.0]
    d = [0.180539811714259, 439.140974079901, -446.027059806332, 7.0603368964236, 0.119811341150314, 0.115670917257426]
    alpha = [1.57014608044242, 0.0013941666682559, 0.00693818880325995, 1.56998468543761, -1.57038520649543, 0.0]
    table = DHTable(tuple(DHRow(name=f"j{i}", kind="revolute", a=a[i], alpha=alpha[i], d=d[i], theta=theta[i]) for i in range(6)))
    found = screws(chain_of(table), [False] * 6, np.random.default_rng(0))
    form = canonical(found, [False] * 6, "standard", list(table.joints))
    assert [row.d for row in form.rows[1:4]] == pytest.approx(d[1:4], rel=1e-8)
    q = np.random.default_rng(1).uniform(-3, 3, (20, 6))
    assert_placements_close(chain_of(DHTable(form.rows, "standard", form.base, form.tool))(q), chain_of(table)(q), 1e-9)


def test_nearly_parallel_axes_are_named() -> None:
    rows = tuple(
        DHRow(name=f"j{i}", kind="revolute", a=0.5, alpha=alpha, d=0.1, theta=0.0)
        for i, alpha in enumerate((1e-5, math.pi / 2, 0.0))
    )
    found = screws(chain_of(DHTable(rows)), [False] * 3, np.random.default_rng(0))
    free = canonical(found, [False] * 3, "standard", ["j0", "j1", "j2"]).free
    assert free == ("j0 and j1 are parallel to within 1.0e-05 rad: d is ill-determined",)
