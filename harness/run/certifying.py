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
from harness.run.outcome import Certified, Outcome, Run
from harness.se3 import Array
from harness.workers.pool import Workers

MOST_PLACEMENTS = 4_000_000  # of one source, 96 bytes each

Certify: TypeAlias = "Callable[[Outcome], Certified]"


def certify_all(run: Run, workers: Workers) -> None:
    """A certificate, or the reason why there is none, for every source that ran."""
    try:
        axes = joint_axes(run.model)
        nodes = math.prod(axis.count for axis in axes)
        make = _by_grid if nodes <= GRID_LIMIT else _by_links
        one = make(run, axes)
        tasks = [(outcome, workers.submit(partial(_attempt, outcome, one))) for outcome in run.compared]
        for outcome, task in tasks:
            outcome.certified = task.result()
    except UncertifiableError as why:
        for outcome in run.compared:
            outcome.certified = Certified(reason=str(why))


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


def _starts(run: Run, source: str) -> list[Array]:
    """The worst configurations the run has seen for a source."""
    comparison = run.discrepancies()
    indices = {int(i) for part in (comparison.position, comparison.rotation) for i in part[source].argmax if i >= 0}
    return [run.model.configurations.one(run.options.seed, i)[None, :] for i in sorted(indices)]


def _attempt(outcome: Outcome, work: Certify) -> Certified:
    """An engine that raises while being certified gets no certificate; what it has shown before stands."""
    try:
        return work(outcome)
    except UncertifiableError as why:
        return Certified(reason=str(why))
    except Exception as error:  # an engine's failure is its result
        return Certified(reason=f"{outcome.name} raised {type(error).__name__}: {error}")


def _by_grid(run: Run, axes: list[Axis]) -> Certify:
    nodes, reference = grid(axes), run.reference

    def sampled(outcome: Outcome) -> Sampled:
        return sample(_evaluate(outcome.running()), axes, np.random.default_rng(run.options.seed))

    try:
        base = sampled(reference)
    except Exception as error:  # an engine's failure is its result
        raise UncertifiableError(f"{reference.name} raised {type(error).__name__}: {error}") from error

    def one(outcome: Outcome) -> Certified:
        own, common = sampled(outcome), _Common.of(outcome.running(), reference.running())
        known = Certified(
            form="grid",
            nodes=len(nodes),
            residual=own.residual,
            reference_residual=base.residual,
            limit=own.limit,
            frames=common.frames,
        )
        if reason := _refusal(own, base, outcome.name, reference.name):
            return replace(known, reason=reason)
        a, b = replace(own, values=own.values[:, common.rows_a]), replace(base, values=base.values[:, common.rows_b])
        D = a.values - b.values
        flat = np.concatenate([np.abs(D[:, :, 3]).sum(axis=-1), np.abs(D[:, :, :3]).sum(axis=(-2, -1))], axis=1)
        starts = np.concatenate([nodes[sorted(set(flat.argmax(axis=0)))], *_starts(run, outcome.name)])
        bounds = certify(a, b, axes)
        own_links, base_links, by_links = _link_bounds(run, outcome, axes, common)
        if own_links.holds and base_links.holds:
            bounds = tighter(bounds, by_links)
        pair = _Pair(outcome.running(), reference.running(), axes)
        return _with_found(known, bounds, pair, starts, lambda q: np.tensordot(weights(axes, q), D, axes=1))

    return one


def _by_links(run: Run, axes: list[Axis]) -> Certify:
    reference = run.reference

    def one(outcome: Outcome) -> Certified:
        common = _Common.of(outcome.running(), reference.running())
        own, base, bounds = _link_bounds(run, outcome, axes, common)
        known = Certified(
            form="links",
            nodes=sum(len(value) for value in own.values),
            residual=own.residual,
            reference_residual=base.residual,
            limit=own.limit,
            frames=common.frames,
        )
        if reason := _refusal(own, base, outcome.name, reference.name):
            return replace(known, reason=reason)
        starts = np.concatenate(_starts(run, outcome.name))
        return _with_found(known, bounds, _Pair(outcome.running(), reference.running(), axes), starts, None)

    return one


def _link_bounds(run: Run, outcome: Outcome, axes: list[Axis], common: _Common) -> tuple[SampledLinks, SampledLinks, Bounds]:
    """Both sources link by link, and the bounds that follow if the premise holds for both."""
    links = chain_links(run.model, common.frames)
    if any(math.prod(axes[j].count for j in link.joints) > GRID_LIMIT for link in links):
        raise UncertifiableError("too many joints between two mapped frames: map the frames between them")
    nodes = sum(math.prod(axes[j].count for j in link.joints) for link in links)
    if nodes * len(common.frames) > MOST_PLACEMENTS:
        raise UncertifiableError(f"too many frames: {len(common.frames)}, at {nodes} configurations")
    own, base = (
        sample_links(_rows(_evaluate(o.running()), rows), axes, links, np.random.default_rng(run.options.seed))
        for o, rows in ((outcome, common.rows_a), (run.reference, common.rows_b))
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


@dataclass(frozen=True)
class _Pair:
    """A source, the reference, and how both depend on each joint."""

    source: Bound
    reference: Bound
    axes: list[Axis]

    def difference(self, q: Array) -> Array:
        """Source less reference at the frames both have, q (N, n): (N, F, 4, 3)."""
        common = _Common.of(self.source, self.reference)
        return np.asarray(_evaluate(self.source)(q)[:, common.rows_a] - _evaluate(self.reference)(q)[:, common.rows_b])


def _with_found(known: Certified, bounds: Bounds, pair: _Pair, starts: Array, interpolant: Evaluate | None) -> Certified:
    """Add the bounds and the largest discrepancies found; a bound that is exceeded is no bound, and refused."""
    floor = 2.0 * rounding_of(len(pair.axes), 1.0)
    position, rotation = found_from(pair.difference, interpolant or pair.difference, pair.axes, starts, floor)
    if not ((position <= bounds.position).all() and (rotation <= bounds.rotation).all()):  # also if one is no number
        return replace(known, reason="a discrepancy above the bound was found: the premise does not hold")
    return replace(known, bounds=bounds, position_found=position, rotation_found=rotation)
