"""The checkpoint of a long run: how far the comparison has come, in a hidden file that a run with the same inputs continues.

A checkpoint says what is believed without being looked at again. So it is signed with a key in the user's cache folder: a file
that came with a repository, or was cut off, is dropped. It fits if every input is the same: the files of the model, what was
asked, the engines' versions, the harness itself. Times are not carried over: those in a report are of its last part.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import os
import secrets
import stat
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import platformdirs
from pydantic import ValidationError

from harness.comparison.compare import Comparison
from harness.comparison.state import ComparisonState, Count, Part, state_of
from harness.run.inputs import SOURCE, asked_of, inputs_of
from harness.run.outcome import Outcome, Run, Status
from harness.se3 import Array
from harness.writing import replace_file

EVERY = 2.0  # seconds of a run between two checkpoints, and before the first
SHARE = 0.02  # of the time at most is spent on them
LARGEST = 64_000_000  # bytes of a file that is read
LOOKED_AT = 8  # one in so many answers goes into their digest


class Failure(Part):
    """Why a source was taken out on the way."""

    status: Status
    reason: str
    install: str


class State(Part):
    """The document. next: the configuration to go on with; answers: digests of the last block's, by source."""

    inputs: dict[str, str]
    asked: dict[str, str]
    next: Count
    answers: dict[str, str]
    failures: dict[str, Failure]
    comparison: ComparisonState


def digest_of(T: Array) -> str:
    """A digest of one in LOOKED_AT answers T (N, F, 4, 4) to a block."""
    return hashlib.sha256(T[::LOOKED_AT].tobytes()).hexdigest()


class _NoneHereError(Exception):
    """There is no checkpoint."""


class _MisfitError(Exception):
    """A checkpoint does not fit, and the text says why. is_stale: it never will again."""

    def __init__(self, why: str, *, is_stale: bool) -> None:
        super().__init__(why)
        self.is_stale = is_stale


class Checkpoints:
    """The checkpoints of a session, in one folder. They go when all its runs are done."""

    def __init__(self, folder: Path, tell: Callable[[str], None]) -> None:
        self._folder, self._tell = folder, tell
        self._used: set[Path] = set()

    def of(self, run: Run) -> Checkpoint:
        """The checkpoint of a run."""
        return Checkpoint(run, self._folder / f".{run.model.name}.checkpoint", self._used, self._tell)

    def remove(self) -> None:
        """Remove those that were written or continued."""
        for path in self._used:
            with contextlib.suppress(OSError):
                path.unlink()


class Checkpoint:
    """The checkpoint of one run: read at its beginning, written every few seconds."""

    def __init__(self, run: Run, path: Path, used: set[Path], tell: Callable[[str], None]) -> None:
        self._run, self._path, self._used, self._tell = run, path, used, tell
        self._due = time.monotonic() + EVERY
        self._off = False
        self._inputs = inputs_of(run)  # now: a source that fails later has no versions any more

    @property
    def exists(self) -> bool:
        """Whether this run has written or continued one."""
        return self._path in self._used

    @property
    def due(self) -> bool:
        """Whether it is time to write one."""
        return not self._off and time.monotonic() >= self._due

    def read(self) -> State | None:
        """What an interrupted run has left, if it fits this one. If not, one line says why.

        One that fits no more is removed. One that was made with other options stays: who has made it may want it.
        """
        try:
            state = self._fitting()
        except _NoneHereError:
            return None
        except _MisfitError as misfit:
            if misfit.is_stale:
                self.drop(str(misfit))
            else:
                self._ignored(str(misfit))
            return None
        self._used.add(self._path)
        return state

    def _fitting(self) -> State:
        """The document in the file. Raises _NoneHereError or _MisfitError."""
        try:
            data = _bounded(self._path)
        except FileNotFoundError:
            raise _NoneHereError from None
        except OSError as error:
            raise _MisfitError(f"cannot be read: {error.strerror}", is_stale=False) from None
        signature, _, text = data.partition(b"\n")
        key = _key(make=False)
        if key is None or not hmac.compare_digest(signature, _signature(key, text)):
            raise _MisfitError("it is damaged, or was not written here", is_stale=True)
        try:
            state = State.model_validate_json(text)
        except ValidationError:
            raise _MisfitError("it is none of this version", is_stale=True) from None
        changed = _differing(state.inputs, self._inputs)
        other = _differing(state.asked, asked_of(self._run))
        if other and (not changed or changed.startswith(SOURCE)):  # other sources may be what was asked
            raise _MisfitError(f"it was made with another {other}", is_stale=False)
        if changed:
            raise _MisfitError(f"{changed} is not what it was", is_stale=True)
        return state

    def drop(self, why: str) -> None:
        """Remove it, with one line."""
        with contextlib.suppress(OSError):
            self._path.unlink()
        self._ignored(why)

    def continued(self, done: int, total: int) -> None:
        """Say that the run goes on where another has ended."""
        self._tell(f"note: {self._run.model.name} continues an interrupted run, with {done} of {total} configurations done")

    def _ignored(self, why: str) -> None:
        self._tell(f"note: {self._run.model.name} begins from the start, {self._path} does not fit: {why}")

    def write(self, done: int, comparison: Comparison, answers: Mapping[str, Array]) -> None:
        """Write it.

        done: configurations compared.
        comparison: what they gave.
        answers: by source, the answers to the last block.

        A failure to write is told once, and no more are written: the run goes on.
        """
        start = time.monotonic()
        failed = [o for o in self._run.outcomes if o.bound is None and f"{SOURCE}{o.name}" in self._inputs]
        state = State(
            inputs=self._inputs,
            asked=asked_of(self._run),
            next=done,
            answers={name: digest_of(T) for name, T in answers.items()},
            failures={o.name: Failure(status=o.status, reason=o.reason, install=o.install) for o in failed},
            comparison=state_of(comparison),
        )
        text = state.model_dump_json()
        try:
            key = _key(make=True)
            if key is not None:
                replace_file(self._path, f"{_signature(key, text.encode()).decode()}\n{text}", 0o600)
                self._used.add(self._path)
        except OSError as error:
            self._tell(f"note: {self._run.model.name} could not be continued if interrupted: {self._path}: {error.strerror}")
            self._off = True
        took = time.monotonic() - start
        self._due = start + took + max(EVERY, took / SHARE)


def reinstate(outcome: Outcome, failure: Failure) -> None:
    """Take a source out again, as it was taken out in the interrupted run."""
    outcome.bound = None
    outcome.status, outcome.reason, outcome.install = failure.status, failure.reason, failure.install


def _differing(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """The first entry that is not the same in both; empty if there is none."""
    return next((name for name in {**before, **now} if before.get(name) != now.get(name)), "")


def _bounded(path: Path) -> bytes:
    """What a regular file holds, up to LARGEST bytes. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as file:
        return file.read(LARGEST) if stat.S_ISREG(os.fstat(descriptor).st_mode) else b""


def _signature(key: bytes, text: bytes) -> bytes:
    return hmac.new(key, text, "sha256").hexdigest().encode()


def _key(make: bool) -> bytes | None:
    """The user's own key; None if there is none. make: make one. Raises OSError if it cannot be made."""
    root = Path(os.environ.get("FK_CROSSCHECK_CACHE") or platformdirs.user_cache_dir("fk-crosscheck"))
    path = root / "checkpoint.key"
    with contextlib.suppress(OSError):
        if len(key := _bounded(path).strip()) == 64:
            return key
    if not make:
        return None
    root.mkdir(parents=True, exist_ok=True)
    replace_file(path, secrets.token_hex(32), 0o600)
    return _bounded(path)
