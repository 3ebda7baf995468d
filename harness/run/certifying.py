"""Certifies every source of a run against its reference, on a grid or link by link."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from harness.certificate.certify import Bounds, Evaluate, Sampled, certify, found_from, rounding_of, sample, tighter
from harness.certificate.interpolation import GRID_LIMIT, Axis, grid, weights
from harness.certificate.joint_axes import UncertifiableError, joint_axes
from harness.certificate.links import Link, SampledLinks, certify_links, sample_links
from harness.comparison.components import components, mapped
from harness.description.model import RobotModel
from harness.run.binding import Bound
from harness.run.plan import Participant
from harness.run.results import Certified, Results
from harness.se3 import Array
from harness.workers.pool import Workers

Certify: TypeAlias = "Callable[[Participant], Certified]"


def certify_all(results: Results, workers: Workers) -> dict[str, Certified]:
    """A certificate, or the reason why there is none, for every source that ran, by name."""
    reference, *others = results.participants
    running = [p for p in others if p.bound is not None]
    if reference.bound is None or results.comparison is None:
        return {}
    try:
        axes = joint_axes(results.model)
        nodes = math.prod(axis.count for axis in axes)
        make = _by_grid if nodes <= GRID_LIMIT else _by_links
        one = make(results, reference, axes)
        tasks = {p.name: workers.submit(partial(_attempt, p, one)) for p in running}
        return {name: task.result() for name, task in tasks.items()}
    except UncertifiableError as why:
        return {p.name: Certified(reason=str(why)) for p in running}


def _evaluate(bound: Bound) -> Evaluate:
    """A source's mapped frames as (N, F_available, 4, 3)."""
    return lambda q: np.ascontiguousarray(mapped(components(bound.raw(q)), bound.view).transpose(3, 0, 1, 2))


def _rows(evaluate: Evaluate, rows: list[int]) -> Evaluate:
    return lambda q: evaluate(q)[:, rows]


@dataclass(frozen=True)
class _Common:
    """The mapped frames two sources share, and where each keeps them."""

    frames: list[int]
    rows_a: list[int]
    rows_b: list[int]

    @classmethod
    def of(cls, a: Bound, b: Bound) -> _Common:
        have_a, have_b = a.view.available, b.view.available
        frames = [f for f in have_a if f in have_b]
        return cls(frames, [have_a.index(f) for f in frames], [have_b.index(f) for f in frames])


def _starts(results: Results, name: str) -> list[Array]:
    """The worst configurations the run has seen for a source."""
    if results.comparison is None:
        return []
    indices = {int(i) for part in (results.comparison.position, results.comparison.rotation) for i in part[name].argmax if i >= 0}
    return [results.model.configurations.one(results.options.seed, i)[None, :] for i in sorted(indices)]


def _attempt(participant: Participant, work: Callable[[Participant], Certified]) -> Certified:
    """An engine that raises while being certified gets no certificate; what it has shown before stands."""
    try:
        return work(participant)
    except UncertifiableError as why:
        return Certified(reason=str(why))
    except Exception as error:  # an engine's failure is its result
        return Certified(reason=f"{participant.name} raised {type(error).__name__}: {error}")


def _by_grid(results: Results, reference: Participant, axes: list[Axis]) -> Certify:
    nodes = grid(axes)

    def sampled(participant: Participant) -> Sampled:
        return sample(_evaluate(participant.running()), axes, np.random.default_rng(results.options.seed))

    try:
        base = sampled(reference)
    except Exception as error:  # an engine's failure is its result
        raise UncertifiableError(f"{reference.name} raised {type(error).__name__}: {error}") from error

    def one(participant: Participant) -> Certified:
        own, common = sampled(participant), _Common.of(participant.running(), reference.running())
        known = Certified(
            reason="",
            form="grid",
            nodes=len(nodes),
            residual=own.residual,
            reference_residual=base.residual,
            limit=own.limit,
            frames=common.frames,
        )
        if reason := _refusal(own, base, participant.name, reference.name):
            return replace(known, reason=reason)
        a, b = replace(own, values=own.values[:, common.rows_a]), replace(base, values=base.values[:, common.rows_b])
        D = a.values - b.values
        flat = np.concatenate([np.abs(D[:, :, 3]).sum(axis=-1), np.abs(D[:, :, :3]).sum(axis=(-2, -1))], axis=1)
        starts = np.concatenate([nodes[sorted(set(flat.argmax(axis=0)))], *_starts(results, participant.name)])
        bounds = certify(a, b, axes)
        own_links, base_links, by_links = _link_bounds(results, participant, reference, axes, common)
        if own_links.holds and base_links.holds:
            bounds = tighter(bounds, by_links)
        return _with_found(
            known, bounds, participant, reference, axes, starts,
            lambda q: np.tensordot(weights(axes, q), D, axes=1),
        )  # fmt: skip

    return one


def _by_links(results: Results, reference: Participant, axes: list[Axis]) -> Certify:
    def one(participant: Participant) -> Certified:
        common = _Common.of(participant.running(), reference.running())
        own, base, bounds = _link_bounds(results, participant, reference, axes, common)
        count = sum(len(value) for value in own.values)
        known = Certified(
            reason="",
            form="links",
            nodes=count,
            residual=own.residual,
            reference_residual=base.residual,
            limit=own.limit,
            frames=common.frames,
        )
        if reason := _refusal(own, base, participant.name, reference.name):
            return replace(known, reason=reason)
        starts = np.concatenate(_starts(results, participant.name))
        return _with_found(known, bounds, participant, reference, axes, starts, None)

    return one


def _link_bounds(
    results: Results, participant: Participant, reference: Participant, axes: list[Axis], common: _Common
) -> tuple[SampledLinks, SampledLinks, Bounds]:
    """Both sources link by link, and the bounds that follow if the premise holds for both."""
    links = chain_links(results.model, common.frames)
    if any(math.prod(axes[j].count for j in link.joints) > GRID_LIMIT for link in links):
        raise UncertifiableError("too many joints between two mapped frames: map the frames between them")
    own, base = (
        sample_links(_rows(_evaluate(p.running()), rows), axes, links, np.random.default_rng(results.options.seed))
        for p, rows in ((participant, common.rows_a), (reference, common.rows_b))
    )
    return own, base, certify_links(own, base, axes, links, len(common.frames))


def chain_links(model: RobotModel, frames: list[int]) -> list[Link]:
    """The chain as links between mapped frames: each frame seen from the last one before it that fewer joints move.

    `frames` are the mapped frames in use; links speak of their positions in it.
    """
    moving = [row.kind != "fixed" for row in model.table.rows]
    entries = [model.frames.frames[f] for f in frames]
    before = [sum(moving[: max(0, model.table.frames.index(e.dh) - 1)]) for e in entries]
    links = []
    for child, joints in enumerate(before):
        parent = max((i for i, k in enumerate(before) if k < joints), key=lambda i: before[i], default=None)
        own = set(range(0 if parent is None else before[parent], joints))
        start = model.frames.base if parent is None else entries[parent]
        links.append(Link(parent, child, tuple(sorted(own | _driving(model, start.urdf, entries[child].urdf)))))
    return links


def _driving(model: RobotModel, parent: str | None, child: str | None) -> set[int]:
    """Model joints that move one URDF link relative to another, couplings and mimic followers included."""
    if model.urdf is None or model.urdf_joints is None or parent is None or child is None:
        return set()
    names = {joint.name for joint in model.urdf.between(parent, child)}
    rows = [row for row, name in enumerate(model.urdf_joints.names) if name in names]
    return {int(j) for j in np.flatnonzero(model.urdf_joints.A[rows].any(axis=0))}


def _refusal(own: Sampled | SampledLinks, base: Sampled | SampledLinks, name: str, reference: str) -> str:
    for who, sampled in ((name, own), (reference, base)):
        if not sampled.holds:
            return (
                f"{who} is not the polynomial in sines and cosines that a serial chain is: it differs from its own interpolant "
                f"by {sampled.residual:.2g}, rounding explains {sampled.limit:.2g}"
            )
    return ""


def _with_found(
    known: Certified, bounds: Bounds, participant: Participant, reference: Participant, axes: list[Axis], starts: Array,
    interpolant: Evaluate | None,
) -> Certified:  # fmt: skip
    """Add the bounds and the largest discrepancies found; a bound that is exceeded is no bound, and refused."""
    common = _Common.of(participant.running(), reference.running())
    a, b = _evaluate(participant.running()), _evaluate(reference.running())

    def difference(q: Array) -> Array:
        return np.asarray(a(q)[:, common.rows_a] - b(q)[:, common.rows_b])

    floor = 2.0 * rounding_of(len(axes), 1.0)
    position, rotation = found_from(difference, interpolant or difference, axes, starts, floor)
    if not ((position <= bounds.position).all() and (rotation <= bounds.rotation).all()):  # also if one is no number
        return replace(known, reason="a discrepancy above the bound was found: the premise does not hold")
    return replace(known, bounds=bounds, position_found=position, rotation_found=rotation)
