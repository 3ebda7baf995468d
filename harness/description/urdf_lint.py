"""What is suspicious or broken in a URDF, found before any engine reads it.

Engines disagree about defaults and share mistakes, so a majority of them proves nothing: the file is judged first.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from harness.description.finding import MOST_NAMED, Finding, Level
from harness.description.urdf import UNSUPPORTED, Urdf, UrdfJoint
from harness.description.urdf_limit_lint import lint_limits
from harness.description.values import find_truncation
from harness.errors import Suggestions, UrdfError, nearest

MAX_DEPTH = 1_000
LONGEST_MIMIC = 32  # joints that follow each other


def lint(urdf: Urdf) -> tuple[Finding, ...]:
    """All findings, errors first, then by line."""
    spelling = Suggestions()
    findings = [*urdf.remarks, *_names(urdf), *_structure(urdf), *lint_limits(urdf)]
    for joint in urdf.joint_list:
        findings += [*_axis(joint), *_mimic(urdf, joint, spelling), *_numbers(joint)]
    order = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda f: (order[f.level], f.line)))


def check(urdf: Urdf) -> tuple[Finding, ...]:
    """The findings of a URDF that is one kinematic tree. Raises UrdfError for the first `error` finding."""
    findings = lint(urdf)
    errors = [f for f in findings if f.level == "error"]
    if errors:
        more = f" (and {len(errors) - 1} more errors)" if len(errors) > 1 else ""
        raise UrdfError(f"{errors[0].message}{more}", where=urdf.path, line=errors[0].line or None, key=errors[0].code)
    return findings


def _names(urdf: Urdf) -> Iterator[Finding]:
    for code, items in (("duplicate-link", urdf.link_list), ("duplicate-joint", urdf.joint_list)):
        counts = Counter(item.name for item in items)
        for item in items:
            if counts[item.name] > 1:
                lines = [str(other.line) for other in items if other.name == item.name]
                counts[item.name] = 0
                what = code.removeprefix("duplicate-")
                yield Finding(
                    code=code,
                    level="error",
                    subject=item.name,
                    message=f"{what} name {item.name!r} is used on lines {', '.join(lines)}",
                    line=item.line,
                )


def _structure(urdf: Urdf) -> Iterator[Finding]:
    above: dict[str, UrdfJoint] = {}
    for joint in urdf.joint_list:
        if joint.child in above:
            message = f"link {joint.child!r} has two parents: joints {above[joint.child].name!r} and {joint.name!r}"
            yield Finding(code="two-parents", level="error", subject=joint.child, message=message, line=joint.line)
        above.setdefault(joint.child, joint)
    links = set(urdf.links)
    missing = [
        (role, link, joint)
        for joint in urdf.joint_list
        for role, link in (("parent", joint.parent), ("child", joint.child))
        if link not in links
    ]
    yield from _missing(missing, links)
    # Below a parent that does not exist there may be a whole tree, and no cycle.
    tops = [*urdf.roots, *dict.fromkeys(link for role, link, _ in missing if role == "parent")]
    depth = _depths(urdf, above, tops)
    in_cycle = [link for link in urdf.link_list if link.name not in depth]
    if in_cycle:
        names = ", ".join(link.name for link in in_cycle[:5])
        message = f"{len(in_cycle)} links cannot be reached from any root, they hang on a cycle: {names}"
        yield Finding(code="cycle", level="error", subject=in_cycle[0].name, message=message, line=in_cycle[0].line)
    if depth and max(depth.values()) > MAX_DEPTH:
        deepest = max(depth, key=lambda name: depth[name])
        message = f"expected a tree at most {MAX_DEPTH} joints deep, got {depth[deepest]}"
        yield Finding(code="too-deep", level="error", subject=deepest, message=message, line=0)
    # A link whose joint misspells it looks like another root.
    for root in () if missing else urdf.roots[1:]:
        line = next(link.line for link in urdf.link_list if link.name == root)
        message = f"link {root!r} cannot be reached from the root {urdf.roots[0]!r}: no joint has it as its child"
        yield Finding(code="unreachable-link", level="error", subject=root, message=message, line=line)


def _missing(missing: list[tuple[str, str, UrdfJoint]], links: set[str]) -> Iterator[Finding]:
    """One finding for all links that joints name and that do not exist; missing: role, link and joint of each."""
    first = {(role, link): joint for role, link, joint in reversed(missing)}
    names = dict.fromkeys((role, link) for role, link, _ in missing)
    if not names:
        return
    sentences = []
    for role, link in list(names)[:MOST_NAMED]:
        sentences.append(f"{role} link {link!r} does not exist (joint {first[role, link].name!r}); {nearest(link, links)}")
    if len(names) > MOST_NAMED:
        sentences.append(f"and {len(names) - MOST_NAMED} more links do not exist")
    joint = missing[0][2]
    yield Finding(code="unknown-link", level="error", subject=joint.name, message="; ".join(sentences), line=joint.line)


def _depths(urdf: Urdf, above: dict[str, UrdfJoint], tops: list[str]) -> dict[str, int]:
    """Distance from its root of every link that has one; links on or below a cycle are left out.

    Args:
        urdf: the URDF.
        above: the first joint above each link.
        tops: where to start: the roots, and parents that do not exist.
    """
    depth: dict[str, int] = dict.fromkeys(tops, 0)
    queue = list(tops)
    while queue:
        link = queue.pop()
        for joint in urdf.children(link):
            if joint.child not in depth and above.get(joint.child) is joint:
                depth[joint.child] = depth[link] + 1
                queue.append(joint.child)
    return depth


def _axis(joint: UrdfJoint) -> Iterator[Finding]:
    if joint.type == "fixed":
        return
    if joint.type in UNSUPPORTED:
        message = f"joint {joint.name!r} is {joint.type}: no DH row matches it"
        yield Finding(
            code="unsupported-joint",
            level="warning",
            subject=joint.name,
            message=message,
            line=joint.line,
            joint_type=joint.type,
        )
        return
    if joint.axis is None:
        message = f"joint {joint.name!r} has no <axis>: x by the specification"
        yield Finding(code="missing-axis", level="warning", subject=joint.name, message=message, line=joint.line)
        return
    length = math.sqrt(sum(x * x for x in joint.axis))
    text = " ".join(f"{x:g}" for x in joint.axis)
    if length == 0.0:
        yield Finding(
            code="zero-axis", level="error", subject=joint.name, message=f"joint {joint.name!r} has axis {text}", line=joint.line
        )
        return
    # Files write 0.7071 0.7071 0 and mean a unit vector; engines differ as soon as it is off by more than rounding.
    if abs(length - 1.0) > 1e-12:
        message = f"joint {joint.name!r} has axis {text} of length {length:.9g}, not 1"
        yield Finding(
            code="unnormalised-axis",
            level="warning",
            subject=joint.name,
            message=message,
            line=joint.line,
            joint_type=joint.type,
        )
    if sum(x != 0.0 for x in joint.axis) > 1:
        message = f"joint {joint.name!r} has the oblique axis {text}"
        yield Finding(code="oblique-axis", level="note", subject=joint.name, message=message, line=joint.line)


def _mimic(urdf: Urdf, joint: UrdfJoint, spelling: Suggestions) -> Iterator[Finding]:
    if joint.mimic is None:
        return
    fixed = joint.type == "fixed"  # then nothing moves, whatever it says
    leader = urdf.joints.get(joint.mimic.joint)
    if leader is None:
        hint = spelling.nearest(joint.mimic.joint, urdf.joints)
        message = f"joint {joint.name!r} mimics {joint.mimic.joint!r}, which does not exist; {hint}"
        level: Level = "note" if fixed else "warning"
        yield Finding(code="unknown-mimic", level=level, subject=joint.name, message=message, line=joint.line)
    if fixed:
        message = f"joint {joint.name!r} is fixed and mimics {joint.mimic.joint!r}: nothing moves"
        yield Finding(code="fixed-mimic", level="note", subject=joint.name, message=message, line=joint.line)
    if leader is None or fixed:
        return
    seen = [joint.name]
    while (
        leader is not None
        and leader.mimic is not None
        and leader.type != "fixed"
        and leader.name not in seen
        and len(seen) <= LONGEST_MIMIC
    ):
        seen.append(leader.name)
        leader = urdf.joints.get(leader.mimic.joint)
    if leader is not None and leader.name in seen:
        yield Finding(
            code="mimic-cycle", level="error", subject=joint.name, message=f"joint {joint.name!r} mimics itself", line=joint.line
        )
        return
    if len(seen) > LONGEST_MIMIC:
        message = f"joint {joint.name!r} mimics through more than {LONGEST_MIMIC} others"
        yield Finding(code="mimic-chain", level="error", subject=joint.name, message=message, line=joint.line)
        return
    message = f"joint {joint.name!r} mimics {joint.mimic.joint!r}"
    yield Finding(code="mimic", level="warning", subject=joint.name, message=message, line=joint.line)


def _numbers(joint: UrdfJoint) -> Iterator[Finding]:
    for where, text in joint.texts:
        if where not in ("origin rpy", "mimic offset"):
            continue
        for word in dict.fromkeys(text.split()):
            if truncation := find_truncation(word):
                message = (
                    f"joint {joint.name!r} {where}: {word} is {truncation.exact} cut short, off by {truncation.error:.1e} rad"
                )
                yield Finding(code="truncated-pi", level="note", subject=joint.name, message=message, line=joint.line)
