"""The theorem in a run: what is proven of the files, for which sources it counts, and what the certified gate makes of it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.description.model import RobotModel, load_model
from harness.engines import registry
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import Registered
from harness.report.document import Report
from harness.report.proof_parts import Certificate, FrameBound
from harness.run.options import Options
from harness.run.proving import slides_of
from harness.se3 import Array
from tests.helpers import crosscheck

PINOCCHIO = ("urdf:pinocchio",)
CERTIFIED = ("model.toml", 'convention = "standard"', 'convention = "standard"\ngate = "certified"')


def certificate(report: Report, name: str) -> Certificate:
    """What counts for a source."""
    found = next(s.certificate for s in report.sources if s.name == name)
    assert found is not None
    return found


def at(report: Report, frame: str) -> FrameBound:
    """The theorem at a frame."""
    assert report.theorem is not None
    return next(bound for bound in report.theorem.frames if bound.frame == frame)


@pytest.mark.parametrize("robot", ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"])
def test_every_robot_has_a_theorem(models: dict[str, RobotModel], robot: str) -> None:
    report = crosscheck(models[robot], Options(samples=50, sources=PINOCCHIO, probe=False))
    assert report.theorem is not None
    mapped = [f.name for f in report.frames if f.urdf is not None]
    assert [b.frame for b in report.theorem.frames] == mapped
    proof = certificate(report, "urdf:pinocchio")
    assert (proof.status, proof.reason) == ("certified", "")
    for bound, frame in zip(proof.frames, report.sources[1].frames, strict=True):
        assert bound.frame == frame.frame
        assert frame.position.max <= bound.position_upper + 1e-12
        assert frame.rotation.max <= bound.rotation_upper + 1e-12
    assert "at every configuration" in report.verdict.sentence
    assert "(proven)" in report.verdict.sentence


def test_sources_of_one_description_have_nothing_to_be_proven(models: dict[str, RobotModel]) -> None:
    report = crosscheck(models["ur5"], Options(samples=20, sources=("dh:pinocchio",), probe=False))
    proof = certificate(report, "dh:pinocchio")
    assert {(b.position_upper, b.rotation_upper) for b in proof.frames} == {(0.0, 0.0)}


def test_equal_descriptions_are_said_to_be_equal(models: dict[str, RobotModel]) -> None:
    report = crosscheck(models["stanford"], Options(samples=20, sources=PINOCCHIO, probe=False))
    assert "the table and the URDF are equal at every configuration (proven)" in report.verdict.sentence
    again = crosscheck(models["sixr"], Options(samples=20, sources=PINOCCHIO, probe=False))
    assert again.verdict.sentence.count("by the digits of pi alone") == 1


def test_a_longer_d1_is_proven_exactly(copy_model: Callable[..., Path]) -> None:
    model = load_model(copy_model("ur5", ("dh.csv", "0.089159", "0.089460")))
    tool = at(crosscheck(model, Options(samples=0, sources=PINOCCHIO, explain=False, probe=False)), "tool0")
    assert tool.position_upper == pytest.approx(0.301e-3, rel=1e-7)
    assert tool.position_found == pytest.approx(0.301e-3, rel=1e-5)


def test_a_deviation_counts_whatever_the_samples(models: dict[str, RobotModel]) -> None:
    """The largest discrepancy of the files is found with no random configuration at all."""
    report = crosscheck(models["iiwa14"], Options(samples=0, sources=PINOCCHIO, probe=False))
    assert report.verdict.exit_code == 0
    assert max(b.position_found for b in certificate(report, "urdf:pinocchio").frames) == pytest.approx(2 * 0.00043624, rel=1e-5)
    assert "(accepted deviations aside)" in report.verdict.sentence


@pytest.mark.parametrize(("tolerance", "certify", "code"), [("1e-11", True, 0), ("5e-12", True, 1), ("1e-11", False, 1)])
def test_the_certified_gate_needs_no_slack(copy_model: Callable[..., Path], tolerance: str, certify: bool, code: int) -> None:
    """UR5 against its URDF: 5.8e-12 m. 1e-11 is enough; rounding needed several times as much before."""
    folder = copy_model("ur5", CERTIFIED)
    path = folder / "model.toml"
    text = re.sub(r"position = [0-9.e-]+", f"position = {tolerance}", path.read_text())
    path.write_text(text)
    report = crosscheck(load_model(folder), Options(samples=20, sources=PINOCCHIO, certify=certify, explain=False, probe=False))
    assert report.verdict.exit_code == code, report.verdict.sentence


class Clamped(DHNumpy):
    source = "dh:fake"

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.clip(q, -3.3, 3.3), frames)


def test_an_engine_that_clamps_gets_no_bound(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    """Sampled inside the limits nothing is seen; tested against its own description it is."""
    known = {**registry.registered(), "dh:fake": Registered("dh:fake", Clamped)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    report = crosscheck(models["sixr"], Options(samples=100, sources=("dh:fake",), explain=False))
    proof = certificate(report, "dh:fake")
    assert report.verdict.exit_code == 1
    assert (proof.status, proof.frames) == ("refused", [])
    assert "dh:fake does not compute what its description says" in proof.reason


def test_slides_without_sane_limits_have_a_stated_range(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("stanford", ("stanford.urdf", 'lower="0"', 'lower="-999999"'))
    urdf = folder.parent.parent / "urdf" / "stanford.urdf"
    urdf.write_text(urdf.read_text().replace('upper="1.5"', 'upper="999999"'))
    model = load_model(folder)
    assert slides_of(model) == {"joint3": (-10.0, 10.0)}
    report = crosscheck(model, Options(samples=200, sources=PINOCCHIO, probe=False))
    assert report.verdict.exit_code == 0, report.verdict.sentence
    assert report.theorem is not None
    assert report.theorem.slides["joint3"].upper == 10.0


def test_a_slide_in_another_direction_has_a_slope(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("stanford")
    urdf = folder.parent.parent / "urdf" / "stanford.urdf"
    head, tail = urdf.read_text().split('<joint name="joint3"')
    urdf.write_text(head + '<joint name="joint3"' + tail.replace('<axis xyz="0 1 0"', '<axis xyz="0 1 0.001"', 1))
    report = crosscheck(load_model(folder), Options(samples=20, sources=PINOCCHIO, explain=False, probe=False))
    tip = at(report, "tip")
    assert tip.slope == pytest.approx(1e-3, rel=0.5)
    assert report.verdict.exit_code == 1


def test_nearly_parallel_axes_agree_and_are_pointed_out(tmp_path: Path, copy_model: Callable[..., Path]) -> None:
    """d of 20 km that cancel: float64 has no 1e-13 m left, and the table says why."""
    folder = copy_model("sixr", ("dh.csv", "", TWO_PARALLEL), ("frames.toml", "", FRAMES), ("configurations.toml", "", "\n"))
    urdf = folder.parent.parent / "urdf" / "sixr.urdf"
    urdf.write_text(PARALLEL)
    text = (folder / "model.toml").read_text()
    (folder / "model.toml").write_text(text.replace('convention = "modified"', 'convention = "standard"'))
    model = load_model(folder)
    assert [s.where for s in model.suspects] == ["dh.csv:2: a d", "dh.csv:3: b d"]
    assert "ill-determined" in model.suspects[0].why
    report = crosscheck(model, Options(samples=300, sources=("dh:pinocchio", "urdf:pinocchio"), probe=False))
    assert report.verdict.exit_code == 0, report.verdict.sentence


TWO_PARALLEL = """joint,a,alpha,d,theta
a,0.3,4e-6,20000,0
b,0.2,-4e-6,-20000,0
c,0.2,pi/2,0.1,0
"""
FRAMES = """[[frame]]
name = "base"
dh = 0
urdf = "w"
[[frame]]
name = "end"
dh = 3
urdf = "end"
"""
PARALLEL = """<robot name="p"><link name="w"/><link name="one"/><link name="two"/><link name="three"/><link name="end"/>
<joint name="a" type="revolute"><parent link="w"/><child link="one"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0.3 0 20000" rpy="4e-6 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="c" type="revolute"><parent link="two"/><child link="three"/><origin xyz="0.2 0 -20000" rpy="-4e-6 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="t" type="fixed"><parent link="three"/><child link="end"/>
<origin xyz="0.2 0 0.1" rpy="1.5707963267948966 0 0"/></joint></robot>"""
