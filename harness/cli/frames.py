"""`crosscheck frames`: DH rows, the URDF's tree, and what is mapped to what."""

from __future__ import annotations

import math
from pathlib import Path

import click
from rich.console import Console
from rich.text import Text
from rich.tree import Tree

from harness import api
from harness.cli.console import console
from harness.cli.shared import complete_robots, models_option
from harness.description.model import RobotModel
from harness.description.urdf import Urdf, UrdfJoint
from harness.description.urdf_file import read_urdf
from harness.description.urdf_lint import lint
from harness.engines.lint_traits import messages
from harness.rendering.tables import bare_table
from harness.report.text import numbers, plain


@click.command()
@click.argument("robot", metavar="ROBOT|URDF", shell_complete=complete_robots)
@models_option
def frames(robot: str, models: Path | None) -> int:
    """Show the frame tree: joint types, axes, and what each frame is mapped to."""
    return show_frames(robot, models, console())


def show_frames(robot: str, models: Path | None, out: Console) -> int:
    """Print the frame tree of a robot model or a URDF file. Returns 2 if the URDF is not a tree, else 0."""
    path = Path(robot)
    if path.is_file() or path.suffix in (".urdf", ".xacro", ".xml"):
        urdf = read_urdf(path)
        findings = lint(urdf)
        _show_tree(urdf, {}, out)
    else:
        model = api.load_model(robot, models=models)
        findings = model.findings
        _show_dh(model, out)
        if model.urdf is not None:
            _show_tree(model.urdf, _mapped(model), out)
    for finding, message in zip(findings, messages(findings), strict=True):
        style = {"error": "red", "warning": "yellow", "note": "dim"}[finding.level]
        where = f"line {finding.line}: " if finding.line else ""
        out.print(Text(f"{finding.level}: {where}{plain(message)}", style=style), soft_wrap=True)
    return 2 if any(f.level == "error" for f in findings) else 0


def _show_dh(model: RobotModel, out: Console) -> None:
    table = bare_table("DH frame", "row", "type", "a [m]", "alpha [rad]", "d [m]", "theta [rad]", "mapped to")
    for label in model.table.frames:
        row = model.table.rows[int(label) - 1] if label.isdigit() and label != "0" else None
        cells = (row.name, row.kind, *(f"{x:.9g}" for x in (row.a, row.alpha, row.d, row.theta))) if row else ("",) * 6
        names = [f"{f.name} ({f.relation})" for f in model.frames.frames if f.dh == label]
        table.add_row(*(Text(plain(c)) for c in (label, *cells, ", ".join(names))))
    out.print(Text(f"{model.name}, {model.table.convention} DH"))
    out.print(table)
    out.print()


def _show_tree(urdf: Urdf, mapped: dict[str, str], out: Console) -> None:
    for root in urdf.roots:
        tree = Tree(_link(root, mapped))
        _grow(tree, urdf, root, mapped)
        out.print(tree, soft_wrap=True)


def _mapped(model: RobotModel) -> dict[str, str]:
    texts = {}
    for frame in model.frames.frames:
        if frame.urdf is not None:
            how = {"identical": "", "declared": ", declared offset", "rigid": ", rigid, offset measured"}[frame.relation]
            via = f" via {frame.of}" if frame.of else ""
            texts[frame.urdf] = f"{frame.name} = DH frame {frame.dh}{via}{how}"
    return texts


def _link(name: str, mapped: dict[str, str]) -> Text:
    text = Text(plain(name), style="bold")
    if name in mapped:
        text.append(f"  [{plain(mapped[name])}]", style="not bold green")
    return text


def _grow(tree: Tree, urdf: Urdf, root: str, mapped: dict[str, str]) -> None:
    """Add everything below `root`; a loop, because a chain may be deeper than Python recurses."""
    stack, seen = [(tree, root)], {root}
    while stack:
        branch, link = stack.pop()
        for joint in urdf.children(link):
            text = _link(joint.child, mapped)
            text.append(f"  {plain(_describe(joint))}", style="not bold dim")
            if joint.child not in seen:  # two parents or a cycle: the lint says so, the tree shows it once
                seen.add(joint.child)
                stack.append((branch.add(text), joint.child))


def _describe(joint: UrdfJoint) -> str:
    parts = [f"{joint.name}: {joint.type}"]
    if joint.type != "fixed":
        parts.append(f"axis {numbers(joint.axis)}" if joint.axis else "no axis")
        parts.append(_limits(joint))
    parts.append(f"xyz {numbers(joint.xyz)}")
    if any(joint.rpy):
        parts.append(f"rpy {numbers(joint.rpy)}")
    if joint.mimic:
        parts.append(f"mimics {joint.mimic.multiplier:g} * {joint.mimic.joint} + {joint.mimic.offset:g}")
    return ", ".join(parts)


def _limits(joint: UrdfJoint) -> str:
    """`-90 to 90 deg`, `0 to 0.5 m`; `no limit` where there is none, or where the numbers mean none."""
    lower, upper = joint.range
    factor, unit = (1.0, "m") if joint.type == "prismatic" else (math.degrees(1.0), "deg")
    ends = [f"{value * factor:.6g}" if value is not None else "" for value in (lower, upper)]
    if lower is not None and upper is not None:
        return f"limits {ends[0]} to {ends[1]} {unit}"
    if lower is not None:
        return f"limits from {ends[0]} {unit}, no upper limit"
    return f"limits up to {ends[1]} {unit}, no lower limit" if upper is not None else "no limit"
