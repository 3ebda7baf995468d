"""The gate end to end: faults made in a copy of a model are caught and located; what must not pass does not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from harness.description.model import RobotModel, load_model
from harness.engines import registry, requirements
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import Registered
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.errors import InputError
from harness.report.document import Report, Source
from harness.report.json_file import to_json
from harness.report.verdicts import Verdict
from harness.run.options import Options
from harness.se3 import Array
from tests.conftest import WITHOUT
from tests.helpers import Edit, crosscheck, remade

FAST = ("dh:pinocchio", "urdf:pinocchio")


def check(folder: Path, *sources: str, samples: int = 200) -> Report:
    return crosscheck(load_model(folder), Options(samples=samples, seed=0, sources=sources or FAST))


def source(report: Report, name: str) -> Source:
    return next(s for s in report.sources if s.name == name)


@pytest.mark.parametrize("robot", ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"])
def test_all_robots_agree_in_all_engines(models: dict[str, RobotModel], robot: str) -> None:
    model = models[robot]
    wanted = [entry.name for entry in model.file.source if entry.name not in WITHOUT]
    report = crosscheck(model, Options(samples=2000, seed=0, sources=tuple(wanted)))
    assert report.verdict.exit_code == 0, report.verdict.reasons
    assert {s.name for s in report.sources} == {"dh:numpy", *wanted}
    assert all(s.status == "ran" for s in report.sources)
    compared = {f.frame for s in report.sources if s.name == "urdf:pinocchio" for f in s.frames}
    assert compared == {f.name for f in report.frames if f.urdf is not None}
    assert all(s.validity is not None and s.validity.invalid == 0 for s in report.sources)


def test_ur5_to_the_noise_floor_of_each_source(models: dict[str, RobotModel]) -> None:
    model = models["ur5"]
    wanted = tuple(entry.name for entry in model.file.source if entry.name not in WITHOUT)
    report = crosscheck(model, Options(samples=2000, seed=0, sources=wanted))
    limits = {"dh:pinocchio": 1e-14, "urdf:pinocchio": 1e-11, "urdf:yourdfpy": 1e-11, "urdf:pytorch-kinematics": 1e-7}
    noise = {"dh:pinocchio": "float64", "urdf:pinocchio": "pi-12-digits", "urdf:pytorch-kinematics": "float32"}
    for name in wanted:
        assert max(f.position.max for f in source(report, name).frames) < limits[name]
        assert source(report, name).noise == noise.get(name, "pi-12-digits")


SWAP: list[Edit] = [
    ("dh.csv", "wrist_1_joint", "SWAPPED"),
    ("dh.csv", "wrist_2_joint", "wrist_1_joint"),
    ("dh.csv", "SWAPPED", "wrist_2_joint"),
]
BASE_LINK_FOR_BASE: list[Edit] = [
    ("frames.toml", 'urdf = "base_link"\nof = "base"\nrpy = [0, 0, "pi"]', 'urdf = "X"\nof = "base"\nxyz = [0, 0, 0]'),
    ("frames.toml", 'urdf = "base"', 'urdf = "base_link"'),
    ("frames.toml", 'urdf = "X"', 'urdf = "base"'),
]
EE_LINK_FOR_TOOL0: list[Edit] = [
    ("frames.toml", 'urdf = "tool0"', 'urdf = "X"'),
    ("frames.toml", 'urdf = "ee_link"', 'urdf = "tool0"'),
    ("frames.toml", 'urdf = "X"', 'urdf = "ee_link"'),
]
FIRST_ENTRY = '[[frame]]\nname = "base"\n'


def joint_entry(toml: str) -> Edit:
    """Put a `[joints]` table in front of frames.toml."""
    return ("frames.toml", FIRST_ENTRY, toml + FIRST_ENTRY)


COUPLED = joint_entry("[joints.elbow_joint.coupling]\nshoulder_lift_joint = 1\n")
LIMIT = '\n    <limit lower="0"'


class Fault(NamedTuple):
    """A fault made in a model: where it first shows, a frame that must be caught, and its largest position error there."""

    robot: str
    edits: list[Edit]
    first: str
    frame: str
    size: float | None = None


FAULTS = {
    "d1 + 0.301 mm": Fault("ur5", [("dh.csv", "0.089159", "0.089460")], "upper_arm_link", "tool0", 0.301e-3),
    "alpha1 sign": Fault("ur5", [("dh.csv", "revolute,0,pi/2,0.089", "revolute,0,-pi/2,0.089")], "upper_arm_link", "tool0"),
    "base is base_link": Fault("ur5", BASE_LINK_FOR_BASE, "base_link", "tool0"),
    "tool0 is ee_link": Fault("ur5", EE_LINK_FOR_TOOL0, "tool0", "tool0", 0.0),
    "one joint's sign": Fault("ur5", [joint_entry("[joints.elbow_joint]\nsign = -1\n")], "forearm_link", "tool0"),
    "degrees": Fault("ur5", [("dh.csv", "pi/2", "90")], "upper_arm_link", "tool0"),
    "standard read as modified": Fault("ur5", [("model.toml", '"standard"', '"modified"')], "shoulder_link", "tool0"),
    "modified read as standard": Fault("panda", [("model.toml", '"modified"', '"standard"')], "panda_link2", "panda_link8"),
    "a 150 mm tool left out": Fault(
        "sixr", [("model.toml", "xyz = [0.18, 0, 0.1]", "xyz = [0.18, 0, -0.05]")], "tool", "tool", 0.15
    ),
    "two joints swapped": Fault("ur5", SWAP, "wrist_1_link", "tool0"),
    "nothing to see at q = 0": Fault("ur5", [COUPLED], "forearm_link", "tool0"),
    "prismatic axis flipped": Fault(
        "stanford", [("stanford.urdf", f'"0 1 0"/>{LIMIT}', f'"0 -1 0"/>{LIMIT}')], "link3", "tip", 3.0
    ),
    "a fixed row's d": Fault("humanoid_arm", [("dh.csv", "fixed,0,0,0.06", "fixed,0,0,0")], "gripper_link", "gripper_link", 0.06),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_caught_and_located(copy_model: Callable[..., Path], name: str) -> None:
    fault = FAULTS[name]
    report = check(copy_model(fault.robot, *fault.edits))
    found = source(report, "urdf:pinocchio")
    assert report.verdict.exit_code == 1
    assert found.verdict is Verdict.DISAGREES
    assert found.first_disagreeing_frame == fault.first
    result = next(f for f in found.frames if f.frame == fault.frame)
    assert result.verdict is Verdict.DISAGREES
    if fault.size is not None:
        assert result.position.max == pytest.approx(fault.size, rel=1e-3, abs=1e-9)
    # The reproducer really shows it: recomputed here from its q alone.
    r = found.reproducer
    assert r is not None
    assert r.position > found.tolerance.position or r.rotation > found.tolerance.rotation
    T_a, T_b = np.array(r.reference_placement), np.array(r.source_placement)
    assert np.linalg.norm(T_a[:3, 3] - T_b[:3, 3]) == pytest.approx(r.position)
    assert np.isfinite(T_a).all()
    # Where the worst q is, the statistics say; it is one of the configurations of the run.
    worst = result.position.worst
    assert worst is not None
    assert len(worst.q) == len(report.robot.joints)


def test_what_q_zero_does_not_show(copy_model: Callable[..., Path]) -> None:
    """The same fault with nothing but q = 0 looked at would pass: the other configurations catch it."""
    found = source(check(copy_model("ur5", COUPLED)), "urdf:pinocchio")
    assert found.reproducer is not None
    moved = [name for name, value in zip(found.joints, found.reproducer.q, strict=True) if value]
    assert moved == ["shoulder_lift_joint"]  # shrunk to the one joint that matters


def test_dh_sources_agree_whatever_the_urdf_says(copy_model: Callable[..., Path]) -> None:
    report = check(copy_model("ur5", ("dh.csv", "0.089159", "0.089460")))
    assert source(report, "dh:pinocchio").verdict is Verdict.AGREES


def test_a_rigid_frame_that_is_not_rigid(copy_model: Callable[..., Path]) -> None:
    """forearm_link declared to ride on DH frame 2: its offset cannot be constant."""
    report = check(copy_model("ur5", ("frames.toml", 'dh = 3\nurdf = "forearm_link"', 'dh = 2\nurdf = "forearm_link"')))
    assert report.verdict.exit_code == 1
    assert [f.frame for f in source(report, "urdf:pinocchio").frames if f.verdict is Verdict.DISAGREES] == ["forearm_link"]


def test_a_rigid_offset_is_measured_to_rounding(models: dict[str, RobotModel]) -> None:
    report = crosscheck(models["ur5"], Options(samples=10, seed=0, sources=FAST))
    frame = next(f for f in report.frames if f.name == "upper_arm_link")
    assert (frame.relation, frame.measured_from) == ("rigid", "urdf:pinocchio")
    offset = np.array(frame.offset)
    assert offset[:3, 3] == pytest.approx([0.425, 0.0, 0.13585], abs=1e-10)  # from the far end back to the shoulder
    assert offset[:3, :3].T @ offset[:3, :3] == pytest.approx(np.eye(3), abs=1e-14)


# Published values --------------------------------------------------------------------------------


def test_published_values(models: dict[str, RobotModel]) -> None:
    ur5 = crosscheck(models["ur5"], Options(samples=0, seed=0, sources=("dh:pinocchio",)))
    assert [p.found for p in ur5.published] == ["holds"] * 11
    humanoid = crosscheck(models["humanoid_arm"], Options(samples=0, seed=0, sources=("dh:pinocchio",)))
    assert humanoid.verdict.exit_code == 0
    computed = [[row[3] for row in p.computed[:3]] for p in humanoid.published]
    expected = [[0.630, -0.060, 0.050], [0.300, -0.060, 0.380], [0.491726, 0.200261, 0.185065]]
    assert np.array(computed) == pytest.approx(np.array(expected), abs=5e-7)
    assert [p.found for p in humanoid.published] == ["wrong"] * 3
    third = np.degrees(humanoid.published[2].computed_rpy)
    assert third == pytest.approx([90, -51.566, 28.648], abs=1e-3)


@pytest.mark.parametrize(
    ("robot", "edit"),
    [
        ("ur5", ("configurations.toml", 'status = "holds"', 'status = "wrong"\nreason = "a test"')),
        ("humanoid_arm", ("configurations.toml", 'status = "wrong"', 'status = "holds"')),
        ("ur5", ("configurations.toml", "0.089159]", "0.089162]")),
    ],
)
def test_a_flipped_status_or_a_changed_value_fails_the_gate(copy_model: Callable[..., Path], robot: str, edit: Edit) -> None:
    report = check(copy_model(robot, edit), samples=0)
    assert report.verdict.exit_code == 1
    assert "published placement of DH frame" in report.verdict.sentence


# Accepted deviations -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edit", "verdict"),
    [
        (("model.toml", "position = 0.00087248", "position = 0.00090"), "deviation changed"),
        (("model.toml", "position = 0.00087248", "position = 0.00080"), "deviation changed"),
        (("dh.csv", "joint_a7,revolute,0,pi/2", "joint_a7,revolute,0.001,pi/2"), "deviation changed"),
        (("model.toml", '"link_2", "link_3"', '"link_1", "link_2", "link_3"'), "deviation vanished"),
    ],
)
def test_accepted_deviations_are_strict(copy_model: Callable[..., Path], edit: Edit, verdict: str) -> None:
    report = check(copy_model("iiwa14", edit), samples=2000)
    assert report.verdict.exit_code == 1
    assert verdict in {f.verdict for f in source(report, "urdf:pinocchio").frames}
    assert verdict in report.verdict.sentence


def test_a_deviation_belongs_to_the_source_not_to_the_reference(models: dict[str, RobotModel]) -> None:
    """Seen from the URDF the table deviates by the same amount, and two URDF sources agree."""
    report = crosscheck(
        models["iiwa14"], Options(samples=2000, seed=0, sources=("dh:numpy", "urdf:yourdfpy"), reference="urdf:pinocchio")
    )
    assert report.verdict.exit_code == 0
    assert source(report, "dh:numpy").verdict is Verdict.AGREES_AS_ACCEPTED
    assert source(report, "urdf:yourdfpy").verdict is Verdict.AGREES


# Sources that are missing, broken or wrong -------------------------------------------------------


class Fake(DHNumpy):
    """The in-house FK as an engine of its own, to be broken in one way each."""

    source = "dh:fake"


class Missing(Fake):
    requirements = ("no-such-distribution",)

    def __init__(self, description: object) -> None:
        requirements.check(type(self))


class Refuses(Fake):
    def __init__(self, description: object) -> None:
        raise RuntimeError("cannot read this table")


class RaisesLate(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        if len(q) < 500 and np.any(q):
            return super()._placements(q, frames)
        raise ZeroDivisionError("in the middle")


class Nan(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        T = super()._placements(q, frames)
        T[-1, -1, 0, 3] = np.nan
        return T


class NotARotation(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        T = super()._placements(q, frames).copy()
        T[..., 2, :3] *= -1
        return T


class WrongShape(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(q, frames)[:, :-1]


class LacksFrames(Fake):
    def __init__(self, description: object) -> None:
        super().__init__(description)  # type: ignore[arg-type]
        self.joints = (*self.joints[:-1], "elsewhere")


@pytest.fixture
def with_fake(monkeypatch: pytest.MonkeyPatch) -> Callable[[type[Engine]], None]:
    def register(adapter: type[Engine]) -> None:
        known = {**registry.registered(), "dh:fake": Registered("dh:fake", adapter)}
        monkeypatch.setattr(registry, "registered", lambda: known)

    return register


@pytest.mark.parametrize(
    ("adapter", "status", "verdict", "code", "reason"),
    [
        (Fake, "ran", "agrees", 0, ""),
        (Missing, "not run", "not run", 3, "no-such-distribution is not installed"),
        (Refuses, "failed", "failed", 3, "RuntimeError: cannot read this table"),
        (RaisesLate, "failed", "failed", 3, "ZeroDivisionError: in the middle (configurations 0 to 617)"),
        (WrongShape, "failed", "failed", 3, "expected placements float64"),
        (LacksFrames, "failed", "failed", 3, "has a joint 'elsewhere' that the description does not"),
        (Nan, "ran", "invalid placements", 1, ""),
        (NotARotation, "ran", "invalid placements", 1, ""),
    ],
)
def test_an_engine_that_goes_wrong_is_that_engines_result(
    models: dict[str, RobotModel],
    with_fake: Callable[[type[Engine]], None],
    adapter: type[Engine],
    status: str,
    verdict: str,
    code: int,
    reason: str,
) -> None:
    with_fake(adapter)
    report = crosscheck(models["ur5"], Options(samples=600, seed=0, sources=("dh:fake", "dh:pinocchio")))
    fake = source(report, "dh:fake")
    assert (fake.status, fake.verdict, report.verdict.exit_code) == (status, verdict, code)
    assert reason in fake.reason
    assert source(report, "dh:pinocchio").verdict is Verdict.AGREES  # the others are not harmed
    if status != "ran":
        assert not fake.frames
        assert all("dh:fake" not in (p.a, p.b) for p in report.pairs)


@pytest.mark.parametrize(("required", "code"), [(True, 3), (False, 0)])
@pytest.mark.parametrize("adapter", [Missing, Refuses])
def test_required_and_optional(
    copy_model: Callable[..., Path],
    with_fake: Callable[[type[Engine]], None],
    adapter: type[Engine],
    required: bool,
    code: int,
) -> None:
    with_fake(adapter)
    folder = copy_model("ur5")
    text = (folder / "model.toml").read_text().split("[[source]]")[0]
    text += f'[[source]]\nname = "dh:pinocchio"\n[[source]]\nname = "dh:fake"\nrequired = {str(required).lower()}\n'
    (folder / "model.toml").write_text(text)
    report = crosscheck(load_model(folder), Options(samples=10))
    assert report.verdict.exit_code == code
    assert "dh:fake" in report.verdict.sentence
    status = source(report, "dh:fake").status
    assert f"; {status}: dh:fake" in report.verdict.sentence or f"is required and {status}" in report.verdict.sentence


def test_an_optional_source_that_disagrees_still_fails(
    copy_model: Callable[..., Path], with_fake: Callable[[type[Engine]], None]
) -> None:
    class Shifted(Fake):
        def _placements(self, q: Array, frames: Sequence[str]) -> Array:
            T = super()._placements(q, frames)
            T[..., 2, 3] += 1e-6
            return T

    with_fake(Shifted)
    folder = copy_model("ur5", ("model.toml", 'name = "dh:pinocchio"', 'name = "dh:fake"\nrequired = false'))
    report = crosscheck(load_model(folder), Options(samples=10))
    assert report.verdict.exit_code == 1


def test_when_the_reference_is_missing_nothing_is_verified(
    models: dict[str, RobotModel], with_fake: Callable[[type[Engine]], None]
) -> None:
    for adapter in (Missing, RaisesLate):
        with_fake(adapter)
        report = crosscheck(models["ur5"], Options(samples=600, seed=0, sources=("dh:pinocchio",), reference="dh:fake"))
        assert report.verdict.exit_code == 3
        assert all(not s.frames for s in report.sources)
        assert source(report, "dh:pinocchio").status == "not run"


def test_when_every_optional_source_is_missing_nothing_passes(
    copy_model: Callable[..., Path], with_fake: Callable[[type[Engine]], None]
) -> None:
    with_fake(Missing)
    folder = copy_model("ur5")
    text = (folder / "model.toml").read_text().split("[[source]]")[0]
    (folder / "model.toml").write_text(text + '[[source]]\nname = "dh:fake"\nrequired = false\n')
    report = crosscheck(load_model(folder), Options(samples=10))
    assert report.verdict.exit_code == 3
    assert "no source was compared" in report.verdict.sentence


class DropsTool(UrdfPinocchio):
    def __init__(self, description: object) -> None:
        super().__init__(description)  # type: ignore[arg-type]
        self.frames = tuple(f for f in self.frames if f != "tool0")


def test_an_engine_that_lacks_a_mapped_link_does_not_agree(
    models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    known = {**registry.registered(), "urdf:pinocchio": Registered("urdf:pinocchio", DropsTool)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    report = crosscheck(models["ur5"], Options(samples=10, seed=0, sources=("urdf:pinocchio",)))
    assert report.verdict.exit_code == 1
    assert "frame tool0 was not compared" in report.verdict.sentence


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": -1}, "expected samples >= 0"),
        ({"seed": -1}, "expected 0 <= seed"),
        ({"sources": ("dh:numpi",)}, "no source 'dh:numpi'; did you mean 'dh:numpy'"),
        ({"reference": "dh:nothing"}, "no source 'dh:nothing'"),
        ({"sources": ("dh:numpy",)}, "nothing to compare with the reference dh:numpy"),
    ],
)
def test_wrong_options(models: dict[str, RobotModel], options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        crosscheck(models["ur5"], Options(**{"samples": 1, **options}))  # type: ignore[arg-type]


def test_the_same_command_twice_gives_the_same_numbers(models: dict[str, RobotModel]) -> None:
    wanted = tuple(entry.name for entry in models["ur5"].file.source if entry.name not in WITHOUT)
    first, second = (crosscheck(models["ur5"], Options(samples=300, seed=5, sources=wanted)) for _ in range(2))
    same = {"environment": first.environment}
    assert to_json(remade(first, **same)) == to_json(remade(second, **same))
    other = remade(crosscheck(models["ur5"], Options(samples=300, seed=6, sources=wanted)), **same)
    assert to_json(remade(first, **same)) != to_json(other)


def test_tolerances_add_up_against_another_reference(models: dict[str, RobotModel]) -> None:
    report = crosscheck(
        models["ur5"],
        Options(samples=50, seed=0, sources=("dh:numpy", "dh:pinocchio", "urdf:yourdfpy"), reference="urdf:pinocchio"),
    )
    assert report.verdict.exit_code == 0
    assert source(report, "dh:numpy").tolerance.position == 1e-10
    assert source(report, "dh:pinocchio").tolerance.position == pytest.approx(1e-10 + 1e-13)
    assert source(report, "urdf:yourdfpy").tolerance.position == pytest.approx(2e-10)


def test_a_dh_frame_without_a_link_is_left_out_against_a_urdf_reference(models: dict[str, RobotModel]) -> None:
    """Stanford's dh0 has no link: no fault of the table's, and none of the URDF's."""
    report = crosscheck(
        models["stanford"], Options(samples=20, seed=0, sources=("dh:numpy", "dh:pinocchio"), reference="urdf:pinocchio")
    )
    assert report.verdict.exit_code == 0, report.verdict.reasons
    assert "dh0" not in {f.frame for f in source(report, "dh:numpy").frames}
    report = crosscheck(models["stanford"], Options(samples=20, seed=0, sources=FAST))
    assert "dh0" in {f.frame for f in source(report, "dh:pinocchio").frames}
