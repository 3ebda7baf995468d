"""What nobody foresaw: one line on stderr, the traceback in a file, exit code 70. Never 1, which is a disagreement."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Callable

import click

from harness.cli.error_line import complain
from harness.errors import CrosscheckError, ExitCode, InputError
from harness.report.text import plain

LONGEST = 300  # characters of an exception's text in the line

# What the system refuses because of a path or a disk of the user's.
_REFUSALS = {
    errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO,
}  # fmt: skip


def attempt(work: Callable[[], object], whose: str = "") -> int:
    """Do a piece of work, and say in one line on stderr what ended it.

    Args:
        work: what is done. Its exit code, if it returns one, is handed on as it is.
        whose: the robot it is about, for the line; empty if it is about none.

    Returns:
        The exit code: 0, that of an error the harness raises on purpose, or 70.

    Raises:
        KeyboardInterrupt: and click's own exceptions, for whoever called the command.
    """
    try:
        code = work()
    except CrosscheckError as error:
        complain(error)
        return error.exit_code
    except (KeyboardInterrupt, click.ClickException, click.Abort, click.exceptions.Exit):
        raise
    except BaseException as error:  # a library's SystemExit too: its code would be taken for a verdict
        if isinstance(error, OSError) and error.errno in _REFUSALS:
            complain(InputError(error.strerror or str(error), where=_path_of(error)))
            return ExitCode.WRONG_INPUT
        return tell_fault(error, whose)
    return code if isinstance(code, int) else ExitCode.AGREES


def _path_of(error: OSError) -> str | None:
    """The file that an error of the system is about, if it says so."""
    return os.fsdecode(error.filename) if isinstance(error.filename, str | bytes | os.PathLike) else None


def tell_fault(error: BaseException, whose: str = "") -> ExitCode:
    """One line on stderr about an exception that nobody foresaw, and its traceback in a file. Returns the exit code, 70."""
    try:
        from harness.cli.fault_file import save_traceback  # noqa: PLC0415  (the start of the command does without)

        file = f"with {save_traceback(error)}"
    except Exception as problem:  # whatever it is, the line must still come
        file = f"the traceback could not be written ({_in_words(problem)})"
    about = f"{whose}: " if whose else ""
    text = f"error: {about}a fault of the harness, not of the input: {_in_words(error)}; please report it, {file}"
    click.echo(plain(f"{text}, to the issue tracker of the project"), err=True)
    return ExitCode.INTERNAL


def _in_words(error: BaseException) -> str:
    """Type and text of an exception, on one line and not too long."""
    try:
        text = " ".join(str(error).split())
    except Exception:  # one that cannot say what it is
        text = ""
    text = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


class ThreadFaults:
    """Exceptions that ended a thread of the harness: each is told as a fault. They change the exit code, too."""

    def __init__(self) -> None:
        """Be told of them from now on."""
        self.code: int = ExitCode.AGREES
        threading.excepthook = self._tell

    def _tell(self, fault: threading.ExceptHookArgs) -> None:
        if fault.exc_value is not None and not isinstance(fault.exc_value, SystemExit):
            self.code = tell_fault(fault.exc_value)
