"""Everything the harness refuses, as one tree of exceptions.

Each error keeps its facts as fields and prints as one line: where, what was expected and what came, the way out.
`ExitCode` lists what the command can end with.
"""

from __future__ import annotations

import difflib
import math
import re
import shlex
from bisect import bisect
from collections.abc import Iterable
from enum import IntEnum
from os import PathLike


class ExitCode(IntEnum):
    """What the command ends with. `harness.verdict.gate.combined` says which one counts if several apply."""

    AGREES = 0
    DISAGREES = 1
    WRONG_INPUT = 2
    NOT_VERIFIED = 3  # a required source is missing or failed
    INTERNAL = 70  # a fault of the harness: an exception that nobody foresaw
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
        place = " ".join((self.where or "").split("\n"))
        if line is not None:
            place = f"{place}:{line}" if place else f"line {line}"
        if key is not None:
            place = f"{place}: {_in_brief(key)}" if place else _in_brief(key)
        problem = _in_brief(" ".join(problem.split("\n")))  # parsers report over several lines
        text = f"{place}: {problem}" if place else problem
        super().__init__(f"{text}; {shortened(hint, 4000)}" if hint else text)


def _in_brief(text: str) -> str:
    """A sentence with its longest words cut: a file may hold a name of a million letters."""
    return shortened(re.sub(r"\S{401,}", lambda word: shortened(word[0]), text), 4000)


class ModelFileError(InputError):
    """A file of a robot model (dh.csv, model.toml, frames.toml, configurations.toml) is wrong."""


class UrdfError(InputError):
    """A URDF cannot be read, or is not one tree of supported joints."""


class MappingError(ModelFileError):
    """frames.toml names something that does not exist, maps it twice, or leaves a needed one out."""


class UntrustedError(InputError):
    """A model folder names a program that the user has not allowed to start. Fields also: `command`, the words as they run."""

    def __init__(self, problem: str, *, command: tuple[str, ...], where: str | PathLike[str], key: str, hint: str) -> None:
        self.command = command
        super().__init__(problem, where=where, key=key, hint=hint)


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


def command_line(words: Iterable[str]) -> str:
    """Words as one line that can be pasted into a shell: it takes the line apart into just these words, and runs nothing else.

    What cannot be seen (control characters, line breaks, marks that turn the direction of the text) is written as an escape
    in `$'...'`, as bash and zsh read it.
    """
    return " ".join(shlex.quote(word) if word.isprintable() else _escaped(word) for word in words)


def _escaped(word: str) -> str:
    def letter(c: str) -> str:
        if c == "\\":
            return "\\\\"
        if c == "'":  # not with a backslash: for a shell that does not know $'...', the word would end here
            return "\\x27"
        if c.isprintable():
            return c
        if 0xDC80 <= ord(c) <= 0xDCFF:  # a byte of a file name that is no UTF-8
            return f"\\x{ord(c) - 0xDC00:02x}"
        return f"\\x{ord(c):02x}" if ord(c) < 0x80 else f"\\u{ord(c):04x}" if ord(c) < 0x10000 else f"\\U{ord(c):08x}"

    return "$'" + "".join(letter(c) for c in word) + "'"


def nearest(name: str, known: Iterable[str]) -> str:
    """`did you mean 'tool0'?` for the known name spelt most like `name`, else the list of known names.

    What it costs is bounded, whatever a file holds: of names longer than COMPARED letters the rest is left out, of more than
    CANDIDATES names only those are compared that stand next to it in the alphabet, and SIMILARITIES bounds the work in all.
    """
    names = sorted(set(known))
    close = _closest(name[:COMPARED], names)
    if close is not None:
        return f"did you mean {shortened(close, 160)!r}?"
    listed = ", ".join(shortened(n) for n in names[:20])
    return f"known: {listed}{', ...' if len(names) > 20 else ''}" if names else "there are none"


COMPARED = 100  # letters
CANDIDATES = 200  # names
SIMILARITIES = 40_000  # pairs of letters
CLOSE = 0.6  # share of letters in common: what difflib's own search takes for alike


class Suggestions:
    """`nearest` for a file that may hold thousands of misspelt names: it suggests for the first MOST of them."""

    MOST = 20

    def __init__(self) -> None:
        self._count = 0

    def nearest(self, name: str, known: Iterable[str]) -> str:
        """As `nearest`; how many names there are, once MOST suggestions were made."""
        self._count += 1
        return nearest(name, known) if self._count <= self.MOST else f"{len(set(known))} names are known"


def _closest(name: str, names: list[str]) -> str | None:
    """The name that is most like `name`, among sorted names; None if none is. As difflib.get_close_matches, within bounds."""
    sizes = range(math.ceil(len(name) * CLOSE / (2.0 - CLOSE)), int(len(name) * (2.0 - CLOSE) / CLOSE) + 1)
    names = [n for n in names if len(n) in sizes or len(n) > COMPARED]
    middle = min(max(bisect(names, name), CANDIDATES // 2), max(CANDIDATES // 2, len(names) - CANDIDATES // 2))
    matcher = difflib.SequenceMatcher(b=name)
    ranked = []
    for candidate in names[middle - CANDIDATES // 2 : middle + CANDIDATES // 2]:
        matcher.set_seq1(candidate[:COMPARED])
        if (most := matcher.quick_ratio()) >= CLOSE:
            ranked.append((most, candidate))
    best, work = (CLOSE, ""), 0
    for most, candidate in sorted(ranked, reverse=True):
        work += len(name) * min(len(candidate), COMPARED)
        if most < best[0] or work > SIMILARITIES:
            break
        matcher.set_seq1(candidate[:COMPARED])
        best = max(best, (matcher.ratio(), candidate))
    return best[1] or None


def shortened(text: str, most: int = 80) -> str:
    """A text of at most so many letters: the rest is counted, not shown."""
    return text if len(text) <= most else f"{text[:most]}... ({len(text)} letters)"
