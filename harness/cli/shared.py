"""What several commands use: options, completion of names, the folders of robots, the progress bar, options as one record."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import secrets
import sys
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from harness.cli.console import console
from harness.description.locate import default_models_dir, find_model, model_folders
from harness.description.values import parse_number, shown
from harness.engines.registry import registered
from harness.errors import command_line
from harness.report.text import plain
from harness.verdict.accepted import FOLDER

LONGEST_TIMEOUT = 1e9  # [s], 30 years
FRESH_SEEDS = 10**9  # short enough to be typed again

Command = Callable[..., int]


class Quantity(click.types.FloatParamType):
    """A number above 0 and within what a description can hold, for an option; its unit stands in the option's help."""

    def __init__(self, largest: float) -> None:
        self.largest = largest

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Raises click's BadParameter."""
        try:
            number = parse_number(value, self.largest)
        except ValueError as error:
            self.fail(str(error), param, ctx)
        if number <= 0.0:
            self.fail(f"expected a number above 0, got {shown(value)}", param, ctx)
        return number


seconds = Quantity(LONGEST_TIMEOUT)


class FreshSeed(click.types.IntParamType):
    """A seed, or the word `fresh`: a new one."""

    name = "seed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Raises click's BadParameter."""
        if value == "fresh":
            return secrets.randbelow(FRESH_SEEDS)
        try:
            return int(super().convert(value, param, ctx))
        except click.BadParameter:
            self.fail(f"expected a whole number or fresh, got {shown(value)}", param, ctx)


models_option = click.option(
    "--models",
    type=click.Path(path_type=Path),
    help="Folder of robot models.  [default: the models that come with the package]",
)

accepted_option = click.option(
    "--accepted",
    type=click.Path(path_type=Path),
    default=Path("reports") / FOLDER,
    show_default=True,
    help="Folder of the accepted numbers.",
)


def gathered(record: type[Any], parameter: str) -> Callable[[Command], Command]:
    """Decorator: a command gets several of its options as one record. It stands below the options, next to the function.

    record: a dataclass. Each field has the name of an option or argument, and takes its value.
    parameter: name of the function's parameter that the record is passed to.

    Options that are no field are passed on as they are.
    Raises TypeError when the command is called, if a field without a default has no option.
    """
    fields = [field.name for field in dataclasses.fields(record)]

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def with_record(*args: Any, **values: Any) -> int:
            taken = {name: values.pop(name) for name in fields if name in values}
            return command(*args, **values, **{parameter: record(**taken)})

        return with_record

    return decorate


def complete_robots(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of the robot models that begin like that.

    The shell puts them on the command line as they are. So a name that would mean something to it is not offered.
    """
    folders = model_folders(ctx.params.get("models") or default_models_dir())
    return [CompletionItem(name) for name in folders if name.startswith(incomplete) and _is_plain_word(name)]


def _is_plain_word(name: str) -> bool:
    return command_line([name]) == name and not name.startswith("-")


def complete_sources(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Names of the engines that begin like that."""
    return [CompletionItem(name) for name in registered() if name.startswith(incomplete)]


def folders_of(robots: tuple[str, ...], models: Path) -> list[Path]:
    """The folders of the robots asked for; all of `models`, if none."""
    if not robots:
        return list(model_folders(models).values())
    return list(dict.fromkeys(find_model(robot, models) for robot in robots))


def robot_words(folder: Path, models: Path | None) -> list[str]:
    """The words of a command line that name a robot model, whatever its folder is called.

    folder: its folder.
    models: the folder of robot models that was asked for; None: those that come with the package.
    """
    inside = folder.parent == (models or default_models_dir()) and not folder.name.startswith("-")
    if inside:
        return [folder.name, *(["--models", str(models)] if models is not None else [])]
    # With a slash it is a path and no name of a model that comes along, nor an option.
    return [str(folder) if folder.is_absolute() or folder.parts[:1] == ("..",) else os.path.join(".", folder)]


class Estimate:
    """How long a run still takes, at the speed that it has had on the whole.

    The speed counts from the first call of `update`: what was done before, in an interrupted run, took none of this run's time.
    Between two calls the estimate runs down with the clock.
    """

    def __init__(self) -> None:
        self._first: tuple[int, float] | None = None
        self._last: tuple[int, float] | None = None
        self._total = 0

    def update(self, done: int, total: int, now: float) -> None:
        """Take note of the configurations done. now: the time on any clock [s]."""
        self._first = self._first or (done, now)
        self._last, self._total = (done, now), total

    def remaining(self, now: float) -> float | None:
        """The time left [s]; None as long as there is no speed."""
        if self._first is None or self._last is None or self._last[0] <= self._first[0]:
            return None
        done, at = self._last
        speed = (done - self._first[0]) / max(at - self._first[1], 1e-9)
        return max(0.0, (self._total - done) / speed - (now - at))


class RemainingColumn(ProgressColumn):
    """The time left, of the task's field `estimate`."""

    def render(self, task: Task) -> Text:
        """`0:01:40`, or dashes as long as there is no estimate."""
        estimate: Estimate = task.fields["estimate"]
        seconds = estimate.remaining(time.monotonic())
        return Text("-:--:--" if seconds is None else str(timedelta(seconds=round(seconds))), style="progress.remaining")


@contextlib.contextmanager
def progress_bar(name: str, silent: bool) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr for one robot; none when piped, in CI or when silent."""
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        RemainingColumn(),
        console=console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty() or bool(os.environ.get("CI")) or silent,
    )
    estimate = Estimate()

    def advance(done: int, total: int) -> None:
        estimate.update(done, total, time.monotonic())
        bar.update(task, completed=done, total=total)

    with bar:
        task = bar.add_task(plain(name), total=None, estimate=estimate)
        yield advance
