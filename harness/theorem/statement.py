"""The theorem of two descriptions: for each frame a bound, and whether both are one function."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from harness.description.written import angle_of
from harness.theorem.chain import Chains, Path, Step
from harness.theorem.equality import equal
from harness.theorem.prove import Effort, FrameBound, prove

Equality: TypeAlias = Literal["equal", "equal but for the digits of pi", "not equal", "not decided"]

CLOSE = 1e-12  # m, rad: above, two descriptions are not equal, and nobody asks
MOST_NODES = 4_000_000  # of the grids of all frames together


@dataclass(frozen=True, kw_only=True)
class Theorem:
    """What is proven of two descriptions, from their numbers alone.

    Attributes:
        frames: the bound of each frame that both have.
        equality: for each frame, whether both are the same function.
        ranges: for each joint that slides the range that the bounds hold in, lower and upper end [m].
    """

    frames: Mapping[str, FrameBound]
    equality: Mapping[str, Equality]
    ranges: Mapping[str, tuple[float, float]]

    @property
    def position(self) -> float:
        """The largest bound of all frames [m]."""
        return max((frame.position for frame in self.frames.values()), default=0.0)

    @property
    def is_equal(self) -> bool:
        """Whether both are the same function at every frame."""
        return bool(self.frames) and all(word == "equal" for word in self.equality.values())

    @property
    def rotation(self) -> float:
        """The largest bound of all frames [rad]."""
        return max((frame.rotation for frame in self.frames.values()), default=0.0)


def theorem(a: Chains, b: Chains, ranges: Mapping[str, tuple[float, float]], effort: Effort | None = None) -> Theorem:
    """Prove how far two descriptions can be apart.

    Args:
        a: one description.
        b: the other, with the same joints.
        ranges: for each joint that slides, the range that it is looked at in, lower and upper end [m].
        effort: how hard to look for sharp bounds; None: as many nodes for each frame as all together may have.
    """
    limits = np.array([ranges.get(joint, (0.0, 0.0)) for joint in a.joints]).reshape(-1, 2)
    shared = sum(name in b.paths for name in a.paths)
    effort = effort or Effort(nodes=min(Effort().nodes, MOST_NODES // max(shared, 1)))
    bounds = prove(a, b, limits, effort)
    equality = _equality(a, b, bounds)
    exact = {name for name, word in equality.items() if word == "equal"}
    frames = {name: _nothing(bound) if name in exact else bound for name, bound in bounds.items()}
    return Theorem(frames=frames, equality=equality, ranges=dict(ranges))


def _equality(a: Chains, b: Chains, bounds: Mapping[str, FrameBound]) -> dict[str, Equality]:
    """What was found somewhere, in ball arithmetic, is no equality. The rest is decided, as written and as meant."""
    apart = {name for name, bound in bounds.items() if bound.position_found > 0.0 or bound.rotation_found > 0.0}
    close = [name for name, bound in bounds.items() if max(bound.position, bound.rotation) < CLOSE]
    words: dict[str, Equality] = {name: "not equal" if name in apart else "not decided" for name in bounds}
    decided = equal(*(c.only(name for name in close if name not in apart) for c in (a, b)))
    words |= {name: "equal" for name, same in decided.items() if same}
    rest = [name for name in close if words[name] != "equal"]
    meant = equal(*(with_pi(c.only(rest)) for c in (a, b)))
    return words | {name: "equal but for the digits of pi" for name in rest if meant[name]}


def _nothing(bound: FrameBound) -> FrameBound:
    return replace(bound, position=0.0, rotation=0.0, position_found=0.0, rotation_found=0.0, method="constant")


def with_pi(chains: Chains) -> Chains:
    """The chains with every angle that is written as the float64 next to a multiple of pi taken as that multiple.

    A URDF has no other way to write it: 1.5707963267948966 is 6e-17 away from a right angle.
    """
    known: dict[Step, Step] = {}

    def meant(step: Step) -> Step:
        if not step.turns or not step.amount.rational or step.amount.of_pi:
            return step
        if step not in known:
            known[step] = replace(step, amount=angle_of(float(step.amount.rational)))
        return known[step]

    def path_of(path: Path) -> Path:
        return tuple(meant(step) for step in path)

    return Chains(chains.joints, {name: path_of(path) for name, path in chains.paths.items()})
