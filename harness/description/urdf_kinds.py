"""What a file is that was given as a URDF and is none, and the way out."""

from __future__ import annotations

import re

CONVERT = "give the URDF it was made from, or convert it to URDF first"
EXPAND = "expand it first: xacro FILE > robot.urdf"

_HEAD = 4096
_MAGIC = (
    (b"#usda", "USD text", CONVERT),
    (b"PXR-USDC", "binary USD", CONVERT),
    (b"version https://git-lfs", "a pointer of Git LFS, not the file itself", "fetch the file: git lfs pull"),
    (b"PK\x03\x04", "a ZIP archive", "unpack it first"),
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"%PDF", "a PDF document", "give the URDF itself"),
    (b"glTF", "a glTF mesh", "give the URDF that names it"),
    (b"solid ", "an STL mesh", "give the URDF that names it"),
)
_ROOTS = {
    "sdf": ("SDF, the format of Gazebo", CONVERT),
    "gazebo": ("SDF, the format of Gazebo", CONVERT),
    "mujoco": ("MJCF, the format of MuJoCo", CONVERT),
    "mujocoinclude": ("a part of an MJCF, the format of MuJoCo", CONVERT),
    "collada": ("a COLLADA mesh", "give the URDF that names it"),
    "html": ("an HTML page", "download the raw file, not the page that shows it"),
    "launch": ("a ROS launch file", "give the URDF that it loads"),
    "package": ("a ROS package.xml", "give a URDF of the package"),
    "kinbody": ("OpenRAVE's XML", CONVERT),
    "environment": ("OpenRAVE's XML", CONVERT),
}
_SRDF = {
    "group",
    "group_state",
    "end_effector",
    "virtual_joint",
    "passive_joint",
    "disable_collisions",
    "disable_default_collisions",
}
_HTML = re.compile(r"(?:<!--.{0,2000}?-->\s*)?<(?:!doctype\s+html|html|head|body)\b", re.IGNORECASE | re.DOTALL)
_TOML = re.compile(r"\[{1,2}[\w.\" -]+\]{1,2}\s*(?:#.*)?$", re.MULTILINE)
_YAML = re.compile(r"(?:%YAML|---(?:\s|$)|(?:#[^\n]*\n\s*)*(?:- )?[\w./-]+[ \t]*:(?:\s|$))")


def kind_of_bytes(data: bytes) -> tuple[str, str] | None:
    """What a file is, by its first bytes, and the way out; None if it may be XML."""
    for magic, kind, hint in _MAGIC:
        if data.startswith(magic):
            return kind, hint
    head = _text(data[:_HEAD]).lstrip()
    if _HTML.match(head):
        return _ROOTS["html"]
    if not head or head.startswith("<"):
        return None
    kind = _kind_of_text(head)
    return (kind, "give the URDF, which is XML") if kind else None


def _kind_of_text(head: str) -> str:
    """The format of a text that is no XML; empty if it is not known."""
    if head.startswith("["):
        return "TOML" if _TOML.match(head) else "JSON"
    if head.startswith("{"):
        return "JSON"
    if _YAML.match(head):
        return "YAML"
    return "a table in CSV" if head.splitlines()[0].count(",") >= 3 else ""


def kind_of_root(tag: str) -> tuple[str, str] | None:
    """What an XML file is, by the name of its root element, without a namespace, and the way out; None if it is not known."""
    if tag != "robot" and tag.lower() == "robot":
        return f"a misspelt <{tag}>", "write it in lower case: <robot>"
    return _ROOTS.get(tag.lower())


def is_srdf(tags: set[str]) -> bool:
    """Whether a `<robot>` without links is an SRDF, by the names of its children."""
    return bool(tags & _SRDF)


def is_xacro(namespace: str) -> bool:
    """Whether a namespace is that of xacro. Files write it in several ways: ros.org/wiki/xacro, wiki.ros.org/xacro, xacro."""
    return re.fullmatch(r"(?:.*[/:.])?xacro/?(?:#.*)?", namespace.strip(), re.IGNORECASE) is not None


def unexpanded(text: str) -> bool:
    """Whether a text holds an expression of xacro or roslaunch: `${...}` or `$(...)`."""
    return "${" in text or "$(" in text


def _text(data: bytes) -> str:
    """The first bytes as text, for looking at."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")):
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, "replace")
    return data.decode("latin-1")
