"""A stranger's model folder starts no program before the user has said so: what is asked, and how a yes is remembered.

A yes is remembered by content. The hash is over the words of the command as model.toml writes them, and over the names and
contents of the files in the model's folder. Left out are the data of the model (dh.csv, model.toml, frames.toml,
configurations.toml, the URDF), unless the command names them, and folders of version control. A file beside a program may be
part of it, as the modules of a Python script are: so all are in. A file outside the folder is in if the command names it by a
relative path. The path of the folder is not: a copy elsewhere is the same program.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from harness.errors import InputError, UntrustedError, command_line
from harness.reading import digest
from harness.writing import replace_file

DATA = ("dh.csv", "model.toml", "frames.toml", "configurations.toml")
VERSION_CONTROL = (".git", ".hg", ".svn")
MOST_FILES, MOST_BYTES = 2000, 64 * 2**20  # of one folder; beyond, nothing is remembered


@dataclass(frozen=True, kw_only=True)
class Program:
    """A program that a model.toml names.

    source: name of the source.
    key: where model.toml names it.
    written: the words as they stand there.
    command: the words as they run.
    folder: the model's folder, absolute; it runs there.
    urdf: the URDF that the model reads; None without one.
    """

    source: str
    key: str
    written: tuple[str, ...]
    command: tuple[str, ...]
    folder: Path
    urdf: Path | None

    def refusal(self, way_out: str) -> UntrustedError:
        """The error that it may not start."""
        text = f"not started without your word, in {command_line([str(self.folder)])}: {command_line(self.command)}"
        return UntrustedError(text, command=self.command, where=self.folder / "model.toml", key=self.key, hint=way_out)


def filled_in(words: Sequence[str], folder: Path) -> tuple[str, ...]:
    """The words of a command with `{model}` replaced by the folder of the model."""
    return tuple(word.replace("{model}", str(folder.resolve())) for word in words)


def check_allowed(programs: Sequence[Program]) -> None:
    """Raise UntrustedError if there are any: nobody has allowed them."""
    for program in programs:
        raise program.refusal("read it, then allow it with Options(trust=True)")


class _TooMany(Exception):
    """More files than are looked at."""


def fingerprint(program: Program) -> str | None:
    """SHA-256 over the command and the files that belong to it. None if they are too many or too large, or cannot be read."""
    sha, left = hashlib.sha256(), MOST_BYTES
    sha.update(json.dumps(program.written).encode("utf-8", "surrogatepass"))
    try:
        for count, path in enumerate(_files(program)):
            if count == MOST_FILES:
                return None
            name = os.path.relpath(path, program.folder)
            target = os.readlink(path) if path.is_symlink() else ""
            size, content = _content(path, left)
            left -= size
            sha.update(json.dumps([name, target, content]).encode("utf-8", "surrogatepass"))
    except (OSError, InputError, _TooMany):
        return None
    return sha.hexdigest()


def _files(program: Program) -> Iterator[Path]:
    """The files that may be part of a program, in a fixed order."""
    named = set(_named(program))
    data = {program.folder / name for name in DATA} | ({program.urdf} if program.urdf else set())
    data = {path for path in data if not any(path.name in word for word in program.written)}
    count = 0
    for folder, inside, names in os.walk(program.folder):
        links = [name for name in inside if (Path(folder) / name).is_symlink()]
        inside[:] = sorted(set(inside) - set(VERSION_CONTROL) - set(links))
        for path in sorted(Path(folder) / name for name in (*names, *links)):
            if path.resolve() not in data and path not in data:
                named.discard(path)
                yield path
        if (count := count + 1) > MOST_FILES:
            raise _TooMany
    yield from sorted(named)


def _named(program: Program) -> Iterator[Path]:
    """Files that a word of the command names by a path relative to the model's folder, in it or not."""
    for word, as_run in zip(program.written, program.command, strict=True):
        if os.path.isabs(word) or len(as_run) > 4096 or "\0" in as_run:
            continue
        path = Path(os.path.normpath(program.folder / as_run))
        if path.is_file():
            yield path


def _content(path: Path, limit: int) -> tuple[int, str]:
    """Size and SHA-256 of a regular file; size 0 and its kind for anything else, which is not opened.

    Raises InputError beyond `limit` bytes or if it cannot be read, OSError if it cannot be asked for its kind.
    """
    try:
        kind = stat.S_IFMT(path.stat().st_mode)
    except FileNotFoundError:  # a link to nowhere
        return 0, "nothing"
    if kind != stat.S_IFREG:
        return 0, f"kind {kind}"
    return digest(path, limit)


def allowed_folder() -> Path:
    """Folder of what the user has allowed, one file each; to take everything back, remove it."""
    return Path(platformdirs.user_data_dir("fk-crosscheck")) / "allowed"


def is_remembered(mark: str) -> bool:
    """Whether the user has allowed what has this fingerprint."""
    try:
        status = os.lstat(allowed_folder() / mark)
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()


def remember(mark: str, program: Program) -> None:
    """Keep that the user has allowed it: a file of its own (0600), there in full or not at all. Raises OSError."""
    folder = allowed_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    text = json.dumps({"folder": str(program.folder), "command": program.written}) + "\n"
    replace_file(folder / mark, text, 0o600)
