"""Writes files whole or not at all, and several files together or not at all.

What holds, and against what:

- A file that `replace_file` writes is the old one or the new one, at every moment. A full disk, a kill and a second writer
  change nothing about that.
- The files that `replace_together` writes are all the old ones or all the new ones, for whoever opens them by their names, at
  every moment, likewise. One rename decides for all of them: while they are exchanged, their names are links into a hidden
  folder, through one link that is turned from the old ones to the new ones. Then each name is a plain file again.
- After a kill in between, the names are still links, to all the old ones or all the new ones. The next `clean` of the folder
  makes plain files of them, and removes the rest.
- Writers take turns by a lock on the folder, which ends with its holder.

What does not hold: a reader that opens one file before the exchange and another after it has one of each. Where a file system
has no links (FAT), the files are renamed one by one, and a kill in between leaves some of each. Where it has no locks, two
writers at once are not kept apart, and what killed ones have left is removed after AGE.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import secrets
import shutil
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

# What a robot may be called: its reports' files are named after it, in a folder that has files of its own.
ROBOT_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
LONGEST_ROBOT_NAME = 128
RESERVED = ("index", "report.schema")

PATIENCE = 60.0  # seconds to wait for another writer
AGE = 600.0  # seconds after which a hidden file is left over, where no lock can tell
OLD, NEW, NOW, NEXT = "old", "new", "now", "next"
_OURS = re.compile(r"\..+\.[0-9a-f]{16}\.crosscheck-(?P<kind>tmp|swap)")
_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[bool]:
    """Keep other writers out of a folder. Not to be entered twice: the second would wait for the first.

    Gives whether there is a lock: some file systems have none.
    Raises OSError if the folder is not there, or another program keeps it for longer than PATIENCE.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except PermissionError:  # one may write to it, but not list it
        yield False
        return
    try:
        yield _lock(descriptor)
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise OSError(errno.EBUSY, f"another program has kept the folder for {PATIENCE:g} s") from None
            time.sleep(0.02)
        except OSError:
            return False
        else:
            return True


def replace_file(path: Path, text: str, mode: int = 0o666) -> None:
    """Replace a file in one step, or put it there. mode: of the new file, less the umask. Raises OSError."""
    with locked(path.parent):
        put(path, text, mode)


def put(path: Path, text: str, mode: int = 0o666) -> None:
    """As `replace_file`, for a caller that has locked the folder."""
    temporary = path.with_name(_hidden(path.name, "tmp"))
    _write_new(temporary, text.encode(), mode)
    try:
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def replace_together(folder: Path, name: str, texts: Mapping[str, str]) -> None:
    """Replace several files of a folder, or put them there: all of them or none.

    folder: the folder, which is there.
    name: of the hidden folder in which they wait.
    texts: by file name.

    Raises OSError; then the old ones are as they were.
    """
    with locked(folder) as alone:
        _clean(folder, alone)
        exchange = _Exchange(folder, folder / _hidden(name, "swap"))
        try:
            if exchange.prepare(texts):
                exchange.link(texts)
                exchange.turn()
            else:
                exchange.rename_each(texts)
        except BaseException:  # Ctrl-C too
            with contextlib.suppress(OSError):
                exchange.settle()
            raise
        with contextlib.suppress(OSError):  # they are there, all of them; the next `clean` does the rest
            exchange.settle()


def clean(folder: Path) -> None:
    """End what writers that are gone have left in a folder: exchanges are settled, temporary files removed. Raises OSError."""
    with locked(folder) as alone:
        _clean(folder, alone)


def _clean(folder: Path, alone: bool) -> None:
    for name in os.listdir(folder):
        if not (ours := _OURS.fullmatch(name)):
            continue
        path = folder / name
        with contextlib.suppress(OSError):
            state = os.lstat(path)
            if state.st_uid != os.geteuid() or not (alone or time.time() - state.st_mtime > AGE):
                continue
            if ours["kind"] == "swap" and stat.S_ISDIR(state.st_mode):
                _Exchange(folder, path).settle()
            elif ours["kind"] == "tmp" and stat.S_ISREG(state.st_mode):
                os.unlink(path)


class _Exchange:
    """An exchange of several files of `folder`. What belongs to it is in the hidden folder `place`: the files as they were in
    `old`, as they will be in `new`, and the link `now` to one of both, by which all names go.
    """

    def __init__(self, folder: Path, place: Path) -> None:
        self.folder, self.place = folder, place

    def prepare(self, texts: Mapping[str, str]) -> bool:
        """Write the new files, and keep the old ones. Returns False if the file system has no links."""
        for folder in (self.place, self.place / OLD, self.place / NEW):
            folder.mkdir()
        for name, text in texts.items():
            _write_new(self.place / NEW / name, text.encode())
            _keep(self.folder / name, self.place / OLD / name)
        try:
            os.symlink(OLD, self.place / NOW)
        except OSError as error:
            if error.errno in _NO_LINKS:
                return False
            raise
        _sync(self.place / NEW, self.place / OLD, self.place)
        return True

    def link(self, names: Iterable[str]) -> None:
        """Make each name a link to the old file. Whoever opens it sees no change."""
        for name in names:
            os.symlink(self._target(name), self.place / NEXT)
            os.replace(self.place / NEXT, self.folder / name)
        _sync(self.folder)

    def turn(self) -> None:
        """The one step: all names show the new files."""
        os.symlink(NEW, self.place / NEXT)
        os.replace(self.place / NEXT, self.place / NOW)
        with contextlib.suppress(OSError):  # it is done
            _sync(self.place)

    def settle(self) -> None:
        """Make plain files of the names that are links, old or new, whichever they show; then remove the hidden folder."""
        try:
            side = os.readlink(self.place / NOW)
        except FileNotFoundError:  # ended before there was a link
            side = OLD
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self.place / NEXT)
        for name in os.listdir(self.folder):
            path, kept = self.folder / name, self.place / side / name
            if side not in (OLD, NEW) or not path.is_symlink() or os.readlink(path) != self._target(name):
                continue
            if not os.path.lexists(kept):
                os.unlink(path)
            elif kept.is_symlink():  # it was one before
                os.symlink(os.readlink(kept).removeprefix("../../"), self.place / NEXT)
                os.replace(self.place / NEXT, path)
            else:
                os.replace(kept, path)
        _sync(self.folder)
        if {*os.listdir(self.place)} <= {OLD, NEW, NOW, NEXT}:
            shutil.rmtree(self.place)

    def rename_each(self, names: Iterable[str]) -> None:
        """What is left to do without links: one file after the other, and back again if one fails."""
        renamed = []
        try:
            for name in names:
                os.replace(self.place / NEW / name, self.folder / name)
                renamed.append(name)
        except BaseException:
            for name in renamed:
                if os.path.lexists(self.place / OLD / name):
                    os.replace(self.place / OLD / name, self.folder / name)
                else:
                    os.unlink(self.folder / name)
            raise

    def _target(self, name: str) -> str:
        return f"{self.place.name}/{NOW}/{name}"


def _hidden(name: str, kind: str) -> str:
    """A name that nobody can foresee. It is short enough to be one, however long `name` is."""
    return f".{name[:40]}.{secrets.token_hex(8)}.crosscheck-{kind}"


def _write_new(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write a file that must not be there, not even as a link. It is on the disk afterwards, or not there at all."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    descriptor = os.open(path, flags, mode)
    try:
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(path)
        raise


def _keep(path: Path, copy: Path) -> None:
    """Keep a file, if it is there, under a second name two folders further down."""
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        return
    if stat.S_ISLNK(mode):
        os.symlink(os.path.join("..", "..", os.readlink(path)), copy)
    elif not stat.S_ISREG(mode):
        raise OSError(errno.EEXIST, f"{path.name} is there, and no file")
    else:
        try:
            os.link(path, copy)
        except OSError:  # a file system without hard links, or somebody else's file
            shutil.copy2(path, copy)


def _sync(*folders: Path) -> None:
    """Have renames in these folders on the disk before what follows."""
    for folder in folders:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        except OSError as error:
            if error.errno != errno.EINVAL:  # some file systems cannot
                raise
        finally:
            os.close(descriptor)
