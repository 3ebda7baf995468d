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
from typing import BinaryIO, cast

import numpy as np

from harness.description.dh import DHTable
from harness.description.urdf import UrdfText
from harness.engines.dh_numpy import DHNumpy
from harness.engines.urdf_pinocchio import UrdfPinocchio
from harness.se3 import Array
from harness.workers.protocol import decode

FAULT = sys.argv[1] if len(sys.argv) > 1 else "none"
FRAMES = {
    "misspells a frame": ("base", "0", "1", "thre", "6"),
    "has the flange only": ("6",),
    "has a few links": ("base", "wrist_3_link", "tool0"),
}
BLOCKS_BEFORE = 2  # answered well before a fault in a block


def say(message: object) -> None:
    write(json.dumps(message).encode() + b"\n")


def write(data: bytes) -> None:
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def no_licence() -> None:
    print("no licence found", file=sys.stderr)
    sys.exit(7)


def broken_letters() -> None:
    sys.stderr.buffer.write("\uffff \x1b[31m broken".encode())
    sys.exit(5)


def leaves_a_daemon() -> None:
    subprocess.Popen(["sleep", "30"], start_new_session=True)
    os._exit(7)


def refuses() -> None:
    say({"error": "this controller is for another robot"})
    sys.exit(1)


AT_THE_START: dict[str, Callable[[], object]] = {
    "exits at once": no_licence,
    "sleeps at the start": lambda: time.sleep(1000),
    "sleeps at the start with a child": lambda: subprocess.run(
        [sys.executable, "-c", "import time; time.sleep(1000)"], check=False
    ),
    "prints rubbish": lambda: write(b"Loading controller firmware v3 ...\n"),
    "refuses": refuses,
    "another version": lambda: say({"protocol": "fk-crosscheck", "version": 2, "joints": ["a"], "frames": ["1"]}),
    "no end of line": lambda: write(b"x" * 20_000_000),
    "answers with a list": lambda: say([1]),
    "refuses without words": lambda: say({"error": None}),
    "refuses in unwritable letters": lambda: say({"error": "\ud800 \uffff \x1b[31m boom"}),
    "names half a letter": lambda: say({"protocol": "fk-crosscheck", "version": 1, "joints": ["\ud800"], "frames": ["1"]}),
    "writes unwritable letters to stderr": broken_letters,
    "leaves a daemon": leaves_a_daemon,
}


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


def killed_by_a_nameless_signal(count: int) -> None:
    os.kill(os.getpid(), 35)


IN_A_BLOCK: dict[str, Callable[[int], object]] = {
    "exits in a block": exits,
    "segfaults": segfaults,
    "killed by a nameless signal": killed_by_a_nameless_signal,
    "aborts": lambda count: os.abort(),
    "sleeps in a block": lambda count: time.sleep(1000),
    "prints in a block": lambda count: write(b"warning: singularity near\n"),
    "closes stdout": closes_stdout,
    "allocates without end": allocates,
    "allocates in a child": allocates_in_a_child,
    "floods stderr": floods_stderr,
    "reports a failure": reports_a_failure,
}


AT_THE_END: dict[str, Callable[[], object]] = {
    "talks at the end": lambda: floods_stderr(0),
    "does not end": lambda: time.sleep(1000),
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


def read_q(source: BinaryIO, count: int, width: int) -> Array:
    if FAULT == "answers before it has read":
        write(struct.pack("<d", count))
    q: Array = np.frombuffer(source.read(8 * count * width), "<f8").reshape(count, width)
    if FAULT == "dies beyond the limits" and np.abs(q).max() > 6.5:
        sys.exit(9)
    return np.clip(q, -3.0, 3.0) if FAULT == "clamps" else q


def write_answer(count: int, answer: Array) -> None:
    seconds = {"negative seconds": -5.0, "endless seconds": float("inf")}.get(FAULT, 0.0)
    if FAULT in ("big-endian", "float32"):
        kind = ">f8" if FAULT == "big-endian" else "<f4"
        write(np.array([count, 0.0, *answer.ravel()], kind).tobytes())
        return
    head = struct.pack("<2d", count, seconds)[8 * (FAULT == "answers before it has read") :]
    write(head + np.ascontiguousarray(answer).tobytes())


def main() -> None:
    source = sys.stdin.buffer
    greeting = json.loads(source.readline())
    AT_THE_START.get(FAULT, bool)()
    description = decode(greeting["description"])
    engine = DHNumpy(description) if isinstance(description, DHTable) else UrdfPinocchio(cast(UrdfText, description))
    frames = FRAMES.get(FAULT, engine.frames)
    say({"protocol": "fk-crosscheck", "version": 1, "joints": engine.joints, "frames": frames})
    previous, blocks = None, 0
    while head := source.read(8):
        count = int(struct.unpack("<d", head)[0])
        q = read_q(source, count, len(engine.joints))
        blocks += 1
        if blocks > BLOCKS_BEFORE:
            IN_A_BLOCK.get(FAULT, bool)(count)
            if FAULT == "reports a failure":
                continue
        T = engine.placements(q, ["6" if frame == "thre" else frame for frame in frames])
        write_answer(count, bent(T.copy(), previous) if blocks > BLOCKS_BEFORE else T)
        previous = T
    AT_THE_END.get(FAULT, bool)()


if __name__ == "__main__":
    main()
