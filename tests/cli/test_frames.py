"""`crosscheck frames` on URDFs: joint limits, and the lint with the engines that refuse or misread."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from harness.cli.frames import show_frames


def shown(folder: Path, text: str) -> tuple[int, str]:
    """Exit code and output of `frames` on a URDF."""
    path = folder / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    out = io.StringIO()
    return show_frames(str(path), None, Console(file=out, width=400)), out.getvalue()


def joint(limit: str, kind: str = "revolute") -> str:
    return (
        f"<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='{kind}'><parent link='a'/><child link='b'/>"
        f"<axis xyz='0 0 1'/>{limit}</joint></robot>"
    )


def limit(lower: str, upper: str) -> str:
    return f"<limit lower='{lower}' upper='{upper}' effort='1' velocity='1'/>"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (joint(limit("-1.5707963267948966", "3.141592653589793")), "limits -90 to 180 deg"),
        (joint(limit("-6.2831853", "6.2831853")), "limits -360 to 360 deg"),
        (joint(limit("0", "0.04"), "prismatic"), "limits 0 to 0.04 m"),
        (joint(limit("-999999", "999999"), "prismatic"), "no limit"),
        (joint(limit("-1e16", "1e16")), "no limit"),
        (joint(limit("0", "1e308"), "prismatic"), "limits from 0 m, no upper limit"),
        (joint(limit("-10000", "0.5"), "prismatic"), "limits up to 0.5 m, no lower limit"),
        (joint(limit("-1", "1"), "continuous"), "no limit"),
        (joint("", "continuous"), "no limit"),
        (joint(""), "no limit"),
    ],
)
def test_joint_limits_are_shown(tmp_path: Path, text: str, expected: str) -> None:
    code, out = shown(tmp_path, text)
    assert code == 0
    assert f"axis [0, 0, 1], {expected}, xyz" in out


def test_a_fixed_joint_has_no_limits_to_show(tmp_path: Path) -> None:
    _, out = shown(tmp_path, joint(limit("-1", "1"), "fixed"))
    assert "j: fixed, xyz [0, 0, 0]" in out


def test_the_lint_names_the_engines_that_refuse(tmp_path: Path) -> None:
    code, out = shown(tmp_path, joint("<limit lower='-1' upper='1' velocity='1'/>"))
    assert code == 0
    line = next(line for line in out.splitlines() if line.startswith("warning:"))
    assert line.startswith("warning: line 1: joint 'j': <limit> has no attribute 'effort'; refused by frax 0.1.0, ")
    for engine in ("pinocchio 4.1.0", "pytorch-kinematics 0.10.0", "urchin 0.0.30"):
        assert engine in line
    assert "yourdfpy" not in line
