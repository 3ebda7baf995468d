"""The commands are imported when they are called; what stands for them until then says the same."""

from __future__ import annotations

import os
import subprocess
import sys

import click
import pytest

from harness.cli.main import COMMANDS, cli

HEAVY = {"numpy", "pydantic", "plotly", "lxml", "torch", "pinocchio", "jinja2", "rich"}

START = """
import sys
from harness.__main__ import main
sys.argv = ["crosscheck", *sys.argv[1:]]
try:
    main()
finally:
    commands = {name for name in sys.modules if name.startswith("harness.cli.")}
    print("LOADED", *commands, *{name.split(".")[0] for name in sys.modules})
"""


def started(*args: str, **env: str) -> tuple[str, set[str]]:
    """What `crosscheck ARGS` prints, on stdout and stderr; and the packages and commands that it has imported."""
    done = subprocess.run(
        [sys.executable, "-c", START, *args], env={**os.environ, **env}, capture_output=True, text=True, timeout=60, check=False
    )
    printed, loaded = done.stdout.rsplit("LOADED", 1)
    return printed + done.stderr, set(loaded.split())


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (("--help",), "Cross-check robot models"),
        (("--version",), "crosscheck, version"),
        (("nonsense",), "No such command 'nonsense'"),
    ],
)
def test_the_start_loads_no_command_and_nothing_heavy(args: tuple[str, ...], text: str) -> None:
    printed, loaded = started(*args)
    assert text in printed
    assert {name for name in loaded if name.startswith("harness.cli.")} == {
        "harness.cli.main", "harness.cli.lazy", "harness.cli.error_line", "harness.cli.crash", "harness.cli.output"
    }  # fmt: skip
    assert not loaded & HEAVY


def test_a_command_name_is_completed_without_loading_it() -> None:
    printed, loaded = started(_CROSSCHECK_COMPLETE="bash_complete", COMP_WORDS="crosscheck r", COMP_CWORD="1")
    assert printed.split() == ["plain,render", "plain,run"]
    assert not loaded & HEAVY


def test_what_is_called_is_loaded() -> None:
    """The list that the tests above look at does show what is imported."""
    _, loaded = started("render", "--help")
    assert {"harness.cli.render", "pydantic", "rich"} <= loaded
    assert "harness.cli.run" not in loaded


@pytest.mark.parametrize("name", COMMANDS)
def test_the_short_help_is_the_docstrings(name: str) -> None:
    context = click.Context(cli)
    command = cli.get_command(context, name)
    assert command is not None
    assert command.name == name
    assert command.help is not None
    assert " ".join(command.help.split()).startswith(COMMANDS[name].short_help)
    for width in (20, 45, 64, 84, 200):
        assert cli.commands[name].get_short_help_str(width) == command.get_short_help_str(width)


def test_a_name_that_is_no_command() -> None:
    assert cli.get_command(click.Context(cli), "nonsense") is None
