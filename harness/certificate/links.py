"""The certificate of a long chain, link by link: 3 evaluations a joint instead of 3 to the power of their number.

Between neighbouring mapped frames a placement depends on one joint or a few. Each such link is bounded by itself, the
independence of all other joints is tested, and the bounds are composed along the chain:
    A_1 ... A_m - B_1 ... B_m = sum_s A_1 ... A_(s-1) (A_s - B_s) B_(s+1) ... B_m
so |p_A - p_B| <= sum_s (|dp_s| + |dR_s|_2 reach_(s,m)) and |R_A - R_B|_F <= sum_s |dR_s|_F.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness.certificate.certify import (
    Bounds,
    Evaluate,
    largest,
    lebesgue,
    probes,
    rounding_of,
    sup_bound,
    within,
)
from harness.certificate.interpolation import Axis, grid, weights
from harness.se3 import Array, chord_angle


@dataclass(frozen=True)
class Link:
    """One frame seen from another, which depends on a few joints alone.

    Attributes:
        parent: index of the frame it is seen from; None for the base.
        child: index of the frame.
        joints: indices of the joints.
    """

    parent: int | None
    child: int
    joints: tuple[int, ...]


@dataclass(frozen=True)
class SampledLinks:
    """One engine, link by link.

    Attributes:
        values: for each link its placements (M_link, 4, 3) on the link's own grid.
        residual: see `Sampled`.
        limit: see `Sampled`.
    """

    values: tuple[Array, ...]
    residual: float
    limit: float

    @property
    def holds(self) -> bool:
        """Whether the premise holds; never for what is not finite."""
        return within(self.residual, self.limit)


def sample_links(evaluate: Evaluate, axes: list[Axis], links: list[Link], rng: np.random.Generator) -> SampledLinks:
    """Evaluate an engine at every link's own nodes, and test the premise at random configurations.

    All joints that a link does not depend on stand at one random place.

    Args:
        evaluate: the engine.
        axes: how its placements depend on each joint.
        links: the links.
        rng: draws the random configurations.
    """
    rest = np.array([rng.uniform(axis.lower, axis.upper) for axis in axes])
    blocks = []
    for link in links:
        nodes = grid([axes[j] for j in link.joints]) if link.joints else np.empty((1, 0))
        q = np.tile(rest, (len(nodes), 1))
        q[:, list(link.joints)] = nodes
        blocks.append(q)
    ends = np.cumsum([len(block) for block in blocks])
    placed = evaluate(np.concatenate(blocks))
    values = tuple(_relative(part, link) for part, link in zip(np.split(placed, ends[:-1]), links, strict=True))
    q = probes(axes, rng)
    tested = evaluate(q)
    residual = 0.0
    growth = max(lebesgue([axes[j] for j in link.joints]) for link in links)
    with np.errstate(invalid="ignore", over="ignore"):
        for link, value in zip(links, values, strict=True):
            predicted = np.tensordot(weights([axes[j] for j in link.joints], q[:, list(link.joints)]), value, axes=1)
            residual = max(residual, largest(_relative(tested, link) - predicted))
        reach = largest(np.linalg.norm(tested[:, :, 3], axis=-1))
    # Two placements, each multiplied into the other, make one link: twice the error and once more the reach.
    rounding = 4.0 * rounding_of(len(axes), reach)
    return SampledLinks(values, residual, (1.0 + growth) * rounding)


def certify_links(a: SampledLinks, b: SampledLinks, axes: list[Axis], links: list[Link], frames: int) -> Bounds:
    """Upper bounds at every frame, composed along the chain; see the module.

    Args:
        a: one source, link by link.
        b: the other; its reach is used.
        axes: how placements depend on each joint.
        links: the links, from the base to every frame.
        frames: number of frames.
    """
    position, chord = np.full(frames, np.inf), np.full(frames, np.inf)
    by_child = {link.child: i for i, link in enumerate(links)}
    parts = [_link_bounds(a.values[i], b.values[i], axes, link, a.limit + b.limit) for i, link in enumerate(links)]
    for child in by_child:
        shift, turn, reach = 0.0, 0.0, 0.0
        current: int | None = child
        while current is not None:
            i = by_child[current]
            dp, dR, length = parts[i]
            shift += dp + dR / math.sqrt(2.0) * reach  # |R_a - R_b|_2 = |R_a - R_b|_F / sqrt 2
            turn += dR
            reach += length
            current = links[i].parent
        position[child], chord[child] = shift, turn
    return Bounds(position, chord_angle(chord), ("links",) * frames)


def _link_bounds(a: Array, b: Array, axes: list[Axis], link: Link, allowance: float) -> tuple[float, float, float]:
    """Bounds over all q of one link: |dp| [m], |dR|_F, and the length |p_b| [m]."""
    own, D = [axes[j] for j in link.joints], a - b
    parts = (D[:, 3], D[:, :3].reshape(len(D), 9), b[:, 3])
    shift, turn, length = (float(sup_bound(own, part, allowance)[0]) for part in parts)
    return shift, turn, length


def _relative(T: Array, link: Link) -> Array:
    """T_parent^-1 T_child from placements (N, F, 4, 3), as (N, 4, 3): columns x, y, z and p."""
    child = T[:, link.child]
    if link.parent is None:
        return np.asarray(child)
    parent = T[:, link.parent]
    moved = child.copy()
    moved[:, 3] -= parent[:, 3]
    # Columns are rows here: (R_parent' v) for each column v.
    return np.asarray(np.einsum("nir,nkr->nki", parent[:, :3], moved))
