"""URDFs as nested data: an element is its tag, its attributes (numbers as lists) and its children. Real ones and random trees."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import cache
from typing import Any
from xml.sax.saxutils import quoteattr

from lxml import etree

from harness.description.locate import default_models_dir
from tests.fuzz.trees import ATTRIBUTES, CHILDREN, TAG
from tests.fuzz.values import Deep

FILES = ("humanoid_arm.urdf", "sixr.urdf", "stanford.urdf", "ur5e.urdf")
LARGE = (60, 300, 900, 1100, 5100)  # joints
RANDOM = 400  # trees
NUMERIC = ("xyz", "rpy", "lower", "upper", "effort", "velocity", "multiplier", "offset")


def real(name: str) -> Any:
    """One of the URDFs that come with the package."""
    return parsed((default_models_dir().parent / "urdf" / name).read_bytes())


def parsed(data: bytes) -> Any:
    """XML as nested data."""
    return _element(etree.fromstring(data, etree.XMLParser(remove_comments=True)))


def _element(element: Any) -> dict[str, Any]:
    attributes = {str(key): _values(str(key), str(text)) for key, text in element.attrib.items()}
    return {TAG: str(element.tag), ATTRIBUTES: attributes, CHILDREN: [_element(child) for child in element]}


def _values(key: str, text: str) -> Any:
    return [float(word) for word in text.split()] if key in NUMERIC else text


def element(tag: str, *children: Any, **attributes: Any) -> dict[str, Any]:
    """An element."""
    return {TAG: tag, ATTRIBUTES: attributes, CHILDREN: list(children)}


@cache
def tree(number: int) -> Any:
    """A random tree of links, the same for the same number; now and then a large one."""
    source = random.Random(number)
    count = source.choice(LARGE) if number % 40 == 39 else source.randint(0, 9)
    chain = source.random() < (0.5 if count > 12 else 0.7)
    mimics = source.choice([0.0, 0.15])
    robot = element("robot", name=f"robot{number}")
    robot[CHILDREN] += [element("link", name=f"l{i}") for i in range(count + 1)]
    moving: list[str] = []
    for i in range(1, count + 1):
        kind = source.choice(["revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"])
        parent = i - 1 if chain else source.randrange(i)
        joint = element("joint", name=f"j{i}", type=kind)
        joint[CHILDREN] = list(_parts(source, kind, (f"l{parent}", f"l{i}"), moving if source.random() < mimics else []))
        moving += [f"j{i}"] * (kind != "fixed" and len(joint[CHILDREN]) < 6)
        robot[CHILDREN].append(joint)
    return robot


def _parts(source: random.Random, kind: str, ends: tuple[str, str], leaders: list[str]) -> Iterator[Any]:
    """What a joint holds. ends: its links; leaders: joints that it follows one of, if there are any."""
    yield element("parent", link=ends[0])
    yield element("child", link=ends[1])
    angle = source.choice([0.0, 1.5707963267948966, -1.5708, 3.1416, source.uniform(-3, 3)])
    xyz = [source.choice([0.0, 0.1, source.uniform(-1, 1)]) for _ in range(3)]
    yield element("origin", xyz=xyz, rpy=[source.choice([0.0, angle]) for _ in range(3)])
    if kind == "fixed":
        return
    yield element(
        "axis", xyz=source.choice([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8]])
    )
    yield element("limit", lower=[-1.0], upper=[source.choice([1.0, 2.9, 1e16])], effort=[1.0], velocity=[1.0])
    if leaders:
        yield element("mimic", joint=source.choice(leaders), multiplier=[source.choice([1.0, -2.0])], offset=[0.0])


def xml_text(data: Any) -> str:
    """Nested data as XML: well-formed as long as every element has a tag that is a name."""
    if isinstance(data, Deep):
        return "<link>" * data.levels + "</link>" * data.levels
    if isinstance(data, list):
        return "".join(map(xml_text, data))
    if not isinstance(data, dict):
        return str(data) if not isinstance(data, int) or abs(data) < 10**4000 else "9" * 4000
    tag, attributes = str(data.get(TAG, "link")), data.get(ATTRIBUTES, {})
    pairs = attributes.items() if isinstance(attributes, dict) else ()
    head = "".join(f" {key}={quoteattr(_attribute(value), {chr(10): '&#10;', chr(13): '&#13;'})}" for key, value in pairs)
    return f"<{tag}{head}>{xml_text(data.get(CHILDREN, []))}</{tag}>\n"


def _attribute(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(map(_attribute, value))
    return f"{value:.17g}" if isinstance(value, float) and not isinstance(value, bool) else xml_text(value)


def links(data: Any) -> tuple[list[str], list[str]]:
    """The names of all links, and of those that are the child of a joint and the parent of none, of data that may be damaged."""
    children = data.get(CHILDREN) if isinstance(data, dict) else None
    elements = [e for e in children if isinstance(e, dict)] if isinstance(children, list) else []
    names = [name for e in elements if e.get(TAG) == "link" for name in _named(e, "name")]
    inside = [e for joint in elements if isinstance(joint.get(CHILDREN), list) for e in joint[CHILDREN] if isinstance(e, dict)]
    parents = {name for e in inside if e.get(TAG) == "parent" for name in _named(e, "link")}
    return names, [name for e in inside if e.get(TAG) == "child" for name in _named(e, "link") if name not in parents]


def _named(data: dict[str, Any], key: str) -> list[str]:
    """The value of an attribute, if it is a name that can stand on a command line."""
    attributes = data.get(ATTRIBUTES)
    value = attributes.get(key) if isinstance(attributes, dict) else None
    return [value] if isinstance(value, str) and "\0" not in value and value.isprintable() else []
