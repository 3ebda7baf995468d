"""Which Python runs an adapter: this one, one of the environments that `crosscheck engines install` has built, the system's.

The environments lie in the user's cache folder, or where FK_CROSSCHECK_CACHE says, with `environments.json` beside them.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import platformdirs
from pydantic import BaseModel, ValidationError

from harness.engines.base import Engine
from harness.engines.requirements import install_line, unmet
from harness.errors import EngineUnavailable

SYSTEM_PYTHON = "/usr/bin/python3"
# Variables that set to 1 keep numerical libraries to one thread: the cores are shared among processes, not fought over.
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Installed(BaseModel):
    """One engine's entry: where it is, what was asked for, what came; or why it could not be installed."""

    python: str = ""
    requirements: list[str] = []
    versions: dict[str, str] = {}
    problem: str = ""


class Manifest(BaseModel):
    """environments.json: engines by source name."""

    format: int = 1
    engines: dict[str, Installed] = {}


def cache_folder() -> Path:
    """Folder of the environments; one set for each version of Python."""
    root = os.environ.get("FK_CROSSCHECK_CACHE") or platformdirs.user_cache_dir("fk-crosscheck")
    return Path(root) / "engines" / f"python{sys.version_info.major}.{sys.version_info.minor}"


def read_manifest() -> Manifest:
    """The manifest; an empty one if there is none, or if it cannot be read: it can be built again."""
    try:
        manifest = Manifest.model_validate_json((cache_folder() / "environments.json").read_bytes())
    except (OSError, ValidationError):
        return Manifest()
    return manifest if manifest.format == Manifest().format else Manifest()


def write_manifest(manifest: Manifest) -> None:
    """Write it under a temporary name and rename it: a reader sees the old one or the new one."""
    path = cache_folder() / "environments.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(json.dumps(manifest.model_dump(), indent=2) + "\n")
    temporary.replace(path)


@dataclass(frozen=True)
class Interpreter:
    """Where an adapter runs: the interpreter, and the versions of its libraries there."""

    python: str
    versions: dict[str, str]


def where(adapter: type[Engine]) -> Interpreter:
    """Where this adapter can run. Raises EngineUnavailable with the install line.

    This environment if it meets the requirements, then the one built for the adapter; or the system's Python.
    """
    if adapter.debian:
        if problem := system_problem(adapter.imports):
            raise EngineUnavailable(adapter.source, problem, install_line(adapter))
        return Interpreter(SYSTEM_PYTHON, debian_versions(adapter.debian))
    versions = adapter.versions()
    why = unmet(adapter, versions)
    if not why:
        return Interpreter(sys.executable, versions)
    built = read_manifest().engines.get(adapter.source)
    if built is not None:
        if built.problem:
            why = f"could not be installed: {built.problem}"
        elif built.requirements != list(adapter.requirements):
            why = f"was installed for {', '.join(built.requirements)}, needs {', '.join(adapter.requirements)}"
        elif not Path(built.python).is_file():
            why = f"its environment is gone: no {built.python}"
        else:
            return Interpreter(built.python, built.versions)
    raise EngineUnavailable(adapter.source, why, install_line(adapter))


def debian_versions(packages: tuple[str, ...]) -> dict[str, str]:
    """Installed versions of Debian packages; those that are missing, or all on another system, are left out."""
    command = ["dpkg-query", "--show", "--showformat", "${Package} ${Version}\n", *packages]
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except OSError:
        return {}
    return dict(line.split(" ", 1) for line in result.stdout.splitlines() if line.count(" ") == 1 and line.split(" ")[1])


def own_environment(python: str) -> dict[str, str]:
    """Variables for another interpreter: none that would put this one's packages, or the user's, into its path."""
    if python == sys.executable:
        return dict(os.environ)
    foreign = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV")
    return {**{k: v for k, v in os.environ.items() if k not in foreign}, "PYTHONNOUSERSITE": "1"}


@lru_cache(maxsize=16)
def system_problem(imports: tuple[str, ...]) -> str:
    """Why the system's Python cannot import these modules; empty if it can."""
    command = [SYSTEM_PYTHON, "-c", f"import {', '.join(imports)}"]
    try:
        env = own_environment(SYSTEM_PYTHON)
        result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, env=env)
    except (OSError, subprocess.SubprocessError) as error:
        return f"the system's Python does not run: {error}"
    lines = result.stderr.strip().splitlines()
    return "" if result.returncode == 0 else f"the system's Python: {lines[-1] if lines else 'fails'}"
