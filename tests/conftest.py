"""Fixtures: robot models in a folder of their own that a test may break, and the engines that must be there."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import settings

from harness.description.locate import default_models_dir
from harness.description.model import RobotModel, load_model
from tests.helpers import copied, shared_workers

# In CI the same examples every time: a rare one found there would fail a change that did not cause it.
settings.register_profile("default", deadline=None, max_examples=50, derandomize=bool(os.environ.get("CI")))
settings.load_profile("default")

# A process of pytest-xdist ignores Ctrl-C, and so would every program that a test starts and interrupts.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Engines a run of the tests does without, said aloud by whoever runs them (nox -s matrix); any other must be installed.
WITHOUT = set(filter(None, os.environ.get("CROSSCHECK_TESTS_WITHOUT", "").split(",")))


def engines(*sources: str) -> list[object]:
    """Parameters for a test over engines; those declared absent are shown as skipped."""
    absent = pytest.mark.skipif
    return [pytest.param(s, marks=absent(s in WITHOUT, reason="declared absent")) for s in sources]


@pytest.fixture
def copy_model(tmp_path: Path) -> Callable[..., Path]:
    """Copy one packaged model to a models/ folder, edited: (file, old text, new text) or (file, "", all of it)."""
    return partial(copied, tmp_path)


@pytest.fixture(scope="session", autouse=True)
def _end_shared_workers() -> Iterator[None]:
    with shared_workers():
        yield


@pytest.fixture(scope="session")
def models() -> dict[str, RobotModel]:
    """Every packaged robot model, by folder name."""
    return {path.parent.name: load_model(path.parent) for path in sorted(default_models_dir().glob("*/model.toml"))}


@pytest.fixture
def cli(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run `crosscheck ARGS` in a process of its own, in tmp_path, and return what it printed."""

    def run(*args: str, **env: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "harness", *args],
            cwd=tmp_path,
            env={**os.environ, **env},
            capture_output=True,
            text=True,
            timeout=180,
            check=False,
        )

    return run
