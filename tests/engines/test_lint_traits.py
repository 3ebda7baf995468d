"""What the traits say of each finding of the lint, against what each engine really does: refuse, misread, or read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from harness import se3
from harness.description.finding import Finding
from harness.description.urdf import UrdfText
from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import lint
from harness.engines.base import LintTrait, Misreading, Refusal
from harness.engines.lint_traits import NOT_IN_TEXT, effect_of, messages, refused_for
from harness.engines.refusals import TEXTS
from harness.engines.registry import adapter_of, registered
from harness.errors import EngineFailed
from harness.se3 import Array
from harness.workers.pool import Workers
from tests.conftest import engines
from tests.engines.test_engines import ALL, STEP, URDF_ENGINES, joint, placement, turn

HERE = Path("case.urdf")
LIMIT = "<limit lower='-9' upper='9' effort='1' velocity='1'/>"
FIXED = joint("f", 2, "fixed", None).replace(LIMIT, "")
TURNED = STEP @ turn((0, 0, 1), 0.7)
SLID = STEP @ se3.translation((0, 0, 0.7))


@dataclass(frozen=True)
class Case:
    """A URDF with one finding; where link `frame` is if the joint `j` is at 0.7, by the specification; None: not asked."""

    text: str
    placed: Array | None = None
    frame: str = "l1"
    joint_type: str = ""


def robot(*joints: str, head: str = "<robot name='r'>") -> str:
    links = "".join(f"<link name='{name}'/>" for name in ["root", *(f"l{i + 1}" for i in range(len(joints)))])
    return f"{head}{links}{''.join(joints)}</robot>"


def limited(limit: str, kind: str = "revolute") -> Case:
    return Case(robot(joint("j", 1, kind).replace(LIMIT, limit)), SLID if kind == "prismatic" else TURNED)


def fixed(inside: str) -> Case:
    return Case(robot(joint("j", 1), FIXED.replace("</joint>", f"{inside}</joint>")), TURNED)


CASES = {
    "undeclared-prefix": limited(LIMIT.replace("/>", " drake:acceleration='3'/>")),
    "default-namespace": Case(robot(joint("j", 1), head="<robot xmlns='http://drake.mit.edu' name='r'>"), TURNED),
    "unnamed-robot": Case(robot(joint("j", 1), head="<robot>"), TURNED),
    "empty-name": Case(robot(joint("j", 1), head="<robot name=''>"), TURNED),
    "limit-without-effort": limited("<limit lower='-9' upper='9' velocity='1'/>"),
    "limit-without-velocity": limited("<limit lower='-9' upper='9' effort='1'/>"),
    "limit-not-a-number": limited("<limit lower='-9' upper='9' effort='abc' velocity='1'/>"),
    "limit-not-finite": limited("<limit lower='-9' upper='9' effort='inf' velocity='1'/>"),
    "negative-effort": limited("<limit lower='-9' upper='9' effort='-1' velocity='1'/>"),
    "negative-velocity": limited("<limit lower='-9' upper='9' effort='1' velocity='-1'/>"),
    "prismatic-without-limit": limited("", "prismatic"),
    "revolute-without-limit": limited(""),
    "limits-reversed": limited("<limit lower='9' upper='-9' effort='1' velocity='1'/>"),
    "limits-exclude-zero": limited("<limit lower='0.5' upper='9' effort='1' velocity='1'/>"),
    "fixed-axis-without-xyz": fixed("<axis xzy='0 0 1'/>"),
    "fixed-axis-not-numbers": fixed("<axis xyz='a b c'/>"),
    "fixed-limit-not-a-number": fixed("<limit lower='abc' upper='1' effort='1' velocity='1'/>"),
    "fixed-limit-not-finite": fixed("<limit lower='nan' upper='1' effort='1' velocity='1'/>"),
    "fixed-mimic-not-a-number": fixed("<mimic joint='j' multiplier='abc'/>"),
    "fixed-mimic-not-finite": fixed("<mimic joint='j' multiplier='inf'/>"),
    "fixed-mimic": fixed("<mimic joint='j'/>"),
    "unknown-mimic": Case(robot(joint("j", 1), joint("k", 2, parent=0, extra="<mimic joint='nobody'/>")), TURNED),
    "unknown-attribute": limited(LIMIT.replace("/>", " snap='3'/>")),
    "missing-axis": Case(robot(joint("j", 1, axis=None)), STEP @ turn((1, 0, 0), 0.7)),
    "oblique-axis": Case(robot(joint("j", 1, axis="0.6 0 0.8")), STEP @ turn((0.6, 0, 0.8), 0.7)),
    "unnormalised-axis, revolute": Case(robot(joint("j", 1, axis="0 0 2")), TURNED, joint_type="revolute"),
    "unnormalised-axis, continuous": Case(robot(joint("j", 1, "continuous", "0 0 2")), TURNED, joint_type="continuous"),
    "unnormalised-axis, prismatic": Case(robot(joint("j", 1, "prismatic", "0 0 2")), SLID, joint_type="prismatic"),
    "mimic": Case(robot(joint("j", 1), joint("k", 2, extra="<mimic joint='j'/>")), TURNED @ TURNED, "l2"),
    "unsupported-joint, floating": Case(robot(joint("j", 1), joint("k", 2, "floating")), joint_type="floating"),
    "unsupported-joint, planar": Case(robot(joint("j", 1), joint("k", 2, "planar")), joint_type="planar"),
}
# These adapters read the text with an XML parser of their own first, so what is not in `Urdf.text` does not reach the library.
OWN_PARSER = ("urdf:drake", "urdf:kdl", "urdf:mujoco")


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """In this process where that is possible: an engine that refuses a file is not started anew for the next one."""
    with Workers(in_process=not ALL) as started:
        yield started


def outcome(source: str, case: Case, workers: Workers) -> str:
    """What an engine makes of a case: `refuses`, `misreads` or `reads`."""
    try:
        engine = workers.load(adapter_of(source), UrdfText(case.text, tip=case.frame), ("root", "l1", "l2"))
        if not engine.joints:
            return "misreads"
        T = placement(engine, case.frame, j=0.7)
    except EngineFailed as error:
        return "misreads" if "expected at least one name" in str(error) else "refuses"
    workers.settle([engine])
    resolution = adapter_of(source).resolution or 1e-12
    return "reads" if case.placed is None or np.abs(T - case.placed).max() < resolution else "misreads"


def recorded(source: str, code: str, case: Case) -> str:
    """What the traits of an engine say of a case."""
    kinds = [
        type(trait)
        for trait in adapter_of(source).traits
        if isinstance(trait, LintTrait)
        and trait.lint == code
        and trait.on in ("", case.joint_type.replace("continuous", "revolute"))
    ]
    return "refuses" if Refusal in kinds else "misreads" if Misreading in kinds and case.placed is not None else "reads"


@pytest.mark.filterwarnings("ignore")  # of the libraries, on purpose provoked
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
def test_the_traits_say_what_the_engine_does(source: str, name: str, workers: Workers) -> None:
    code, case = name.partition(",")[0], CASES[name]
    if code in NOT_IN_TEXT and source in OWN_PARSER:
        pytest.skip("its adapter has an XML parser of its own")
    assert outcome(source, case, workers) == recorded(source, code, case)


@pytest.mark.parametrize("name", CASES)
def test_each_case_has_its_finding(name: str) -> None:
    code, case = name.partition(",")[0], CASES[name]
    codes = {(f.code, f.joint_type) for f in lint(parse_urdf(case.text.encode(), HERE))}
    assert (code, case.joint_type) in codes
    assert codes <= {(code, case.joint_type), ("fixed-mimic", ""), ("oblique-axis", "")}


def test_every_code_of_a_trait_is_one_of_the_lint() -> None:
    codes = {name.partition(",")[0] for name in CASES}
    assert set(TEXTS) <= codes
    for entry in registered().values():
        for trait in entry.adapter.traits if entry.adapter else ():
            assert trait.lint is None or trait.lint in codes
            assert not isinstance(trait, LintTrait) or trait.version, f"{entry.name}: {trait.evidence} names no version"


def finding(code: str, joint_type: str = "") -> Finding:
    return Finding(code=code, level="warning", subject="j", message="joint 'j'", line=1, joint_type=joint_type)


def test_a_finding_names_the_engines_and_their_versions() -> None:
    assert "pinocchio 4.1.0" in effect_of(finding("negative-effort")).refused
    assert "pinocchio 3.9.0" not in effect_of(finding("negative-effort")).refused
    assert "yourdfpy 0.0.60" in effect_of(finding("unnormalised-axis", "prismatic")).misread
    assert "yourdfpy 0.0.60" not in effect_of(finding("unnormalised-axis", "revolute")).misread
    texts = messages([finding("limit-without-effort"), finding("limit-without-effort"), finding("truncated-pi")])
    assert texts[0].startswith("joint 'j'; refused by frax 0.1.0, kinpy 0.6.1, pinocchio 4.1.0")
    assert texts[1:] == ["joint 'j'", "joint 'j'"]


def test_the_engine_that_follows_a_mimic_is_not_among_those_that_misread_it() -> None:
    misread = " ".join(effect_of(finding("mimic")).misread)
    assert "yourdfpy" not in misread
    assert "urchin" not in misread
    assert "MuJoCo 4.0.0" in misread


def test_why_an_engine_refuses_a_file() -> None:
    pinocchio = adapter_of("urdf:pinocchio")
    assert refused_for(pinocchio, [finding("unnamed-robot"), finding("mimic"), finding("negative-effort")]) == finding(
        "negative-effort"
    )
    assert refused_for(pinocchio, [finding("unnamed-robot")]) is None


def test_all_engines_are_tried_where_there_are_all() -> None:
    assert not ALL or {name for name in registered() if name.startswith("urdf:")} <= set(URDF_ENGINES)
