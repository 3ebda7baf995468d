"""Mutants of single numbers, on either side: a part, a millimetre, ten micrometres, a nanometre, the sign."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lxml import etree

from harness.description.joints import mapped_chain
from harness.description.model import RobotModel
from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import check
from harness.mutation.mutant import Cause, Mutant, with_row

STEPS = (
    ("1 mm, 1 mrad", 1e-3, {"m": "1 mm", "rad": "1 mrad"}),
    ("10 um, 10 urad", 1e-5, {"m": "10 um", "rad": "10 urad"}),
    ("1 nm, 1 nrad", 1e-9, {"m": "1 nm", "rad": "1 nrad"}),
)
# What an explanation calls the numbers of an `<origin>`.
ORIGIN_NUMBERS = {"xyz": ("origin x", "origin y", "origin z"), "rpy": ("roll", "pitch", "yaw")}


def changes_of(value: float, unit: str) -> Iterator[tuple[str, str, float]]:
    """(operator, what was done, change) for one number [m or rad]."""
    for operator, step, names in STEPS:
        yield operator, f"+ {names[unit]}", step
    if value != 0.0:
        yield "10 %", "+ 10 %", 0.1 * value
        yield "10 %", "- 10 %", -0.1 * value
        yield "sign", "negated", -2.0 * value


def of_table(model: RobotModel) -> Iterator[Mutant]:
    """Every number of dh.csv."""
    for i, row in enumerate(model.table.rows):
        for name, unit in (("a", "m"), ("alpha", "rad"), ("d", "m"), ("theta", "rad")):
            value = float(getattr(row, name))
            for operator, text, change in changes_of(value, unit):
                mutated = with_row(model, i, **{name: value + change})
                cause = Cause("parameter", row.name, name, -change)
                yield Mutant(name=f"{name} of {row.name} {text}", side="table", operator=operator, model=mutated, causes=(cause,))


def of_urdf(model: RobotModel) -> Iterator[Mutant]:
    """Every number of the origin of every joint on the mapped chain."""
    if model.urdf is None:
        return
    for joint in mapped_chain(model.urdf, model.frames).values():
        for attribute, written, unit in (("xyz", joint.xyz, "m"), ("rpy", joint.rpy, "rad")):
            for k, (name, value) in enumerate(zip(ORIGIN_NUMBERS[attribute], written, strict=True)):
                for operator, text, change in changes_of(value, unit):
                    values = [v + change if i == k else v for i, v in enumerate(written)]
                    yield Mutant(
                        name=f"{name} of {joint.name} {text}",
                        side="urdf",
                        operator=operator,
                        model=with_origin(model, joint.name, attribute, values),
                        causes=(Cause("parameter", joint.name, name, -change),),
                    )


def with_origin(model: RobotModel, joint: str, attribute: str, values: list[float]) -> RobotModel:
    """The model with one attribute of a joint's origin written anew."""

    def edit(element: etree._Element) -> None:
        origin = element.find("origin")
        if origin is None:
            origin = etree.SubElement(element, "origin")
        origin.set(attribute, " ".join(repr(float(v)) for v in values))

    return with_joint(model, joint, edit)


def with_joint(model: RobotModel, joint: str, edit: Callable[[etree._Element], None]) -> RobotModel:
    """The model with one `<joint>` of its URDF edited as XML, in place, and the file read again."""
    if model.urdf is None:
        raise ValueError("expected a model with a URDF")
    robot = etree.fromstring(model.urdf.text.encode())
    edit(next(e for e in robot.iter("joint") if e.get("name") == joint))
    return with_urdf(model, robot)


def with_urdf(model: RobotModel, robot: etree._Element) -> RobotModel:
    """The model with another URDF."""
    if model.urdf is None:
        raise ValueError("expected a model with a URDF")
    urdf = parse_urdf(etree.tostring(robot), model.urdf.path)
    return replace(model, urdf=urdf, findings=check(urdf))
