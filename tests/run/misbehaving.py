"""Engines that are right almost everywhere: each is the in-house FK with one fault. Run in process, or as a worker program."""

from __future__ import annotations

import json
import math
import struct
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from harness.description.dh import DHTable
from harness.engines.dh_numpy import DHNumpy
from harness.se3 import Array
from harness.workers.protocol import decode

MM = 1e-3
Fault = Callable[["Misbehaving", Array], Array]


class Misbehaving(DHNumpy):
    """The in-house FK with a fault.

    calls, rows: calls and configurations so far, those of this call included.
    last_q, last_T: what was asked and answered last, one row.
    memory: what a fault wants to keep.
    """

    source = "dh:fake"
    fault: Fault

    def __init__(self, description: DHTable) -> None:
        super().__init__(description)
        self.calls = self.rows = 0
        self.last_q: Array | None = None
        self.last_T: Array | None = None
        self.memory: dict[object, Array] = {}
        self.began = time.perf_counter()

    def right(self, q: Array) -> Array:
        """The right answer at all frames."""
        return DHNumpy._placements(self, q, self.frames)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        self.calls += 1
        self.rows += len(q)
        T = type(self).fault(self, q)
        self.last_q, self.last_T = q[-1].copy(), T[-1].copy()
        T = T[:, [self.frames.index(frame) for frame in frames]]
        return self.in_buffer(T) if self.memory.get("in a buffer") is not None else T

    def in_buffer(self, T: Array) -> Array:
        """What was asked for, in the one buffer that all calls share."""
        buffer = self.memory.setdefault("buffer", np.empty((4096, *T.shape[1:])))
        buffer[: len(T)] = T
        return buffer[: len(T)]


def moved(T: Array, rows: object = slice(None)) -> Array:
    """Those rows of T 1 mm higher, but for the base, which every engine reads itself against."""
    T = T.copy()
    T[rows, 2:, 2, 3] += MM  # type: ignore[index]
    return T


def first_call(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q)) if self.calls == 1 else self.right(q)


def single_calls(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q)) if len(q) == 1 else self.right(q)


def cache(atol: float) -> Fault:
    def fault(self: Misbehaving, q: Array) -> Array:
        if len(q) == 1 and self.last_q is not None and np.allclose(q[0], self.last_q, rtol=0.0, atol=atol):
            assert self.last_T is not None
            return self.last_T[None].copy()
        return self.right(q)

    return fault


def narrow(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q), np.abs(q[:, 2] - 1.234) < 1e-6)


def dead_band(self: Misbehaving, q: Array) -> Array:
    return self.right(np.where(np.abs(q) < 1e-5, 0.0, q))


def high_rows(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q), slice(2100, None))


def after_forty_calls(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q)) if self.calls > 40 else self.right(q)


def after_twenty_thousand(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q)) if self.rows > 20_000 else self.right(q)


def clamps(self: Misbehaving, q: Array) -> Array:
    return self.right(np.clip(q, -6 * math.pi, 6 * math.pi))


def wraps_wrongly(self: Misbehaving, q: Array) -> Array:
    return self.right(np.where(np.abs(q) > 5 * math.pi, q - np.sign(q) * 6.28, q))


def clamps_at_half_a_turn(self: Misbehaving, q: Array) -> Array:
    return self.right(np.clip(q, -3.2, 3.2))


def reversed_rows(self: Misbehaving, q: Array) -> Array:
    return self.right(q)[:: -1 if len(q) > 1000 else 1].copy()


def changes_q(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    q[:] = 7.0
    return T


def float32_beyond_a_turn(self: Misbehaving, q: Array) -> Array:
    reduced = np.remainder(q.astype(np.float32), np.float32(2 * math.pi)).astype(np.float64)
    return self.right(np.where(np.abs(q) > 2 * math.pi, reduced, q))


def previous_row_first(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    if self.last_T is not None and len(q) > 1:
        T[0] = self.last_T
    return T


def table_lookup(self: Misbehaving, q: Array) -> Array:
    step = 2 * math.pi / 2**20
    return self.right(np.round(q / step) * step)


def degrees_beyond_a_turn(self: Misbehaving, q: Array) -> Array:
    return self.right(np.where(np.abs(q) > 2 * math.pi, np.radians(q), q))


def nan_at_zero(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    T[q[:, 2] == 0.0, 2:, 0, 3] = np.nan
    return T


def nan_at_two_right_angles(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    T[(q == math.pi / 2).sum(axis=1) > 1, 2:, 0, 0] = np.nan
    return T


def drifts(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    T[:, 2:, 2, 3] += 1e-4 * (time.perf_counter() - self.began)
    return T


def every_seventh_call(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q)) if self.calls % 7 == 0 else self.right(q)


def shared_buffer(self: Misbehaving, q: Array) -> Array:
    self.memory["in a buffer"] = q
    return self.right(q)


def backlash(self: Misbehaving, q: Array) -> Array:
    out, at = np.empty_like(q), self.memory.get("at", q[0])
    for i, wanted in enumerate(q):
        at = np.clip(at, wanted - 1e-5, wanted + 1e-5)
        out[i] = at
    self.memory["at"] = at
    return self.right(out)


def rounded_keys(self: Misbehaving, q: Array) -> Array:
    if len(q) > 1:
        return self.right(q)
    return self.memory.setdefault(tuple(np.round(q[0], 6)), self.right(q)).copy()


def raises_alone(self: Misbehaving, q: Array) -> Array:
    if len(q) == 1 and self.calls > 20:
        raise ValueError("expected a batch")
    return self.right(q)


def raises_beyond_limits(self: Misbehaving, q: Array) -> Array:
    if np.abs(q).max() > 2 * math.pi + 1e-9:
        raise ValueError("joint limits exceeded")
    return self.right(q)


def nan_beyond_limits(self: Misbehaving, q: Array) -> Array:
    T = self.right(q)
    T[np.abs(q).max(axis=1) > 2 * math.pi + 1e-9] = np.nan
    return T


def rows_for_columns(self: Misbehaving, q: Array) -> Array:
    return self.right(q.T if q.shape[0] == q.shape[1] else q)


def small_angles(self: Misbehaving, q: Array) -> Array:
    return self.right(np.where(np.abs(q) < 5e-3, np.arcsin(np.clip(q, -1, 1)), q))


def last_row_of_a_block(self: Misbehaving, q: Array) -> Array:
    return moved(self.right(q), slice(len(q) - 1, None)) if len(q) == 4096 else self.right(q)


def sorted_rows(self: Misbehaving, q: Array) -> Array:
    return self.right(q[np.argsort(q[:, 0])] if len(q) > 512 else q)


def one_joint_unchanged(self: Misbehaving, q: Array) -> Array:
    """Looks only at the first joints to see whether anything has moved."""
    if len(q) == 1 and self.last_q is not None and np.array_equal(q[0, :3], self.last_q[:3]):
        assert self.last_T is not None
        return self.last_T[None].copy()
    return self.right(q)


FAULTS: dict[str, Fault] = {
    name: fault
    for name, fault in globals().items()
    if callable(fault) and getattr(fault, "__annotations__", {}).get("self") == "Misbehaving"
} | {f"cache {atol:g}": cache(atol) for atol in (1e-2, 1e-3, 1e-5)}


def engine(name: str) -> type[Misbehaving]:
    """The class of an engine with this fault."""
    return type("Faulty", (Misbehaving,), {"fault": staticmethod(FAULTS[name])})


def main(name: str) -> None:
    """Speak the worker protocol."""
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    description = decode(json.loads(source.readline())["description"])
    assert isinstance(description, DHTable)
    fk = engine(name)(description)
    hello = {"protocol": "fk-crosscheck", "version": 1, "joints": fk.joints, "frames": fk.frames}
    sink.write(json.dumps(hello).encode() + b"\n")
    sink.flush()
    while head := source.read(8):
        count = int(struct.unpack("<d", head)[0])
        q = np.frombuffer(source.read(8 * count * len(fk.joints)), "<f8").reshape(count, -1).copy()
        T = fk.placements(q, fk.frames)
        sink.write(struct.pack("<2d", count, 0.0) + np.ascontiguousarray(T).tobytes())
        sink.flush()


if __name__ == "__main__":
    main(sys.argv[1])
