"""Whether a command speaks the worker protocol, and if not, what its author has to change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.errors import EngineFailed
from harness.se3 import REPEATED, RIGID, Array
from harness.workers import protocol
from harness.workers.process import ProcessEngine

END_TIMEOUT = 5.0  # seconds to end after stdin has


@dataclass(frozen=True)
class Finding:
    """One requirement of the protocol, and what is wrong if it is not met."""

    what: str
    problem: str = ""


def examine(engine: ProcessEngine, turning: Sequence[bool]) -> Iterator[Finding]:
    """Check a worker that has answered its greeting, one requirement after the other; stops at the first that ends it."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, (protocol.MAX_BLOCK, len(engine.joints)))
    answers: dict[int, Array] = {}
    for count in (1, 3, protocol.MAX_BLOCK):
        what = f"answers a block of {count} with {count} x {len(engine.frames)} placements of 16 float64"
        try:
            answers[count] = engine.placements(q[:count], engine.frames)
        except EngineFailed as error:
            yield Finding(what, error.reason)
            return
        yield Finding(what)
    checks: list[tuple[str, Callable[[], str]]] = [
        ("placements are finite", lambda: _finite(engine, answers[protocol.MAX_BLOCK])),
        ("last row 0 0 0 1, rows first", lambda: _last_row(engine, answers[protocol.MAX_BLOCK])),
        ("rotations are rotations", lambda: _rotations(engine, answers[protocol.MAX_BLOCK])),
        ("an answer depends on its own q alone", lambda: _stateless(engine, q, answers)),
        ("joints move something", lambda: _moving(engine, answers[protocol.MAX_BLOCK])),
        ("takes values beyond the joint limits", lambda: _beyond(engine, q, np.array(turning))),
    ]
    for what, check in checks:
        try:
            yield Finding(what, check())
        except EngineFailed as error:
            yield Finding(what, error.reason)
            return
    code = engine.finish(END_TIMEOUT)
    problem = f"it went on running for {END_TIMEOUT:g} s" if code is None else f"exit code {code}" if code else ""
    yield Finding("ends with exit code 0 when its stdin ends", problem)


def _finite(engine: ProcessEngine, T: Array) -> str:
    bad = np.argwhere(~np.isfinite(T).all(axis=(2, 3)))
    return (
        f"configuration {bad[0][0]}, frame {engine.frames[bad[0][1]]!r} is not: {T[tuple(bad[0])].tolist()}" if len(bad) else ""
    )


def _last_row(engine: ProcessEngine, T: Array) -> str:
    wrong = np.abs(T[:, :, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=2) > RIGID
    if not wrong.any():
        return ""
    if (np.abs(T[..., 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=2) <= RIGID).all():
        return "the last column is 0 0 0 1 instead: write rows first, or transpose each matrix"
    k, f = np.argwhere(wrong)[0]
    return f"configuration {k}, frame {engine.frames[f]!r}: last row {T[k, f, 3].tolist()}"


def _rotations(engine: ProcessEngine, T: Array) -> str:
    R = T[..., :3, :3]
    off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(2, 3))
    k, f = np.unravel_index(int(off.argmax()), off.shape)
    if off[k, f] > RIGID:
        return f"configuration {k}, frame {engine.frames[f]!r}: R'R differs from the identity by {off[k, f]:.2g}"
    if (np.linalg.det(R) < 0).any():
        return "a determinant is -1: a mirrored frame"
    return ""


def _stateless(engine: ProcessEngine, q: Array, answers: dict[int, Array]) -> str:
    """The same configurations alone, in another order and in another block must give the same placements."""
    whole = answers[protocol.MAX_BLOCK]
    for rows in ([0], [2], [2, 1, 0], [protocol.MAX_BLOCK - 1]):
        again = engine.placements(q[rows], engine.frames)
        if (off := np.abs(again - whole[rows]).max()) > REPEATED:
            return f"configurations {rows} asked for again differ by {off:.2g}: it keeps state, or orders them by frame first"
    return ""


def _moving(engine: ProcessEngine, T: Array) -> str:
    return "no frame moves, whatever q is" if np.abs(T - T[:1]).max() <= REPEATED else ""


def _beyond(engine: ProcessEngine, q: Array, turning: NDArray[np.bool_]) -> str:
    """A turn more must change nothing; a joint that slides is moved by a metre."""
    reason = "forward kinematics has no limits, and a run tests it beyond them"
    near, far = engine.placements(q[:8], engine.frames), engine.placements(q[:8] + 2 * np.pi * turning, engine.frames)
    further = engine.placements(q[:8] + np.where(turning, -20 * np.pi, 1.0), engine.frames)
    if not (np.isfinite(far).all() and np.isfinite(further).all()):
        return f"not finite there: {reason}"
    off = float(np.abs(far - near).max())
    return f"a whole turn more of every joint changes a placement by {off:.2g}: does it clamp? {reason}" if off > RIGID else ""
