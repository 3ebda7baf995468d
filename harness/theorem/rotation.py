"""The rotation of two chains alone: lengths and slides drop out, and so do equal joints at both ends.

|R_a - R_b| in the Frobenius norm is the same for the inverses, so what both chains end with drops out as what they begin with.
"""

from __future__ import annotations

from dataclasses import replace

import flint
import numpy as np

from harness.theorem.balls import Matrix, rigid
from harness.theorem.chain import Chains, Path, Step
from harness.theorem.coefficients import Coefficients
from harness.theorem.normal import Line
from harness.theorem.pair import Pair

_FRAME = "frame"


def rotation_difference(pair: Pair, name: str) -> Coefficients | None:
    """The difference of the rotations at a frame, as short a polynomial as can be. None if it has too many terms."""
    paths = (turns_of(pair.a[name]), turns_of(pair.b[name]))
    error = 0.0
    for _ in range(2):
        turned = _pair(pair, *paths)
        rests = turned.rests(_FRAME)
        error += rests.chord
        paths = (_inverted(rests.a), _inverted(rests.b))
    functions = _pair(pair, *paths).multiplied_out(_FRAME)
    return functions and replace(functions[1], error=functions[1].error + error)


def turns_of(line: Line) -> Path:
    """A line's rotation: no length, no slide."""
    steps: list[Step] = []
    for motion in line.motions:
        steps.append(Step(T=_rotation(motion.before)))
        if motion.turns:
            steps.append(motion.step)
    return (*steps, Step(T=_rotation(line.tail)))


def _pair(pair: Pair, a: Path, b: Path) -> Pair:
    joints = tuple(str(j) for j in range(len(pair.scales)))
    made = Pair.of(Chains(joints, {_FRAME: a}), Chains(joints, {_FRAME: b}), np.zeros_like(pair.ranges))
    made.scales = pair.scales
    return made


def _inverted(path: Path) -> Path:
    return tuple(step.inverted() for step in reversed(path))


def _rotation(T: Matrix) -> Matrix:
    return rigid([[T[i, j] for j in range(3)] for i in range(3)], [flint.arb(0)] * 3)
