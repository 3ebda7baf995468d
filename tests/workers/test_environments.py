"""Which Python runs an engine, and how environments for engines are built: pip and the engines are played by stand-ins here.

The real ones are installed and run by `nox -s engines`.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import pytest

from harness.engines.base import Engine
from harness.engines.dh_pinocchio import DHPinocchio
from harness.errors import EngineUnavailable, InputError
from harness.se3 import Array
from harness.workers import environments, install
from harness.workers.environments import Installed, Manifest, cache_folder, read_manifest, where, write_manifest


class Wants(Engine):
    """An adapter that wants distributions that are not installed."""

    source = "dh:wants"
    requirements: ClassVar[tuple[str, ...]] = ("acme-fk>=2",)

    def __init__(self, description: object) -> None:
        raise AssertionError("never built here")

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        raise AssertionError


class Rival(Wants):
    source = "dh:rival"
    requirements = ("acme-fk<2",)


class System(Wants):
    source = "dh:system"
    requirements = ()
    debian = ("python3-acme",)
    imports = ("no_such_module_of_the_system",)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FK_CROSSCHECK_CACHE", str(tmp_path / "cache"))
    return cache_folder()


def reason(adapter: type[Engine]) -> str:
    with pytest.raises(EngineUnavailable) as caught:
        where(adapter)
    assert caught.value.install == f"crosscheck engines install {adapter.source}"
    return caught.value.reason


def test_this_environment_comes_first() -> None:
    assert where(DHPinocchio).python == sys.executable
    assert "pin" in where(DHPinocchio).versions


def test_an_environment_that_was_built(cache: Path) -> None:
    built = Installed(python=sys.executable, requirements=["acme-fk>=2"], versions={"acme-fk": "2.1"})
    write_manifest(Manifest(engines={"dh:wants": built}))
    assert where(Wants).python == sys.executable
    assert where(Wants).versions == {"acme-fk": "2.1"}


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        (None, "acme-fk is not installed"),
        (Installed(requirements=["acme-fk>=2"], problem="no such package"), "could not be installed: no such package"),
        (Installed(python=sys.executable, requirements=["acme-fk>=1"]), "was installed for acme-fk>=1, needs acme-fk>=2"),
        (Installed(python="/nowhere/python", requirements=["acme-fk>=2"]), "its environment is gone: no /nowhere/python"),
    ],
)
def test_why_there_is_none(entry: Installed | None, expected: str) -> None:
    if entry:
        write_manifest(Manifest(engines={"dh:wants": entry}))
    assert reason(Wants) == expected


@pytest.mark.parametrize("text", ["", "{", '{"format": 99, "engines": {}}', '{"engines": 3}', "\xff"])
def test_a_damaged_manifest_counts_as_none(cache: Path, text: str) -> None:
    cache.mkdir(parents=True)
    (cache / "environments.json").write_bytes(text.encode("latin-1"))
    assert read_manifest() == Manifest()
    assert reason(Wants) == "acme-fk is not installed"


def test_another_python_sees_nothing_of_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sourced ROS workspace sets PYTHONPATH in every shell."""
    for name in ("PYTHONPATH", "PYTHONHOME"):
        monkeypatch.setenv(name, "/opt/ros")
    assert environments.own_environment(sys.executable)["PYTHONPATH"] == "/opt/ros"
    other = environments.own_environment("/elsewhere/python")
    assert not {"PYTHONPATH", "PYTHONHOME"} & set(other)
    assert other["PYTHONNOUSERSITE"] == "1"


def test_an_unusable_cache_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FK_CROSSCHECK_CACHE", "/dev/null/x")
    with pytest.raises(InputError, match=r"cannot be written to: .*; set FK_CROSSCHECK_CACHE to a folder that can be"):
        install.install([Wants], None, lambda text: None)


def test_packages_of_the_system() -> None:
    assert "No module named 'no_such_module_of_the_system'" in reason(System)


class Pip:
    """Plays pip: an environment takes what does not contradict what it has; `broken` sources fail when tried out."""

    def __init__(self) -> None:
        self.environments: dict[str, list[str]] = {}
        self.broken: set[tuple[str, str]] = set()

    def run(self, command: list[str], env: dict[str, str] | None = None) -> str:
        if command[1:3] == ["-m", "venv"]:
            (Path(command[3]) / "bin").mkdir(parents=True)
            (Path(command[3]) / "bin" / "python").touch()
            self.environments[Path(command[3]).name] = []
            return ""
        has = self.environments[Path(command[0]).parent.parent.name]
        wanted = [word for word in command if word.startswith("acme")]
        if any(old != new for old in has for new in wanted):
            return "ERROR: ResolutionImpossible"
        has += wanted
        return ""

    def try_out(self, adapter: type[Engine], python: str = "") -> str:
        return "dies" if (adapter.source, Path(python).parent.parent.name) in self.broken else ""


@pytest.fixture
def pip(monkeypatch: pytest.MonkeyPatch) -> Pip:
    played = Pip()
    monkeypatch.setattr(install, "_run", played.run)
    monkeypatch.setattr(install, "_try_out", played.try_out)
    monkeypatch.setattr(install, "_freeze", lambda folder: [])
    monkeypatch.setattr(install, "_versions", lambda python, adapter: {"acme-fk": "?"})
    return played


class Friend(Wants):
    source = "dh:friend"


def environment_of(entry: Installed) -> str:
    return Path(entry.python).parent.parent.name


def test_engines_share_an_environment_as_far_as_they_fit(pip: Pip) -> None:
    done = install.install([Wants, Rival, Friend, DHPinocchio], None, lambda text: None)
    assert [environment_of(done[s]) for s in ("dh:wants", "dh:rival", "dh:friend")] == ["env-1", "env-2", "env-1"]
    assert done["dh:pinocchio"].python == sys.executable
    assert not any(entry.problem for entry in done.values())
    assert set(read_manifest().engines) == {"dh:wants", "dh:rival", "dh:friend"}
    assert where(Rival).python == done["dh:rival"].python


def test_an_engine_that_does_not_work_beside_others_gets_its_own(pip: Pip) -> None:
    pip.broken = {("dh:friend", "env-1")}
    done = install.install([Wants, Friend], None, lambda text: None)
    assert [environment_of(entry) for entry in done.values()] == ["env-1", "env-2"]


def test_one_that_works_nowhere_is_said_and_kept_out(pip: Pip) -> None:
    pip.broken = {("dh:friend", "env-1"), ("dh:friend", "env-2")}
    said: list[str] = []
    done = install.install([Wants, Friend], None, said.append)
    assert done["dh:friend"].problem == "dies"
    assert "dh:friend: NOT INSTALLED: dies" in said
    assert reason(Friend) == "could not be installed: dies"
    pip.broken.clear()
    assert install.install([Friend], None, said.append)["dh:friend"].problem == ""


def test_package_lists_that_cannot_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a network apt-get fails twice: that is the engine's problem, told in one line."""
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(install, "_run", lambda command, env=None: f"E: {command[1]} failed")
    assert install.install([System], None, lambda text: None)["dh:system"].problem == "E: update failed"


def test_debian_packages_need_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    environments.system_problem.cache_clear()
    problem = install.install([System], None, lambda text: None)["dh:system"].problem
    assert problem.endswith("as root: apt-get install --yes python3-acme")
