"""The packaged robot models, and everything that can be wrong with one: one clear error each."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.description.locate import default_models_dir, find_model, locate_urdf, model_folders
from harness.description.model import RobotModel, load_model
from harness.errors import CrosscheckError, DescriptionUnavailable, InputError, ModelFileError
from harness.run.options import Options
from harness.run.plan import plan
from harness.verdict.deviations import deviation_on_file
from tests.helpers import Edit, crosscheck

NINE = ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"]


def test_the_nine_are_there(models: dict[str, RobotModel]) -> None:
    assert sorted(models) == NINE
    assert {m.table.convention for m in models.values()} == {"standard", "modified"}
    assert {"prismatic", "fixed"} <= {row.kind for m in models.values() for row in m.table.rows}


@pytest.mark.parametrize("robot", NINE)
def test_every_dh_frame_and_every_link_of_the_chain_is_mapped(models: dict[str, RobotModel], robot: str) -> None:
    assert models[robot].unmapped() == ([], [])


def test_published_values_are_on_file(models: dict[str, RobotModel]) -> None:
    on_file = {
        robot: [claim.status for c in model.configurations.fixed for claim in c.published] for robot, model in models.items()
    }
    assert on_file["ur5"] == ["holds"] * 11  # A1 ... A6 and T0_2 ... T0_6
    assert on_file["humanoid_arm"] == ["wrong"] * 3
    assert on_file["sixr"] == ["holds"] * 2
    named = {c.name for c in models["ur5"].configurations.fixed}
    assert {"zero", "article", "article, second", "article, third"} <= named


UR5_ERRORS: list[tuple[Edit, str]] = [
    (
        ("model.toml", "convention", "convension"),
        r"model.toml: convension: unknown key; did you mean 'convention'\? \(and 1 more",
    ),
    (("model.toml", '"standard"', '"standart"'), "model.toml: convention: input should be 'standard' or 'modified'"),
    (
        ("model.toml", "[tolerance]\nposition = 1e-10", "[tolerance]\nposition = nan"),
        "tolerance.position: expected a finite number",
    ),
    (
        ("model.toml", "[tolerance]\nposition = 1e-10", "[tolerance]\nposition = -1"),
        "tolerance.position: input should be greater",
    ),
    (("model.toml", "[tolerance]\nposition = 1e-10", '[tolerance]\nposition = "1 mm"'), "tolerance.position: expected a number"),
    (("model.toml", "[tolerance]\nposition = 1e-10", "[tolerance]\nposition = true"), "tolerance.position: expected a number"),
    (("model.toml", 'name = "ur5"', 'name = "../ur5"'), "model.toml: name: string should match pattern"),
    (("model.toml", 'name = "ur5"', 'name = "index"'), "model.toml: name: expected a name other than index, report.schema"),
    (("model.toml", 'name = "ur5"', "name = 5"), "model.toml: name: input should be a valid string, got 5"),
    (("model.toml", "[tolerance]", "[tolerance"), r"model.toml: not TOML: .*line"),
    (("model.toml", "dh:pinocchio", "urdf:pinocchio"), r"source\[1\].name: source 'urdf:pinocchio' is there twice"),
    (("model.toml", "ur5_robot.urdf", "ur5_robot.udrf"), r"urdf.file: no such file .*did you mean '.*ur5_robot.urdf'"),
    (("model.toml", "", "name = 'x'\n"), "model.toml: description: required key is missing"),
    (
        ("frames.toml", 'urdf = "tool0"', 'urdf = "tool_0"'),
        r"frame\[9\].urdf: no link 'tool_0' in ur5_robot.urdf; did you mean 'tool0'",
    ),
    (("frames.toml", 'urdf = "tool0"', 'urdf = "base"'), r"frame\[9\].urdf: link 'base' is mapped twice, first by frame\[0\]"),
    (("frames.toml", 'name = "tool0"', 'name = "base"'), r"frame\[9\].name: frame name 'base' is mapped twice"),
    (
        ("frames.toml", 'dh = 6\nurdf = "tool0"', 'dh = 7\nurdf = "tool0"'),
        r"frame\[9\].dh: no DH frame '7' in dh.csv: expected base, 0 to 6, or tool",
    ),
    (("frames.toml", 'of = "base"', 'of = "bas"'), r"frame\[1\].of: no frame 'bas' in this file; did you mean 'base'"),
    (("frames.toml", 'of = "base"', 'of = "shoulder_link"'), r"frame\[1\].of: 'shoulder_link' is rigid"),
    (("frames.toml", 'of = "base"\n', 'of = "world"\n'), "frames refer to each other in a circle"),
    (
        ("frames.toml", 'dh = 0\nurdf = "base"', 'dh = 0\nurdf = "base"\nxyz = [0, 0, 0]'),
        "expected an entry with dh = 'base' or '0'",
    ),
    (("frames.toml", "rigid = true", "ridgid = true"), r"frame\[3\].ridgid: unknown key; did you mean 'rigid'\?"),
    (("frames.toml", "rigid = true", "rigid = true\nxyz = [0, 0, 1]"), "'rigid' means the offset is measured"),
    (("frames.toml", "dh = 1\n", ""), "expected exactly one of 'dh' and 'of'"),
    (("frames.toml", 'rpy = [0, 0, "pi"]', 'rpy = [0, "pi"]'), r"frame\[1\].rpy: list should have at least 3 items"),
    (
        ("dh.csv", "elbow_joint", "elbow"),
        r"joints.elbow: joint 'elbow' of dh.csv is not in ur5_robot.urdf; did you mean 'elbow_joint'",
    ),
    (("dh.csv", "elbow_joint,revolute,-0.39225,0,0,0\n", ""), "no DH frame '6' in dh.csv: expected base, 0 to 5"),
    (
        ("dh.csv", "elbow_joint,revolute", "elbow_joint,prismatic"),
        "'elbow_joint' is prismatic in dh.csv, .* is revolute in the URDF",
    ),
    (("dh.csv", "elbow_joint,revolute", "elbow_joint,fixed"), "URDF joint 'elbow_joint' moves a mapped link, but no model joint"),
    (
        ("configurations.toml", "[30, -60, 90,", "[30, -60,"),
        r"configuration\[0\].q: expected 6 values \(shoulder_pan_joint.*got 5",
    ),
    (("configurations.toml", 'name = "article"', 'name = "upright"'), "configuration 'upright' is there twice"),
    (("configurations.toml", 'unit = "deg"', 'unit = "degree"'), r"configuration\[0\].unit: input should be 'rad' or 'deg'"),
    (("configurations.toml", 'status = "holds"', 'status = "hold"'), "status: input should be 'holds' or 'wrong', got 'hold'"),
    (("configurations.toml", 'status = "holds"', 'status = "wrong"'), "status = 'wrong' needs a reason"),
    (("configurations.toml", "dh = 1\n", "dh = 9\n"), r"configuration\[0\].published\[0\].dh: no DH frame 9"),
    (("configurations.toml", "[0, 1, 0, 0.089159],", "[0, 1, 0],"), "expected 3 or 4 rows of 4 numbers"),
]


@pytest.mark.parametrize(("edit", "message"), UR5_ERRORS)
def test_one_clear_error(copy_model: Callable[..., Path], edit: Edit, message: str) -> None:
    folder = copy_model("ur5", edit)
    with pytest.raises(InputError, match=message) as caught:
        load_model(folder)
    assert edit[0] in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (
            '[joints]\nelbo_joint = "elbow_joint"',
            r"joints.elbo_joint: no joint 'elbo_joint' in dh.csv; did you mean 'elbow_joint'",
        ),
        ('[joints]\nelbow_joint = "wrist_1_joint"', "URDF joint 'wrist_1_joint' is mapped twice"),
        ('[joints]\nelbow_joint = "world_joint"', "URDF joint 'world_joint' is fixed, it takes no value"),
        ("[joints.elbow_joint]\nsign = 2", "sign: input should be -1 or 1"),
        ("[joints.elbow_joint]\nsing = -1", "did you mean 'sign'"),
        ("[joints.elbow_joint]\ncoupling = {wrist_1 = 1}", "no other joint 'wrist_1'; did you mean 'wrist_1_joint'"),
        ("[joints.elbow_joint]\ncoupling = {elbow_joint = 1}", "no other joint 'elbow_joint'"),
    ],
)
def test_one_clear_error_in_the_joint_mapping(copy_model: Callable[..., Path], joints: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "frames.toml").open("a") as file:
        file.write(joints + "\n")
    with pytest.raises(InputError, match=message):
        load_model(folder)


@pytest.mark.parametrize(
    ("accepted", "message"),
    [
        ('source = "urdf:pinochio"\nframe = "tool0"\nposition = 1\nreason = "x"', "no source 'urdf:pinochio'; did you mean"),
        ('source = "urdf:pinocchio"\nframe = "tool"\nposition = 1\nreason = "x"', "no frame 'tool'; did you mean 'tool0'"),
        ('source = "urdf:pinocchio"\nframe = "tool0"\nreason = "x"', "expected the size of the deviation"),
        ('source = "urdf:pinocchio"\nframe = "tool0"\nposition = 1\nreason = ""', "reason: string should have at least 1"),
        ('source = "urdf:pinocchio"\nframe = ["tool0", "tool0"]\nposition = 1\nreason = "x"', "accepted twice"),
    ],
)
def test_one_clear_error_in_an_accepted_deviation(copy_model: Callable[..., Path], accepted: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "model.toml").open("a") as file:
        file.write(f"[[accepted]]\n{accepted}\n")
    with pytest.raises(InputError, match=message):
        plan(load_model(folder), Options())


def test_an_accepted_deviation_may_be_for_all_urdf_sources_or_one_not_listed(models: dict[str, RobotModel]) -> None:
    on_file = deviation_on_file(models["iiwa14"], "urdf:mujoco", "dh:numpy", "tool0")
    assert on_file is not None
    assert on_file[0].position == 0.00087248
    assert deviation_on_file(models["iiwa14"], "dh:pinocchio", "dh:numpy", "tool0") is None
    assert deviation_on_file(models["ur5"], "dh:roboticstoolbox-packaged", "dh:numpy", "tool0") is not None


def test_offsets_of_rigid_frames_come_from_whichever_source_has_them(models: dict[str, RobotModel]) -> None:
    """What the first source lacks is measured with the next, and not taken to be no offset at all."""
    command = (sys.executable, str(Path(__file__).parents[1] / "workers" / "faulty_worker.py"), "has a few links")
    partial = (("urdf:controller", command),)
    options = Options(samples=20, seed=0, sources=("urdf:controller", "urdf:pinocchio"), workers=partial, certify=False)
    report = crosscheck(models["ur3"], options)
    assert report.verdict.exit_code == 0
    measured = {f.name: f.measured_from for f in report.frames if f.relation == "rigid"}
    assert measured.pop("wrist_3_link") == "urdf:controller"
    assert set(measured.values()) == {"urdf:pinocchio"}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("urdf:ikpi", "no source 'urdf:ikpi'; did you mean 'urdf:ikpy'"),
        ("urdf:*", "no source 'urdf:"),
        ("dh:numpi", "did you mean 'dh:numpy'"),
    ],
)
def test_a_misspelt_engine_in_the_mapping(copy_model: Callable[..., Path], name: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "frames.toml").open("a") as file:
        file.write(f'[engine."{name}"]\nwithout = []\n')
    with pytest.raises(InputError, match=message):
        plan(load_model(folder), Options())


def test_the_reference_may_not_be_without_a_frame(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur5")
    with (folder / "frames.toml").open("a") as file:
        file.write('[engine."dh:numpy"]\nwithout = ["shoulder_link"]\n')
    report = crosscheck(load_model(folder), Options(samples=5, seed=0, sources=("dh:pinocchio",)))
    assert report.verdict.exit_code == 3
    assert "cannot be the reference: it does not have shoulder_link" in report.verdict.sentence


@pytest.mark.parametrize(
    ("engine", "message"),
    [
        ('base = "base_lnk"', r"engine.\"urdf:x\".base: no mapped frame 'base_lnk'; did you mean 'base_link'"),
        (
            'base = "tool0"',
            "expected a frame at a declared offset from DH frame base or 0, 'tool0' is not; choose among: base, base_link",
        ),
        ('base = "base_link"\nwithout = ["base_link"]', "'base_link' is the base and left out at once"),
        ('tip = "tol0"', "tip: no mapped frame 'tol0'; did you mean 'tool0'"),
        ('without = ["tol0"]', "no mapped frame 'tol0'; did you mean 'tool0'"),
        ('without = ["tool0", "wrist_3_link", "ee_link"]', "without: no mapped frame moves with joint 'wrist_3_joint'"),
        ('frames = { tool = "flange" }', "no mapped frame 'tool'; did you mean 'tool0'"),
        ('joints = { elbow = "j3" }', "no joint 'elbow'; did you mean 'elbow_joint'"),
        ('robot = ""', "robot"),
        ('bass = "base"', "did you mean 'base'"),
    ],
)
def test_one_clear_error_in_the_names_of_an_engine(copy_model: Callable[..., Path], engine: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "frames.toml").open("a") as file:
        file.write(f'[engine."urdf:x"]\n{engine}\n')
    with pytest.raises(InputError, match=message):
        load_model(folder)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ('name = "controller"', "expected the name of an engine such as dh:pinocchio, or a command, got 'controller' alone"),
        ('name = "controller"\ncommand = []', "command"),
        ('name = "dh:numpy"\ncommand = ["x"]', "dh:numpy: this is the name of an engine; give the command another"),
        ('name = "dh:nowhere"', "no source 'dh:nowhere'"),
    ],
)
def test_one_clear_error_in_a_source(copy_model: Callable[..., Path], entry: str, message: str) -> None:
    folder = copy_model("ur5")
    with (folder / "model.toml").open("a") as file:
        file.write(f"[[source]]\n{entry}\n")
    with pytest.raises(InputError, match=message):
        plan(load_model(folder), Options())


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_floating_and_planar_on_the_chain(copy_model: Callable[..., Path], kind: str) -> None:
    edit = ("humanoid_arm.urdf", 'name="gripper" type="fixed"', f'name="gripper" type="{kind}"')
    with pytest.raises(InputError, match=f"joint 'gripper' on the chain is {kind}"):
        load_model(copy_model("humanoid_arm", edit))


def test_a_prismatic_joint_without_a_range(copy_model: Callable[..., Path]) -> None:
    edit = ("stanford.urdf", 'lower="0" upper="1.5"', 'lower="0" upper="0"')
    with pytest.raises(ModelFileError, match="prismatic joint 'joint3' has no range"):
        load_model(copy_model("stanford", edit))


def test_only_fixed_rows(copy_model: Callable[..., Path]) -> None:
    with pytest.raises(ModelFileError, match="expected at least one joint that moves"):
        load_model(copy_model("ur5", ("dh.csv", ",revolute,", ",fixed,")))


def test_where_models_are_found(tmp_path: Path) -> None:
    models = default_models_dir()
    assert find_model("ur5", models) == models / "ur5"
    assert find_model(str(models / "ur3"), tmp_path) == models / "ur3"
    with pytest.raises(ModelFileError, match=r"no robot model 'ur55'; did you mean 'ur5'"):
        find_model("ur55", models)
    with pytest.raises(ModelFileError, match="no such folder of robot models"):
        model_folders(tmp_path / "absent")
    with pytest.raises(ModelFileError, match="found none"):
        model_folders(tmp_path)
    with pytest.raises(ModelFileError, match="no such robot model folder"):
        load_model(tmp_path / "absent")


def test_where_urdfs_are_found() -> None:
    folder = default_models_dir() / "ur5"
    assert locate_urdf("ur5e.urdf", None, folder).name == "ur5e.urdf"
    with pytest.raises(ModelFileError, match=r"no URDF 'ur5x\.urdf' under urdf/; did you mean 'ur5e.urdf'"):
        locate_urdf("ur5x.urdf", None, folder)
    with pytest.raises(DescriptionUnavailable, match="no-such-robots is not installed; pip install no-such-robots") as caught:
        locate_urdf("x.urdf", "no-such-robots", folder)
    assert caught.value.exit_code == 3
    with pytest.raises(ModelFileError, match="files end in it"):
        locate_urdf("LICENSE", "example-robot-data", folder)


def test_dh_only_model(copy_model: Callable[..., Path]) -> None:
    """A table without a URDF is still compared among DH sources."""
    folder = copy_model("sixr")
    text = (folder / "model.toml").read_text().split("[urdf]")[0]
    (folder / "model.toml").write_text(
        text + '[tolerance]\nposition = 1e-12\nrotation = 1e-12\n[[source]]\nname = "dh:pinocchio"\n'
    )
    (folder / "frames.toml").write_text('[[frame]]\nname = "base"\ndh = 0\n[[frame]]\nname = "tip"\ndh = "tool"\n')
    model = load_model(folder)
    assert (model.urdf, model.urdf_joints) == (None, None)
    assert np.array_equal(model.configurations.upper, np.full(6, np.pi))
    with (folder / "model.toml").open("a") as file:
        file.write('[[source]]\nname = "urdf:pinocchio"\n')
    with pytest.raises(CrosscheckError, match=r"'urdf:pinocchio' needs a \[urdf\] table"):
        load_model(folder)


def test_a_joint_that_no_mapped_frame_moves_with(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur5")
    (folder / "frames.toml").write_text('[[frame]]\nname = "base"\ndh = 0\n[[frame]]\nname = "wrist"\ndh = 5\n')
    with pytest.raises(ModelFileError, match="no mapped frame moves with joint 'wrist_3_joint'"):
        load_model(folder)
