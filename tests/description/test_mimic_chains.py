"""Joints that follow joints that follow joints: as far as engines may be asked to, and no search without an end."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from harness.description.finding import Finding
from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import LONGEST_MIMIC, check, lint
from harness.errors import UrdfError

LIMIT = "<limit lower='-1' upper='1' effort='1' velocity='1'/>"


def followers(count: int, last: str = "") -> str:
    """A leader `j0` and `count` joints, each of which follows the one before; last: what the leader has."""
    links = "".join(f"<link name='l{i}'/>" for i in range(count + 2))
    joints = "".join(
        f"<joint name='j{i}' type='revolute'><parent link='l{i}'/><child link='l{i + 1}'/><axis xyz='0 0 1'/>"
        f"{f'<mimic joint={chr(39)}j{i - 1}{chr(39)}/>' if i else last}{LIMIT}</joint>"
        for i in range(count + 1)
    )
    return f"<robot name='r'>{links}{joints}</robot>"


def of_mimics(text: str) -> list[Finding]:
    return [f for f in lint(parse_urdf(text.encode(), Path("r.urdf"))) if f.code.startswith("mimic")]


def test_followers_of_followers_up_to_a_number() -> None:
    assert {f.code for f in of_mimics(followers(LONGEST_MIMIC))} == {"mimic"}
    longer = of_mimics(followers(LONGEST_MIMIC + 2))
    assert [(f.code, f.level, f.subject) for f in longer[:2]] == [
        ("mimic-chain", "error", f"j{LONGEST_MIMIC + 1}"),
        ("mimic-chain", "error", f"j{LONGEST_MIMIC + 2}"),
    ]
    assert {f.code for f in longer[2:]} == {"mimic"}
    with pytest.raises(UrdfError, match=r"joint 'j33' mimics through more than 32 others \(and 1 more errors\)"):
        check(parse_urdf(followers(LONGEST_MIMIC + 2).encode(), Path("r.urdf")))


def test_a_long_line_of_followers_is_looked_at_in_no_time() -> None:
    started = time.process_time()
    codes = [f.code for f in of_mimics(followers(2000))]
    assert time.process_time() - started < 5.0
    assert codes.count("mimic-chain") == 2000 - LONGEST_MIMIC


def test_a_joint_that_follows_itself_through_others() -> None:
    codes = {f.code for f in of_mimics(followers(3, "<mimic joint='j3'/>"))}
    assert codes == {"mimic-cycle"}
