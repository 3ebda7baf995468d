"""What the numbers of a run depend on, as digests: two runs with the same give the same."""

from __future__ import annotations

import contextlib
import hashlib
import json
import platform
import shutil
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from harness.engines.registry import adapter_of
from harness.errors import CrosscheckError, InputError
from harness.reading import digest
from harness.run.outcome import Outcome, Run
from harness.se3 import Array
from harness.version import __version__

SOURCE = "source "  # how the words for a source begin
LARGEST_PROGRAM = 256_000_000  # bytes of a program's file that is looked into


def asked_of(run: Run) -> dict[str, str]:
    """What was asked, as far as the comparison depends on it."""
    options = run.options
    return {
        "number of samples": str(options.samples),
        "seed": str(options.seed),
        "reference": run.reference.name,
        "choice of sources": " ".join(o.name for o in run.outcomes),
        "in_process": str(options.in_process),
    }


def inputs_of(run: Run) -> dict[str, str]:
    """What it was asked of, by the words that a message has for it: files, engines that have started, the harness."""
    configurations = run.model.configurations
    inputs = {
        "the harness": f"{__version__} {_code()}",
        "Python or NumPy": f"{sys.version} {np.__version__} {platform.machine()}",
        **{f"the file {name}": sha for name, sha in run.model.hashes.items()},
        "the set of configurations": _digest(configurations.fixed_q, configurations.lower, configurations.upper),
    }
    return inputs | {f"{SOURCE}{o.name}": _source(o, run.model.folder) for o in run.outcomes if o.bound is not None}


def _source(outcome: Outcome, model: Path) -> str:
    """An engine with its versions, or a program with its files; which frames it has, and how they are read."""
    bound, planned = outcome.running(), outcome.planned
    view = bound.view
    facts = [sorted(bound.engine.installed().items()), bound.engine.joints, bound.frames, view.slots, view.base]
    code = _files(planned.command, planned.folder, model) if planned.command else _adapter_code(outcome.name)
    numbers = _digest(view.offsets, np.eye(4) if view.front is None else view.front)
    return hashlib.sha256(json.dumps([facts, code, numbers]).encode()).hexdigest()


def _digest(*arrays: Array) -> str:
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(str(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()


def _files(command: Sequence[str], folder: Path | None, model: Path) -> list[str]:
    """The words of a command, and a digest of each that is a file: a program that was built anew is another one."""
    digests = []
    for word in command:
        path = word.replace("{model}", str(model.resolve()))
        digests.append(_file((folder or Path()) / (shutil.which(path) or path)))
    return [*command, *digests]


@cache
def _adapter_code(source: str) -> str:
    """A digest of the adapter's module, which may come from another package."""
    with contextlib.suppress(CrosscheckError):
        return _file(Path(sys.modules[adapter_of(source).__module__].__file__ or ""))
    return ""


@cache
def _code() -> str:
    """A digest of the harness itself: who works on it has the same version all day."""
    sha = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        sha.update(_file(path).encode())
    return sha.hexdigest()


def _file(path: Path) -> str:
    """A digest of a regular file; empty if it is none, or too large."""
    with contextlib.suppress(InputError):
        return digest(path, LARGEST_PROGRAM)[1]
    return ""
