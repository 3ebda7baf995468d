"""The worker that runs one adapter in a process of its own: `python worker.py MODULE:CLASS PACKAGE=FOLDER ...`.

Run as a script by whatever Python has the library. That environment need not have the harness: its packages are imported
from the folders given, and nothing else of the caller's environment is seen.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

if TYPE_CHECKING:
    from harness.engines.base import Engine


def main() -> int:
    """Serve one description after the other until stdin ends. Returns the exit code."""
    # Libraries print what they like: only the protocol may reach the pipe that was stdout.
    pipe = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.path.pop(0)  # the folder of this script, whose modules would hide others of the same name
    for package in sys.argv[2:]:
        _import_from(*package.split("=", 1))
    return _serve(sys.argv[1], sys.stdin.buffer, pipe)


def _import_from(name: str, location: str) -> None:
    """Make one package or module importable from where it lies, without its neighbours."""
    path = Path(location)
    if path.is_dir():
        spec = importlib.util.spec_from_file_location(name, path / "__init__.py", submodule_search_locations=[location])
    else:
        spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot import {name} from {location}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def _serve(adapter: str, source: BinaryIO, sink: BinaryIO) -> int:
    from harness.errors import EngineFailed, EngineUnavailable  # noqa: PLC0415
    from harness.workers import protocol  # noqa: PLC0415  (importable only now)

    def send(message: dict[str, Any]) -> None:
        sink.write(protocol.line(message))
        sink.flush()

    module, _, name = adapter.partition(":")
    while first := source.readline():
        greeting = json.loads(first)
        try:
            engine: Engine = getattr(importlib.import_module(module), name)(protocol.decode(greeting["description"]))
        except EngineUnavailable as error:
            send({"error": error.reason, "unavailable": True})
            return 1
        except Exception as error:  # whatever a library raises is the answer
            send({"error": error.reason if isinstance(error, EngineFailed) else f"{type(error).__name__}: {error}"})
            return 1
        frames = tuple(frame for frame in greeting["frames"] if frame in engine.frames)
        send(
            {
                "protocol": protocol.PROTOCOL,
                "version": protocol.VERSION,
                "name": engine.source,
                "joints": list(engine.joints),
                "frames": list(frames),
                "versions": engine.installed(),
                "again": True,
            }
        )
        _blocks(engine, frames, source, sink)
    return 0


def _blocks(engine: Engine, frames: tuple[str, ...], source: BinaryIO, sink: BinaryIO) -> None:
    """Answer blocks until stdin ends or another description is announced, by a block of 0."""
    import numpy as np  # noqa: PLC0415

    from harness.errors import EngineFailed  # noqa: PLC0415
    from harness.workers import protocol  # noqa: PLC0415

    width = len(engine.joints)
    while (head := source.read(8)) and (count := int(np.frombuffer(head, protocol.FLOAT)[0])):
        q = np.frombuffer(source.read(8 * count * width), protocol.FLOAT).reshape(count, width)
        start = time.perf_counter()
        try:
            T = engine.placements(q, frames)
        except Exception as error:  # as above
            reason = error.reason if isinstance(error, EngineFailed) else f"{type(error).__name__}: {error}"
            sink.write(np.array([protocol.FAILED], protocol.FLOAT).tobytes() + protocol.line({"error": reason}))
        else:
            sink.write(np.array([count, time.perf_counter() - start], protocol.FLOAT).tobytes())
            sink.write(np.ascontiguousarray(T, protocol.FLOAT).data)
        sink.flush()


if __name__ == "__main__":
    sys.exit(main())
