"""Reads a URDF safely, and writes the text that engines are given.

No DTD, no entity, no network, bounded size and depth. Everything with kinematic meaning stays as written: axes are not
normalised, defaults are not filled in, mimic is not expanded.
"""

from __future__ import annotations

from pathlib import Path

from lxml import etree

from harness.description.finding import Finding
from harness.description.urdf import TYPES, Limit, Link, Mimic, Urdf, UrdfJoint
from harness.description.urdf_attributes import Spelling
from harness.description.urdf_kinds import EXPAND, unexpanded
from harness.description.urdf_numbers import line_of, numbers, shown
from harness.description.urdf_root import is_undeclared, robot_of
from harness.errors import UrdfError, nearest
from harness.reading import URDF_BYTES, read_bytes, require_few_tags

MAX_LINKS = 5_000

_KEPT = ("origin", "parent", "child", "axis", "limit", "mimic")


def read_urdf(path: Path) -> Urdf:
    """Read a URDF file. Raises UrdfError (file, line) for anything that is not well-formed URDF kinematics."""
    return parse_urdf(read_bytes(path, URDF_BYTES, UrdfError), path)


def parse_urdf(data: bytes, path: Path) -> Urdf:
    """Parse URDF bytes; `path` is for messages. Raises UrdfError."""
    require_few_tags(data, path, UrdfError)
    robot, remarks = robot_of(data, path)
    links: list[Link] = []
    joints: list[UrdfJoint] = []
    spelling = Spelling(path)
    kept = etree.Element("robot", {"name": robot.get("name", "")})
    for element in robot:
        if element.tag == "link":
            links.append(Link(_required(element, "name", path), line_of(element)))
            etree.SubElement(kept, "link", {"name": links[-1].name})
        elif element.tag == "joint":
            joints.append(_joint(element, path, spelling))
            copy = etree.SubElement(kept, "joint", _attributes(element))
            for child in element:
                if child.tag in _KEPT:
                    etree.SubElement(copy, child.tag, _attributes(child))
    if len(links) > MAX_LINKS or len(joints) > MAX_LINKS:
        raise UrdfError(
            f"expected at most {MAX_LINKS} links and joints, got {len(links)} and {len(joints)}",
            where=path,
            hint="cut the file down to the arm",
        )
    if not robot.get("name"):
        absent = robot.get("name") is None
        code, message = (
            ("unnamed-robot", "<robot> has no attribute 'name'") if absent else ("empty-name", "<robot> has an empty name")
        )
        remarks.append(Finding(code=code, level="warning", subject="robot", message=message, line=line_of(robot)))
    return Urdf(
        etree.tostring(kept, encoding="unicode", pretty_print=True),
        path=path,
        name=robot.get("name", ""),
        link_list=tuple(links),
        joint_list=tuple(joints),
        remarks=(*remarks, *spelling.findings()),
    )


def _joint(element: etree._Element, path: Path, spelling: Spelling) -> UrdfJoint:
    name = _required(element, "name", path)
    kind = _required(element, "type", path)
    _check_expanded(element, path)
    if kind not in TYPES:
        raise UrdfError(f"joint {name!r} has unknown type {kind!r}", where=path, line=line_of(element), hint=nearest(kind, TYPES))
    spelling.check(element)
    origin, axis, limit, mimic = (element.find(tag) for tag in ("origin", "axis", "limit", "mimic"))
    texts = tuple(
        (f"{e.tag} {key}", str(e.get(key)))
        for e, keys in ((origin, ("xyz", "rpy")), (axis, ("xyz",)), (mimic, ("offset", "multiplier")))
        if e is not None
        for key in keys
        if e.get(key) is not None
    )
    fixed = kind == "fixed"  # then axis, limit and mimic have no meaning, and only the lint looks at them
    return UrdfJoint(
        name=name,
        type=kind,
        parent=_end(element, "parent", path),
        child=_end(element, "child", path),
        xyz=numbers(origin, "xyz", path, 3, (0.0, 0.0, 0.0)),
        rpy=numbers(origin, "rpy", path, 3, (0.0, 0.0, 0.0)),
        axis=None if axis is None or fixed else numbers(axis, "xyz", path, 3, None),
        limits=None if fixed else _limits(limit, path),
        limit=None if limit is None else Limit(limit.get("effort"), limit.get("velocity")),
        mimic=_mimic_of_fixed(mimic) if fixed else _mimic(mimic, path),
        line=line_of(element),
        texts=texts,
    )


def _limits(limit: etree._Element | None, path: Path) -> tuple[float, float] | None:
    if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
        return None
    (lower,) = numbers(limit, "lower", path, 1, (0.0,))
    (upper,) = numbers(limit, "upper", path, 1, (0.0,))
    return lower, upper


def _mimic(mimic: etree._Element | None, path: Path) -> Mimic | None:
    if mimic is None:
        return None
    (multiplier,) = numbers(mimic, "multiplier", path, 1, (1.0,))
    (offset,) = numbers(mimic, "offset", path, 1, (0.0,))
    return Mimic(_required(mimic, "joint", path), multiplier, offset)


def _mimic_of_fixed(mimic: etree._Element | None) -> Mimic | None:
    """What a fixed joint says that it follows; it does not move, so the numbers do not count."""
    return None if mimic is None or not mimic.get("joint") else Mimic(str(mimic.get("joint")), 1.0, 0.0)


def _end(element: etree._Element, tag: str, path: Path) -> str:
    end = element.find(tag)
    if end is None:
        raise UrdfError(f"joint {element.get('name')!r} has no <{tag}>", where=path, line=line_of(element))
    return _required(end, "link", path)


def _required(element: etree._Element, key: str, path: Path) -> str:
    value = element.get(key)
    if not value:
        raise UrdfError(f"<{element.tag}> has no attribute {key!r}", where=path, line=line_of(element))
    _check_text(element, key, str(value), path)
    return str(value)


def _check_expanded(joint: etree._Element, path: Path) -> None:
    """Raise UrdfError if something that is read of a joint is an expression of xacro."""
    for element in (joint, *(child for child in joint if child.tag in _KEPT)):
        for key, value in element.attrib.items():
            _check_text(element, str(key), str(value), path)


def _check_text(element: etree._Element, key: str, value: str, path: Path) -> None:
    if unexpanded(value):
        problem = f"the file is xacro, not URDF: {shown(value)} in {key} of <{element.tag}> is not expanded"
        raise UrdfError(problem, where=path, line=line_of(element), hint=EXPAND)


def _attributes(element: etree._Element) -> dict[str, str]:
    """The attributes that engines are given: all but those whose prefix the file does not declare."""
    return {str(key): str(value) for key, value in element.attrib.items() if not is_undeclared(str(key))}
