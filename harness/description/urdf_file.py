"""Reads a URDF safely, and writes the text that engines are given.

No DTD, no entity, no network, bounded size and depth. Everything with kinematic meaning stays as written: axes are not
normalised, defaults are not filled in, mimic is not expanded.
"""

from __future__ import annotations

import math
from pathlib import Path

from lxml import etree

from harness.description.urdf import TYPES, Link, Mimic, Urdf, UrdfJoint
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
    robot = _root(data, path)
    links: list[Link] = []
    joints: list[UrdfJoint] = []
    kept = etree.Element("robot", {"name": robot.get("name", "")})
    for element in robot:
        if element.tag == "link":
            links.append(Link(_required(element, "name", path), _line(element)))
            etree.SubElement(kept, "link", {"name": links[-1].name})
        elif element.tag == "joint":
            joints.append(_joint(element, path))
            copy = etree.SubElement(kept, "joint", dict(element.attrib))
            for child in element:
                if child.tag in _KEPT:
                    etree.SubElement(copy, child.tag, dict(child.attrib))
    if len(links) > MAX_LINKS or len(joints) > MAX_LINKS:
        raise UrdfError(
            f"expected at most {MAX_LINKS} links and joints, got {len(links)} and {len(joints)}",
            where=path,
            hint="cut the file down to the arm",
        )
    if not links:
        raise UrdfError("expected at least one <link>, got none", where=path)
    text = etree.tostring(kept, encoding="unicode", pretty_print=True)
    return Urdf(text, path, robot.get("name", ""), tuple(links), tuple(joints))


def _root(data: bytes, path: Path) -> etree._Element:
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    try:
        robot = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        what = str(error.msg).split(", line ")[0].strip()
        raise UrdfError(f"not well-formed XML: {what}", where=path, line=error.lineno) from None
    except ValueError as error:  # e.g. control characters
        raise UrdfError(f"not well-formed XML: {error}", where=path) from None
    # Entities can be declared only in a DTD, so refusing every DTD refuses bombs and external files alike.
    if robot.getroottree().docinfo.internalDTD is not None:
        raise UrdfError(
            "a document type or entity declaration is not allowed in a URDF", where=path, hint="remove <!DOCTYPE ...>"
        )
    if robot.tag != "robot":
        hint = "expand it first: xacro FILE > robot.urdf" if path.suffix == ".xacro" else None
        raise UrdfError(f"expected the root element <robot>, got <{robot.tag}>", where=path, line=_line(robot), hint=hint)
    if any(isinstance(e.tag, str) and e.tag.startswith("{http://www.ros.org/wiki/xacro}") for e in robot):
        raise UrdfError("the file is xacro, not URDF", where=path, hint="expand it first: xacro FILE > robot.urdf")
    return robot


def _joint(element: etree._Element, path: Path) -> UrdfJoint:
    name = _required(element, "name", path)
    kind = _required(element, "type", path)
    if kind not in TYPES:
        raise UrdfError(f"joint {name!r} has unknown type {kind!r}", where=path, line=_line(element), hint=nearest(kind, TYPES))
    origin, axis, limit, mimic = (element.find(tag) for tag in ("origin", "axis", "limit", "mimic"))
    texts = tuple(
        (f"{e.tag} {key}", str(e.get(key)))
        for e, keys in ((origin, ("xyz", "rpy")), (axis, ("xyz",)), (mimic, ("offset", "multiplier")))
        if e is not None
        for key in keys
        if e.get(key) is not None
    )
    return UrdfJoint(
        name=name,
        type=kind,
        parent=_end(element, "parent", path),
        child=_end(element, "child", path),
        xyz=_numbers(origin, "xyz", path, 3, (0.0, 0.0, 0.0)),
        rpy=_numbers(origin, "rpy", path, 3, (0.0, 0.0, 0.0)),
        axis=None if axis is None else _numbers(axis, "xyz", path, 3, None),
        limits=_limits(limit, path),
        mimic=_mimic(mimic, path),
        line=_line(element),
        texts=texts,
    )


def _limits(limit: etree._Element | None, path: Path) -> tuple[float, float] | None:
    if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
        return None
    (lower,) = _numbers(limit, "lower", path, 1, (0.0,))
    (upper,) = _numbers(limit, "upper", path, 1, (0.0,))
    return lower, upper


def _mimic(mimic: etree._Element | None, path: Path) -> Mimic | None:
    if mimic is None:
        return None
    (multiplier,) = _numbers(mimic, "multiplier", path, 1, (1.0,))
    (offset,) = _numbers(mimic, "offset", path, 1, (0.0,))
    return Mimic(_required(mimic, "joint", path), multiplier, offset)


def _end(element: etree._Element, tag: str, path: Path) -> str:
    end = element.find(tag)
    if end is None:
        raise UrdfError(f"joint {element.get('name')!r} has no <{tag}>", where=path, line=_line(element))
    return _required(end, "link", path)


def _required(element: etree._Element, key: str, path: Path) -> str:
    value = element.get(key)
    if not value:
        raise UrdfError(f"<{element.tag}> has no attribute {key!r}", where=path, line=_line(element))
    return str(value)


def _numbers(
    element: etree._Element | None, key: str, path: Path, count: int, default: tuple[float, ...] | None
) -> tuple[float, ...]:
    text = None if element is None else element.get(key)
    if text is None:
        if default is not None:
            return default
        raise UrdfError(f"<axis> has no attribute {key!r}", where=path, line=_line(element))
    try:
        values = tuple(float(word) for word in text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(v) for v in values):
        what = f"{count} finite numbers" if count > 1 else "a finite number"
        raise UrdfError(f"expected {what} in {key}, got {text!r}", where=path, line=_line(element))
    return values


def _line(element: etree._Element | None) -> int:
    return int(getattr(element, "sourceline", None) or 0)
