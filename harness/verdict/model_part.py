"""What a report shows of the two descriptions themselves: what is mapped to what, and their canonical parameters side by side."""

from __future__ import annotations

from collections.abc import Iterator

from harness import se3
from harness.description.dh import DHRow
from harness.description.model import RobotModel
from harness.description.urdf import Urdf
from harness.kinematics.side_by_side import COLUMNS, Unit, canonical_side, difference_of, with_matching_normals
from harness.report.model_parts import DHFrame, Link, ParameterPair, SideBySide, Trees
from harness.run.explaining import recipes_of
from harness.run.outcome import Run
from harness.se3 import Array

MOST_LINKS = 120

PLACED: tuple[tuple[str, Unit], ...] = (
    ("x", "m"), ("y", "m"), ("z", "m"), ("roll", "rad"), ("pitch", "rad"), ("yaw", "rad"),
)  # fmt: skip


def trees(model: RobotModel) -> Trees:
    """The frames of the table in order, and the links of the URDF, parents first."""
    rows = {str(i + 1): row for i, row in enumerate(model.table.rows)}
    dh = []
    for label in model.table.frames:
        row = rows.get(label)
        names = [f.name for f in model.frames.frames if f.dh == label]
        dh.append(DHFrame(label=label, row=row.name if row else "", type=row.kind if row else "", mapped=names))
    links = [] if model.urdf is None else list(_links(model.urdf, model))
    wanted = [link for link in links if link.mapped] if len(links) > MOST_LINKS else links
    return Trees(dh=dh, urdf=wanted, omitted=len(links) - len(wanted))


def _links(urdf: Urdf, model: RobotModel) -> Iterator[Link]:
    """Depth first; a loop, because a chain may be deeper than Python recurses."""
    mapped = {f.urdf: f.name for f in model.frames.frames if f.urdf is not None}
    stack, seen = [Link(name=root, parent=None, mapped=mapped.get(root, "")) for root in reversed(urdf.roots)], set()
    while stack:
        link = stack.pop()
        if link.name in seen:  # two parents: the lint says so, the tree shows it once
            continue
        seen.add(link.name)
        yield link
        stack += [
            Link(name=j.child, parent=link.name, joint=j.name, type=j.type, mapped=mapped.get(j.child, ""))
            for j in reversed(urdf.children(link.name))
        ]


def side_by_side(run: Run) -> SideBySide | None:
    """Canonical parameters of the table and of the URDF, from the base frame to the last frame both have; None without a URDF."""
    model = run.model
    if model.urdf is None or model.urdf_joints is None:
        return None
    common = [f for f in model.frames.frames if f.urdf is not None]
    tip = next((f for f in reversed(common) if f.relation != "rigid"), common[-1]).name
    kinds = [next(iter(recipes_of(model, kind, (tip,), run.rigid_transforms))) for kind in ("dh", "urdf")]
    convention = model.table.convention
    a, b = (canonical_side(recipe.mechanism, convention, tip) for recipe in kinds)
    if problem := a.problem or b.problem:
        whose = "the table" if a.problem else "the URDF"
        return SideBySide(convention=convention, tip=tip, problem=f"{whose} has no canonical DH table: {problem}")
    limits: dict[Unit, float] = {"m": model.file.tolerance.position, "rad": model.file.tolerance.rotation}
    rows = list(_placed("base", a.base, b.base, limits))
    for one, other in zip(a.rows, with_matching_normals(a.rows, b.rows, convention), strict=True):
        rows += _row(one, other, limits)
    return SideBySide(convention=convention, tip=tip, rows=[*rows, *_placed("tool", a.tool, b.tool, limits)])


def _row(a: DHRow, b: DHRow, limits: dict[Unit, float]) -> Iterator[ParameterPair]:
    for name, unit in COLUMNS:
        yield _pair(a.name, name, unit, float(getattr(a, name)), float(getattr(b, name)), limits)


def _placed(subject: str, T_a: Array, T_b: Array, limits: dict[Unit, float]) -> Iterator[ParameterPair]:
    a, b = ([*T[:3, 3].tolist(), *se3.to_rpy(T)] for T in (T_a, T_b))
    for (name, unit), x, y in zip(PLACED, a, b, strict=True):
        yield _pair(subject, name, unit, x, y, limits)


def _pair(subject: str, name: str, unit: Unit, a: float, b: float, limits: dict[Unit, float]) -> ParameterPair:
    difference = difference_of(b, a, unit)
    return ParameterPair(
        subject=subject, parameter=name, unit=unit, table=a, urdf=b, difference=difference, marked=abs(difference) > limits[unit]
    )
