"""Builds environments for engines: as few as fit, each engine tried out in the one it gets.

An engine joins an environment only if pip can add what it needs without changing anything that is there, and if it then
answers a one-joint arm correctly. Otherwise the next one is tried, and last a new one.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypeAlias

import numpy as np
from packaging.requirements import Requirement

from harness.description.dh import DHRow, DHTable
from harness.description.packaged import Packaged
from harness.description.urdf import UrdfText
from harness.engines.base import Description, Engine
from harness.engines.requirements import unmet
from harness.errors import CrosscheckError, InputError
from harness.workers.environments import (
    SYSTEM_PYTHON,
    Installed,
    cache_folder,
    debian_versions,
    own_environment,
    read_manifest,
    system_problem,
    write_manifest,
)
from harness.workers.pool import Workers

Progress: TypeAlias = Callable[[str], None]  # takes one line of text

TIMEOUT = 1800.0  # seconds for one pip or apt-get

ONE_JOINT = UrdfText(
    "<robot name='one'><link name='base'/><link name='tip'/><joint name='j' type='revolute'><parent link='base'/>"
    "<child link='tip'/><origin xyz='0.5 0 0.25' rpy='0 0 0'/><axis xyz='0 0 1'/>"
    "<limit lower='-3' upper='3' effort='1' velocity='1'/></joint></robot>"
)
ONE_ROW = DHTable((DHRow(name="j", kind="revolute", a=0.5, alpha=0.0, d=0.25, theta=0.0),))


def install(adapters: Sequence[type[Engine]], constraints: Path | None, progress: Progress) -> dict[str, Installed]:
    """Make each engine available. Engines that this environment can run are left to it.

    Args:
        adapters: the engines.
        constraints: a constraints file for pip, or None.
        progress: is given a line for each step, and for each engine what became of it.

    Returns:
        What became of each engine, by source name.

    Raises:
        InputError: the cache folder cannot be written to.
    """
    done: dict[str, Installed] = {}
    with _locked():
        for adapter in adapters:
            entry = _system(adapter, progress) if adapter.debian else _here(adapter) or _isolated(adapter, constraints, progress)
            done[adapter.source] = entry
            if not adapter.debian and entry.python != sys.executable:
                manifest = read_manifest()
                manifest.engines[adapter.source] = entry
                write_manifest(manifest)
            versions = ", ".join(f"{k} {v}" for k, v in entry.versions.items()) or "built in"
            progress(f"{adapter.source}: {f'NOT INSTALLED: {entry.problem}' if entry.problem else versions}")
    return done


@contextmanager
def _locked() -> Iterator[None]:
    """One installation at a time: a second one waits. Raises InputError if the cache folder cannot be written to."""
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        lock = (cache_folder() / "lock").open("w")
    except OSError as error:
        hint = "set FK_CROSSCHECK_CACHE to a folder that can be"
        raise InputError(f"cannot be written to: {error.strerror}", where=cache_folder(), hint=hint) from None
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _here(adapter: type[Engine]) -> Installed | None:
    if unmet(adapter, adapter.versions()):
        return None
    return Installed(python=sys.executable, requirements=list(adapter.requirements), versions=adapter.versions())


def _system(adapter: type[Engine], progress: Progress) -> Installed:
    """Debian packages for the system's Python; only root can install them."""
    if problem := system_problem(adapter.imports):
        line = ["apt-get", "install", "--yes", *adapter.debian]
        if shutil.which("apt-get") is None or os.geteuid() != 0:
            return Installed(problem=f"{problem}; as root: {' '.join(line)}")
        progress(f"{adapter.source}: {' '.join(line)}")
        quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        # The first attempt may fail for want of package lists.
        if _run(line, quiet) and (failed := _run(["apt-get", "update"], quiet) or _run(line, quiet)):
            return Installed(problem=failed)
        system_problem.cache_clear()
        if problem := system_problem(adapter.imports):
            return Installed(problem=problem)
    return Installed(python=SYSTEM_PYTHON, versions=debian_versions(adapter.debian), problem=_try_out(adapter))


def _isolated(adapter: type[Engine], constraints: Path | None, progress: Progress) -> Installed:
    """The first environment that takes the engine, or a new one."""
    requirements = list(adapter.requirements)
    known = read_manifest().engines
    used = sorted({str(Path(e.python).parent.parent) for e in known.values() if e.python and not e.problem})
    for folder in (Path(name) for name in used if Path(name).parent == cache_folder()):
        progress(f"{adapter.source}: trying {folder.name}")
        entry = _add(adapter, folder, [*_constraint(constraints), *_freeze(folder)])
        if not entry.problem:
            return entry
    folder = next(f for f in (cache_folder() / f"env-{i}" for i in range(1, 1000)) if str(f) not in used)
    shutil.rmtree(folder, ignore_errors=True)  # left over from an attempt that failed
    progress(f"{adapter.source}: building {folder.name}")
    if problem := _run([sys.executable, "-m", "venv", str(folder)]):
        return Installed(requirements=requirements, problem=problem)
    return _add(adapter, folder, _constraint(constraints))


def _constraint(constraints: Path | None) -> list[str]:
    return [] if constraints is None else ["--constraint", str(constraints)]


def _freeze(folder: Path) -> list[str]:
    """Hold pip to what is installed in an environment."""
    python = str(folder / "bin" / "python")
    command = [python, "-m", "pip", "list", "--format", "freeze"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=own_environment(python))
    path = folder / "frozen.txt"
    path.write_text(result.stdout)
    return ["--constraint", str(path)]


def _add(adapter: type[Engine], folder: Path, constraints: list[str]) -> Installed:
    """Install an engine's requirements into an environment, and try it out there."""
    python = str(folder / "bin" / "python")
    pip = [python, "-m", "pip", "install", "--quiet", "--no-input", "--disable-pip-version-check", "--prefer-binary"]
    problem = _run([*pip, *constraints, "numpy>=1.24", *adapter.requirements])
    versions = {} if problem else _versions(python, adapter)
    problem = problem or _try_out(adapter, python)
    return Installed(python=python, requirements=list(adapter.requirements), versions=versions, problem=problem)


def _versions(python: str, adapter: type[Engine]) -> dict[str, str]:
    """What came of each requirement."""
    names = [Requirement(text).name for text in adapter.requirements]
    code = "import sys; from importlib.metadata import version; [print(n, version(n)) for n in sys.argv[1:]]"
    command = [python, "-c", code, *names]
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=own_environment(python))
    return dict(line.split(" ", 1) for line in result.stdout.splitlines())


def _try_out(adapter: type[Engine], python: str = SYSTEM_PYTHON) -> str:
    """Why the engine does not place a one-joint arm correctly there; empty if it does."""
    packaged = adapter.takes == "packaged"
    urdf = adapter.source.startswith("urdf:")
    description: Description = Packaged("UR5", tuple("123456")) if packaged else ONE_JOINT if urdf else ONE_ROW
    frames = ("base", "tip") if urdf else ("0", "1")
    try:
        with Workers() as workers:
            engine = workers.load(adapter, description, frames, python)
            T = engine.placements(np.full((1, len(engine.joints)), 0.5), engine.frames)[0]
    except CrosscheckError as error:
        return str(getattr(error, "reason", error))
    expected = 0.5 if urdf else 0.5 * np.cos(0.5)
    tip = (np.linalg.inv(T[0]) @ T[-1])[0, 3]
    return "" if packaged or abs(tip - expected) < 1e-6 else f"places a one-joint arm at {tip:g} m, expected {expected:g} m"


def _run(command: list[str], env: dict[str, str] | None = None) -> str:
    """Run a command quietly. Returns why it failed, empty if it did not."""
    env = env or own_environment(command[0])
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False, env=env)
    except (OSError, subprocess.SubprocessError) as error:
        return str(error)
    if result.returncode == 0:
        return ""
    lines = [line.strip() for line in result.stderr.splitlines() if line.strip()]
    errors = [line for line in lines if line.lower().startswith(("error", "e:"))]
    return " / ".join((errors or lines or [f"exit code {result.returncode}"])[:3])
