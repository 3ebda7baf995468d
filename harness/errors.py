"""Everything the harness refuses, as one tree of exceptions.

Each error keeps its facts as fields and prints as one line: where, what was expected and what came, the way out.
`ExitCode` lists what the command can end with.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import IntEnum
from os import PathLike


class ExitCode(IntEnum):
    """What the command ends with. `harness.verdict.gate.combined` says which one counts if several apply."""

    AGREES = 0
    DISAGREES = 1
    WRONG_INPUT = 2
    NOT_VERIFIED = 3  # a required source is missing or failed
    INTERRUPTED = 130
    PIPE_CLOSED = 141


class CrosscheckError(Exception):
    """Base of all errors the harness raises on purpose."""

    exit_code = ExitCode.WRONG_INPUT


class InputError(CrosscheckError, ValueError):
    """The input is wrong: a model file, a URDF, a command-line value.

    Fields: `problem` (expected and found), `where` (file), `line` (1-based), `key` (dotted), `hint` (the way out).
    """

    def __init__(
        self,
        problem: str,
        *,
        where: str | PathLike[str] | None = None,
        line: int | None = None,
        key: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.problem = problem
        self.where = None if where is None else str(where)
        self.line = line
        self.key = key
        self.hint = hint
        place = self.where or ""
        if line is not None:
            place = f"{place}:{line}" if place else f"line {line}"
        if key is not None:
            place = f"{place}: {key}" if place else key
        problem = " ".join(problem.split("\n"))  # parsers report over several lines
        text = f"{place}: {problem}" if place else problem
        super().__init__(f"{text}; {hint}" if hint else text)


class ModelFileError(InputError):
    """A file of a robot model (dh.csv, model.toml, frames.toml, configurations.toml) is wrong."""


class UrdfError(InputError):
    """A URDF cannot be read, or is not one tree of supported joints."""


class MappingError(ModelFileError):
    """frames.toml names something that does not exist, maps it twice, or leaves a needed one out."""


class DescriptionUnavailable(CrosscheckError, RuntimeError):
    """The package that holds a model's URDF is not installed."""

    exit_code = ExitCode.NOT_VERIFIED


class EngineUnavailable(CrosscheckError, RuntimeError):
    """An engine cannot be used here. Fields: `source`, `reason`, `install` (a command, or None)."""

    exit_code = ExitCode.NOT_VERIFIED

    def __init__(self, source: str, reason: str, install: str | None = None) -> None:
        self.source = source
        self.reason = reason
        self.install = install
        super().__init__(f"{source}: {reason}" + (f"; {install}" if install else ""))


class EngineFailed(CrosscheckError, RuntimeError):
    """An engine ran and failed. Fields: `source`, `reason`."""

    exit_code = ExitCode.NOT_VERIFIED

    def __init__(self, source: str, reason: str) -> None:
        self.source = source
        self.reason = reason
        super().__init__(f"{source}: {reason}")


class EngineRefused(EngineFailed):
    """The library of an engine has read the description, and says why it does not take it."""


def nearest(name: str, known: Iterable[str]) -> str:
    """`did you mean 'tool0'?` for the known name spelt most like `name`, else the list of known names."""
    names = sorted(set(known))
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]!r}?"
    return f"known: {', '.join(names[:20])}{', ...' if len(names) > 20 else ''}" if names else "there are none"
