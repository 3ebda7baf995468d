"""The parts of the report document that describe the two descriptions: the frame trees, and their canonical parameters."""

from __future__ import annotations

from typing import Literal

from harness.report.parts import Coordinate, Count, Part


class Link(Part):
    """A link of the URDF and the joint that carries it. mapped: the mapped frame it is, if any."""

    name: str
    parent: str | None
    joint: str = ""
    type: str = ""
    mapped: str = ""


class DHFrame(Part):
    """A frame of the DH table, base first. mapped: the mapped frames read in it."""

    label: str
    row: str = ""
    type: str = ""
    mapped: list[str] = []


class Trees(Part):
    """What is mapped to what: the DH frames in order, and the URDF's links, parents first; `omitted` links are not listed."""

    dh: list[DHFrame] = []
    urdf: list[Link] = []
    omitted: Count = 0


class ParameterPair(Part):
    """One canonical number in the table and in the URDF [m or rad]. subject: a joint, `base` or `tool`.

    difference: URDF less table, angles within half a turn; marked: larger than the tolerance of the comparison.
    """

    subject: str
    parameter: str
    unit: Literal["m", "rad"]
    table: Coordinate
    urdf: Coordinate
    difference: Coordinate
    marked: bool


class SideBySide(Part):
    """Canonical DH parameters of both descriptions from the base frame to the frame `tip`, or the problem that prevents them."""

    convention: Literal["standard", "modified"]
    tip: str = ""
    rows: list[ParameterPair] = []
    problem: str = ""
