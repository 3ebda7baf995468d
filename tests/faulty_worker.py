"""A worker with one fault, named by its argument; without one it is the in-house FK. Run by tests/test_workers.py."""

from __future__ import annotations

import ctypes
import json
import os
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from typing import cast

import numpy as np

from harness.description.dh import DHTable
from harness.engines.dh_numpy import DHNumpy
from harness.engines.protocol import decode
from harness.se3 import Array

FAULT = sys.argv[1] if len(sys.argv) > 1 else "none"
BLOCKS_BEFORE = 2  # answered well before a fault in a block


def say(message: dict[str, object]) -> None:
    write(json.dumps(message).encode() + b"\n")


def write(data: bytes) -> None:
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def at_the_start() -> None:
    if FAULT == "exits at once":
        print("no licence found", file=sys.stderr)
        sys.exit(7)
    if FAULT == "sleeps at the start":
        time.sleep(1000)
    if FAULT == "sleeps at the start with a child":
        subprocess.run([sys.executable, "-c", "import time; time.sleep(1000)"], check=False)
    if FAULT == "prints rubbish":
        write(b"Loading controller firmware v3 ...\n")
    if FAULT == "refuses":
        say({"error": "this controller is for another robot"})
        sys.exit(1)
    if FAULT == "another version":
        say({"protocol": "fk-crosscheck", "version": 2, "joints": ["a"], "frames": ["1"]})
    if FAULT == "no end of line":
        write(b"x" * 20_000_000)


def exits(count: int) -> None:
    write(struct.pack("<2d", count, 0.0) + b"\0" * 100)
    print("emergency stop", file=sys.stderr)
    sys.stderr.flush()
    os._exit(3)


def segfaults(count: int) -> None:
    sys.stderr.write("about to read address 0\n")
    sys.stderr.flush()
    ctypes.string_at(0)


def closes_stdout(count: int) -> None:
    os.close(1)
    time.sleep(1000)


def allocates(count: int) -> None:
    kept = []
    while True:
        kept.append(np.ones(4_000_000))


def allocates_in_a_child(count: int) -> None:
    code = "k = []\nwhile True: k.append(bytearray(b'x' * 30_000_000))"
    subprocess.run([sys.executable, "-c", code], check=False)
    time.sleep(1000)


def floods_stderr(count: int) -> None:
    for _ in range(100):
        sys.stderr.write("x" * 999_999 + "\n")


def reports_a_failure(count: int) -> None:
    write(struct.pack("<d", -1.0))
    say({"error": "joint 3 outside its limits"})


IN_A_BLOCK: dict[str, Callable[[int], None]] = {
    "exits in a block": exits,
    "segfaults": segfaults,
    "aborts": lambda count: os.abort(),
    "sleeps in a block": lambda count: time.sleep(1000),
    "prints in a block": lambda count: write(b"warning: singularity near\n"),
    "closes stdout": closes_stdout,
    "allocates without end": allocates,
    "allocates in a child": allocates_in_a_child,
    "floods stderr": floods_stderr,
    "reports a failure": reports_a_failure,
}


def bent(T: Array, previous: Array | None) -> Array:
    if FAULT == "too few frames":
        return T[:, :-1]
    if FAULT == "too many frames":
        return np.concatenate([T, T[:, -1:]], axis=1)
    if FAULT == "nan":
        T[0, :, 0, 3] = np.nan
    if FAULT == "not a rotation":
        T[:, 1:, :3, :3] *= 1.01
    if FAULT == "column-major":
        return np.swapaxes(T, -1, -2)
    if FAULT == "the previous block" and previous is not None:
        return np.resize(previous, T.shape)
    return T


def main() -> None:
    source = sys.stdin.buffer
    greeting = json.loads(source.readline())
    at_the_start()
    engine = DHNumpy(cast(DHTable, decode(greeting["description"])))
    say({"protocol": "fk-crosscheck", "version": 1, "joints": engine.joints, "frames": engine.frames})
    previous, blocks = None, 0
    while head := source.read(8):
        count = int(struct.unpack("<d", head)[0])
        q = np.frombuffer(source.read(8 * count * len(engine.joints)), "<f8").reshape(count, -1)
        blocks += 1
        if blocks > BLOCKS_BEFORE:
            if FAULT in IN_A_BLOCK:
                IN_A_BLOCK[FAULT](count)
            if FAULT == "reports a failure":
                continue
        T = engine.placements(q, engine.frames)
        answer = bent(T.copy(), previous) if blocks > BLOCKS_BEFORE else T
        previous = T
        if FAULT == "big-endian":
            write(np.array([count, 0.0, *answer.ravel()], ">f8").tobytes())
        elif FAULT == "float32":
            write(np.array([count, 0.0, *answer.ravel()], "<f4").tobytes())
        else:
            write(struct.pack("<2d", count, 0.0) + np.ascontiguousarray(answer).tobytes())
    if FAULT == "does not end":
        time.sleep(1000)


if __name__ == "__main__":
    main()
