"""What the README says is run: its commands are those of CI, its example prints what it shows."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pydantic import BaseModel

from harness.cli.main import cli
from harness.description.configurations import ConfigurationsFile
from harness.description.frames_file import FramesFile
from harness.description.model_file import ModelFile
from harness.engines.registry import registered

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_ci_runs_the_two_commands() -> None:
    main, tests = (block.strip() for block in blocks("sh")[:2])
    assert main.endswith("nox -s crosscheck")
    assert tests.endswith("nox -s tests")
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert main in lines
    assert tests in lines


def test_the_example_prints_what_it_shows(tmp_path: Path) -> None:
    (block,) = blocks("console")
    shutil.copytree(ROOT / "models" / "ur3", tmp_path / "models" / "ur3")
    commands = [line[2:] for line in block.splitlines() if line.startswith("$ ")]
    shown = [line.rstrip() for line in block.splitlines() if not line.startswith("$ ")]
    assert len(shown) <= 12
    script = "\n".join(commands).replace("crosscheck run", f'"{sys.executable}" -m harness run')
    env = {k: v for k, v in os.environ.items() if k != "FORCE_COLOR"}
    result = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 1
    assert [line.rstrip() for line in result.stdout.splitlines()] == shown


@pytest.mark.parametrize(
    "command",
    [
        "run",
        "frames",
        "engines",
        "worker-check",
        "render",
        "completion",
        "derive-dh",
        "export-urdf",
        "diff",
        "identify",
        "mutate",
        "accept",
        "view",
    ],
)
def test_every_command_is_shown(command: str) -> None:
    assert command in cli.commands
    assert f"crosscheck {command}" in README
    assert len(cli.commands) == 13


def test_every_source_and_robot_is_listed() -> None:
    for source in registered():
        assert f"| `{source}` |" in README
    for folder in (ROOT / "models").iterdir():
        assert re.search(rf"\b{folder.name}\b", README)


def test_files_it_names_are_there() -> None:
    for name in (*re.findall(r"\]\(([^)]+)\)", README), "CONTRIBUTING.md", "CHANGELOG.md", "urdf/ur5e.urdf"):
        assert (ROOT / name.partition("#")[0]).exists(), name


@pytest.mark.parametrize("table", [ModelFile, FramesFile, ConfigurationsFile])
def test_every_key_of_a_model_file_is_described(table: type[BaseModel]) -> None:
    """The page goes stale the moment a key is added that it does not name."""
    text = (ROOT / "docs" / "model-files.md").read_text()
    for key in table.model_json_schema()["properties"]:
        assert f"`[{key}]`" in text or f"`[[{key}]]`" in text or f"`{key}`" in text or f"`[{key}." in text, key
    for name, part in table.model_json_schema().get("$defs", {}).items():
        for key in part.get("properties", {}):
            assert re.search(rf"`{key}\b|\b{key} =|\.{key}\]", text), f"{name}.{key}"
