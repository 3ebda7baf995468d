"""Options as one record, and what commands share."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from dataclasses import dataclass

import click
import pytest
from click.testing import CliRunner

from harness.cli.main import COMMANDS, cli
from harness.cli.shared import Estimate, gathered


@dataclass(frozen=True, kw_only=True)
class Size:
    """A record of two options."""

    width: int
    height: int


@click.command()
@click.argument("name")
@click.option("--width", type=int, default=3)
@click.option("--height", type=int, default=4)
@click.pass_context
@gathered(Size, "size")
def box(ctx: click.Context, name: str, size: Size) -> int:
    """Tell a size."""
    click.echo(f"{ctx.info_name} {name} {size.width} {size.height}")
    return 0


def test_options_come_as_one_record() -> None:
    result = CliRunner().invoke(box, ["crate", "--height", "7"])
    assert (result.exit_code, result.output) == (0, "box crate 3 7\n")
    assert "Tell a size." in CliRunner().invoke(box, ["--help"]).output


def test_a_field_without_an_option_is_an_error() -> None:
    @click.command()
    @click.option("--width", type=int, default=3)
    @gathered(Size, "size")
    def flat(size: Size) -> int:
        return size.width

    result = CliRunner().invoke(flat)
    assert isinstance(result.exception, TypeError)
    assert "height" in str(result.exception)


def every_command() -> list[click.Command]:
    """All commands and their subcommands."""
    commands = [command for name in COMMANDS if (command := cli.get_command(click.Context(cli), name)) is not None]
    return commands + [sub for group in commands if isinstance(group, click.Group) for sub in group.commands.values()]


@pytest.mark.parametrize("command", every_command(), ids=lambda command: str(command.name))
def test_every_option_has_its_parameter_or_field(command: click.Command) -> None:
    assert command.callback is not None
    function = inspect.unwrap(command.callback)
    hints = typing.get_type_hints(function)
    names: list[str] = []
    for name in inspect.signature(function).parameters:
        fields = dataclasses.fields(hints[name]) if dataclasses.is_dataclass(hints[name]) else ()
        names += [] if hints[name] is click.Context else [field.name for field in fields] or [name]
    assert sorted(names) == sorted(str(parameter.name) for parameter in command.params)


def test_the_estimate_is_steady() -> None:
    """Blocks that take 1 s and 3 s in turn: an estimate from the last few would jump by a factor of three."""
    estimate, now, shown = Estimate(), 100.0, []
    estimate.update(0, 400, now)
    assert estimate.remaining(now) is None
    for block in range(1, 41):
        now += 1.0 if block % 2 else 3.0
        estimate.update(10 * block, 400, now)
        shown.append((now - 100.0) + (estimate.remaining(now) or 0.0))  # when it says the end will be
    assert shown[-1] == pytest.approx(80.0)
    assert all(abs(end - 80.0) < 8.0 for end in shown[9:])
    assert estimate.remaining(now) == 0.0


def test_the_estimate_runs_down_with_the_clock_and_never_below_zero() -> None:
    estimate = Estimate()
    estimate.update(0, 100, 0.0)
    estimate.update(50, 100, 10.0)
    assert [estimate.remaining(t) for t in (10.0, 14.0, 60.0)] == [10.0, 6.0, 0.0]


def test_what_an_interrupted_run_has_done_is_not_counted_as_speed() -> None:
    estimate = Estimate()
    estimate.update(900, 1000, 50.0)
    assert estimate.remaining(50.0) is None
    estimate.update(910, 1000, 51.0)
    assert estimate.remaining(51.0) == pytest.approx(9.0)
