"""Writes the DH table of a robot model as a URDF."""

from __future__ import annotations

import numpy as np
from lxml import etree

from harness import se3
from harness.description.dh import DHRow
from harness.description.model import RobotModel
from harness.se3 import Array


def export_urdf(model: RobotModel) -> str:
    """The model's DH table as URDF text: a link for every joint, and one for every DH frame (`dh_1` ...) fixed to it."""
    table = model.table
    robot = etree.Element("robot", name=model.name)
    etree.SubElement(robot, "link", name="dh_base")
    at, T = "dh_base", table.base
    _fixed(robot, at, "dh_0", T)
    moved = 0
    for i, row in enumerate(table.rows, start=1):
        pre, post = _parts(row, table.convention)
        T = T @ pre
        if row.kind != "fixed":
            limits = (model.configurations.lower[moved], model.configurations.upper[moved])
            at = _joint(robot, at, row, T, (float(limits[0]), float(limits[1])))
            T, moved = np.eye(4), moved + 1
        T = T @ post
        _fixed(robot, at, f"dh_{i}", T)
    _fixed(robot, at, "dh_tool", T @ table.tool)
    return str(etree.tostring(robot, encoding="unicode", pretty_print=True))


def _parts(row: DHRow, convention: str) -> tuple[Array, Array]:
    """The constant transforms before and behind a row's joint; see engines/dh_pinocchio.py."""
    about_z = se3.rotation("z", row.theta) @ se3.translation((0.0, 0.0, row.d))
    along_x = se3.translation((row.a, 0.0, 0.0)) @ se3.rotation("x", row.alpha)
    return (along_x, about_z) if convention == "modified" else (np.eye(4), about_z @ along_x)


def _origin(joint: etree._Element, T: Array) -> None:
    xyz, rpy = " ".join(repr(float(x)) for x in T[:3, 3]), " ".join(repr(float(x)) for x in se3.to_rpy(T))
    etree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)


def _fixed(robot: etree._Element, parent: str, child: str, T: Array) -> None:
    etree.SubElement(robot, "link", name=child)
    joint = etree.SubElement(robot, "joint", name=f"{child}_fixed", type="fixed")
    _origin(joint, T)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)


def _joint(robot: etree._Element, parent: str, row: DHRow, T: Array, limits: tuple[float, float]) -> str:
    child = f"{row.name}_link"
    etree.SubElement(robot, "link", name=child)
    joint = etree.SubElement(robot, "joint", name=row.name, type=row.kind)
    _origin(joint, T)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)
    etree.SubElement(joint, "axis", xyz="0 0 1")
    etree.SubElement(joint, "limit", lower=repr(limits[0]), upper=repr(limits[1]), effort="0", velocity="0")
    return child
