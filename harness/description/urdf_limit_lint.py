"""What is suspicious in the `<limit>` elements of a URDF: engines refuse what others read. One finding a kind, not a joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from harness.description.finding import Finding, Level, about
from harness.description.urdf import MOVABLE, Urdf, UrdfJoint
from harness.description.urdf_numbers import parsed

Test = Callable[[UrdfJoint], bool]


def lint_limits(urdf: Urdf) -> Iterator[Finding]:
    """Findings about limits, at most one of each kind."""
    for code, level, what, applies in KINDS:
        joints = [(joint.name, joint.line) for joint in urdf.joint_list if applies(joint)]
        if joints:
            yield about(code, level, what, joints)


def _without(key: str) -> Test:
    """Whether there is a `<limit>`, and it lacks an attribute."""
    return lambda joint: joint.limit is not None and getattr(joint.limit, key) is None


def _negative(key: str) -> Test:
    """Whether an attribute of `<limit>` is below zero, at a joint that moves."""

    def applies(joint: UrdfJoint) -> bool:
        text = None if joint.limit is None or joint.type not in MOVABLE else getattr(joint.limit, key)
        values = None if text is None else parsed(text)
        return values is not None and values[0] < 0.0

    return applies


def _unlimited(kind: str) -> Test:
    return lambda joint: joint.type == kind and joint.limit is None


def _range(joint: UrdfJoint) -> tuple[float, float]:
    """The limits of a joint that has some; a range that nothing is wrong with for any other."""
    has_some = joint.limits is not None and joint.type in ("revolute", "prismatic")
    return joint.limits if has_some and joint.limits is not None else (0.0, 0.0)


def _reversed(joint: UrdfJoint) -> bool:
    lower, upper = _range(joint)
    return lower > upper


def _excludes_zero(joint: UrdfJoint) -> bool:
    lower, upper = _range(joint)
    return lower <= upper and not lower <= 0.0 <= upper


KINDS: tuple[tuple[str, Level, str, Test], ...] = (
    ("limit-without-effort", "warning", "<limit> has no attribute 'effort'", _without("effort")),
    ("limit-without-velocity", "warning", "<limit> has no attribute 'velocity'", _without("velocity")),
    ("negative-effort", "warning", "<limit> has a negative effort", _negative("effort")),
    ("negative-velocity", "warning", "<limit> has a negative velocity", _negative("velocity")),
    ("prismatic-without-limit", "warning", "prismatic without a <limit>", _unlimited("prismatic")),
    ("revolute-without-limit", "warning", "revolute without a <limit>", _unlimited("revolute")),
    ("limits-reversed", "warning", "the lower limit lies above the upper one", _reversed),
    ("limits-exclude-zero", "note", "the limits exclude zero, where many programs start", _excludes_zero),
)
