"""The DH table of a serial chain in a URDF, found from its placements alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness import se3
from harness.convert.result import Derived, DerivedLink
from harness.description.dh import Convention, DHRow, DHTable
from harness.description.joints import leader_of
from harness.description.tidy import tidy_angle, tidy_length, tidy_transform
from harness.description.urdf import MOVABLE, UNSUPPORTED, Urdf, UrdfJoint
from harness.description.urdf_lint import lint
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.lint_traits import refused_for
from harness.engines.registry import adapter_of
from harness.errors import EngineFailed, EngineRefused, InputError, UrdfError
from harness.kinematics.canonical import canonical
from harness.kinematics.screws import screws
from harness.run.options import Options
from harness.se3 import Array

RESIDUAL = 1e-9


def derive(urdf: Urdf, base: str, tip: str, convention: Convention, source: str) -> Derived:
    """DH table of the chain from link `base` to link `tip`, as the engine `source` places them.

    The engine runs in a worker, as in a cross-check: what its library prints does not reach the terminal.

    Raises:
        UrdfError: no DH table exists: a floating or planar joint, a mimic follower, a joint that is no unit screw; or the
            engine refuses the file.
        InputError: the source reads no URDF, or a link does not exist.
        EngineUnavailable: the engine is not installed.
        EngineFailed: the engine ended, or does not have what it should.
    """
    if not source.startswith("urdf:"):
        raise InputError(f"expected a source that reads a URDF, got {source!r}", key="--source")
    for option, link in (("--base", base), ("--tip", tip)):
        urdf.require_link(link, option)
    path = urdf.between(base, tip)
    joints = _chain_joints(urdf, path, base, tip)
    adapter = adapter_of(source)
    with Options(jobs=1).worker_pool() as workers:
        try:
            engine = workers.load(
                adapter, urdf, list(dict.fromkeys([base, *(link for j in path for link in (j.parent, j.child))]))
            )
        except EngineRefused as error:
            raise _refused(urdf, adapter, error) from None
        return _derived(urdf, Span(base, tip, path, joints), convention, engine)


def _refused(urdf: Urdf, adapter: type[Engine], error: EngineRefused) -> UrdfError:
    """The error that says why an engine refuses a file: what the lint has found, where the engine is known to refuse that."""
    finding = refused_for(adapter, lint(urdf))
    reason = f"{adapter.source} refuses the file: {finding.message}" if finding is not None else str(error)
    line = finding.line if finding is not None else None
    return UrdfError(reason, where=urdf.path, line=line, hint="choose another --source, or mend the file")


@dataclass(frozen=True)
class Span:
    """The part of a URDF that a table is derived from.

    Attributes:
        base: link it starts at.
        tip: link it ends at.
        path: all its joints, in order from the base.
        joints: those of them that move.
    """

    base: str
    tip: str
    path: tuple[UrdfJoint, ...]
    joints: list[UrdfJoint]


def _derived(urdf: Urdf, span: Span, convention: Convention, engine: Engine) -> Derived:
    """The table of a chain, as an engine that has been started places it."""
    base, tip, joints, source = span.base, span.tip, span.joints, engine.source
    place = _placer(engine, [joint.name for joint in joints], base)
    prismatic, names = [j.type == "prismatic" for j in joints], [j.name for j in joints]
    chain = screws(lambda q: place(q, [tip])[:, 0], prismatic, np.random.default_rng(0))
    if not chain.residual < RESIDUAL:
        raise UrdfError(
            f"{source} does not place it as a serial chain does: off by {chain.residual:.2g} from its own screws", where=urdf.path
        )
    try:
        form = canonical(chain, prismatic, convention, names)
    except ValueError as error:
        raise UrdfError(f"no DH table: {error}", where=urdf.path) from None
    rows = tuple(
        DHRow(
            name=r.name, kind=r.kind, a=tidy_length(r.a), alpha=tidy_angle(r.alpha), d=tidy_length(r.d), theta=tidy_angle(r.theta)
        )
        for r in form.rows
    )
    table = DHTable(rows, convention, tidy_transform(form.base), tidy_transform(form.tool))
    return Derived(
        urdf=urdf,
        table=table,
        base=base,
        tip=tip,
        links=_links(span.path, base, table, place),
        free=form.free,
        residual=chain.residual,
    )


def _chain_joints(urdf: Urdf, path: tuple[UrdfJoint, ...], base: str, tip: str) -> list[UrdfJoint]:
    for joint in path:
        if joint.type in UNSUPPORTED:
            raise UrdfError(f"no DH table: joint {joint.name!r} is {joint.type}", where=urdf.path, line=joint.line)
        if joint.type in MOVABLE and joint.mimic is not None:
            leader_of(urdf, joint)
            raise UrdfError(
                f"no DH table: joint {joint.name!r} mimics {joint.mimic.joint!r}, and a row has a joint of its own",
                where=urdf.path, line=joint.line,
            )  # fmt: skip
    joints = [joint for joint in path if joint.type in MOVABLE]
    if not joints:
        raise UrdfError(f"no DH table: nothing moves between {base!r} and {tip!r}", where=urdf.path)
    return joints


def _placer(engine: Engine, joints: list[str], base: str) -> Callable[[Array, list[str]], Array]:
    """q (N, n) and link names to placements in the base link, (N, links, 4, 4); all other joints at zero."""
    if missing := [name for name in joints if name not in engine.joints]:
        raise EngineFailed(engine.source, f"does not have joint {missing[0]!r}")

    def place(q: Array, links: list[str]) -> Array:
        values = np.zeros((len(q), len(engine.joints)))
        values[:, [engine.joints.index(name) for name in joints]] = q
        T = engine.placements(values, [base, *links])
        return np.asarray(se3.inverse(T[:, :1]) @ T[:, 1:])

    return place


def _links(
    path: tuple[UrdfJoint, ...], base: str, table: DHTable, place: Callable[[Array, list[str]], Array]
) -> tuple[DerivedLink, ...]:
    """Every link on the way from base to tip with the DH frame that moves with it."""
    at, moved, order = base, 0, []
    for joint in path:
        at = joint.child if joint.parent == at else joint.parent
        moved += joint.type in MOVABLE
        order.append((at, moved))
    zero = np.zeros((1, len(table.joints)))
    T_base_dh = dict(zip(table.frames, DHNumpy(table).placements(zero, table.frames)[0], strict=True))
    T_base_link = place(zero, [name for name, _ in order])[0]
    links = []
    for (name, moved), T in zip(order, T_base_link, strict=True):
        label = "base" if moved == 0 else "tool" if name == order[-1][0] else str(moved)
        links.append(DerivedLink(name, label, se3.inverse(T_base_dh[label]) @ T))
    return tuple(links)
