"""The lock files: everything pinned, everything hashed, and in step with constraints.txt and pyproject.toml."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
LOCKS = sorted((ROOT / "locks").glob("*.txt"))
ENTRY = re.compile(r"^([A-Za-z0-9._-]+)==([^\s\\;]+)[^\n]*\\\n((?: {4}--hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)", re.MULTILINE)


def pinned(path: Path) -> dict[str, str]:
    """Version of each package that a lock file names, those without a hash included."""
    text = path.read_text()
    exempt = re.findall(r"^# without a hash: ([^=\s]+)==(\S+)$", text, re.MULTILINE)
    return {str(canonicalize_name(name)): version for name, version in [*exempt, *((m[1], m[2]) for m in ENTRY.finditer(text))]}


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_every_line_is_pinned_and_hashed(path: Path) -> None:
    rest = ENTRY.sub("", path.read_text())
    lines = [line for line in rest.splitlines() if line and not line.startswith("#")]
    assert lines == []
    assert re.findall(r"^# without a hash: (\S+)==", path.read_text(), re.MULTILINE) in ([], ["torch"])


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_versions_are_those_of_the_constraints(path: Path) -> None:
    constraints = [Requirement(line) for line in (ROOT / "constraints.txt").read_text().splitlines() if line and line[0] != "#"]
    found = pinned(path)
    for need in constraints:
        if (version := found.get(str(canonicalize_name(need.name)))) is not None:
            assert need.specifier.contains(version), f"{need} against {version}: nox -s lock"


@pytest.mark.parametrize(
    ("lock", "extras"),
    [
        ("crosscheck", ("pinocchio", "pytorch-kinematics", "yourdfpy", "robots")),
        ("tests", ("pinocchio", "pytorch-kinematics", "yourdfpy", "robots", "test")),
        ("browser", ("pinocchio", "yourdfpy", "robots", "view", "browser", "test")),
        ("cpp", ("pinocchio", "robots", "test")),
        ("types", ("test",)),
    ],
)
def test_what_the_project_needs_is_locked(lock: str, extras: tuple[str, ...]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needs = [*project["dependencies"], *(n for extra in extras for n in project["optional-dependencies"][extra])]
    found = pinned(ROOT / "locks" / f"{lock}.txt")
    for need in map(Requirement, needs):
        if need.name == "fk-crosscheck" or (need.marker and not need.marker.evaluate({"python_version": "3.11"})):
            continue
        version = found.get(str(canonicalize_name(need.name)))
        assert version is not None, f"{need.name} is not in locks/{lock}.txt: nox -s lock"
        assert need.specifier.contains(version.partition("+")[0]), f"{need} against {version}: nox -s lock"


def test_ci_installs_by_lock_files() -> None:
    """Every installation of CI is by hashes, but for the README's own command, which then finds nox installed."""
    lines = [line for line in (ROOT / ".ci" / "run").read_text().splitlines() if "pip install" in line]
    assert "--require-hashes" in lines[0]
    assert all("--require-hashes" in line or line.startswith("python -m pip install --quiet nox && ") for line in lines)
