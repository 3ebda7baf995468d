"""All workers of a run: starts them, shares the cores among them, watches their memory, ends them."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from harness.engines import requirements
from harness.engines.base import Description, Engine
from harness.errors import EngineFailed
from harness.kernels import kernels
from harness.workers import protocol
from harness.workers.child import Child, ChildError
from harness.workers.environments import THREAD_VARIABLES, own_environment, where
from harness.workers.memory import MemoryWatch
from harness.workers.process import Limits, ProcessEngine

Result = TypeVar("Result")

WATCH = 0.1  # seconds between two looks at a worker's memory


class Workers:
    """All workers of a run; a context manager that ends them.

    When the harness ends, in whatever way, the workers end with it: they are in the process group of a warden that kills
    the group as soon as the pipe to the harness closes.
    """

    def __init__(self, limits: Limits | None = None, jobs: int = 0, in_process: bool = False) -> None:
        """Start nothing yet.

        Args:
            limits: what a worker may take; None for the usual limits.
            jobs: how many workers compute at a time; 0 for one a core.
            in_process: run adapters in this process instead.
        """
        self.limits, self.in_process = limits or Limits(), in_process
        self.jobs = 1 if in_process else jobs or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self.jobs)
        self._children: list[Child] = []
        self._idle: dict[tuple[str, ...], list[Child]] = {}
        self._lock = threading.Lock()
        self._warden: subprocess.Popen[bytes] | None = None
        self._closing = threading.Event()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        """End every worker. Tasks still running see theirs end, and fail."""
        self._closing.set()
        try:
            # The warden kills the whole group: nothing that comes between, a second Ctrl-C say, can leave a worker behind.
            if self._warden is not None and self._warden.stdin is not None:
                self._warden.stdin.close()
        finally:
            self._pool.shutdown(wait=False, cancel_futures=True)
            with self._lock:
                for child in self._children:
                    child.kill()
            self._pool.shutdown(wait=True)
            for child in self._children:
                child.close()
            if self._warden is not None:
                self._warden.wait()

    def submit(self, work: Callable[[], Result]) -> Future[Result]:
        """Run `work` when a core is free. Its result, or what it raises, is in the future."""
        return self._pool.submit(work)

    def load(self, adapter: type[Engine], description: Description, frames: Sequence[str], python: str = "") -> Engine:
        """Start an engine on a description.

        Args:
            adapter: the engine's adapter.
            description: the description it is to place.
            frames: the frames that are wanted; the engine answers at those it has.
            python: the interpreter that runs it; by default the one that has its library.

        Raises:
            EngineUnavailable: the engine is not installed.
            EngineFailed: it refuses the description, or its environment no longer has what it needs.
        """
        if self.in_process or not adapter.isolated:
            return requirements.build(adapter, description)
        python = python or where(adapter).python
        packages = [f"{name}={_location(name)}" for name in dict.fromkeys(["harness", adapter.__module__.split(".")[0]])]
        script = str(Path(__file__).with_name("worker.py"))
        command = [python, script, f"{adapter.__module__}:{adapter.__qualname__}", *packages]
        engine = self.start(adapter.source, command, protocol.greeting(description, tuple(frames)), None, adapter)
        if why := requirements.unmet(adapter, engine.installed()):
            raise EngineFailed(adapter.source, f"{why}: its environment has changed; {requirements.install_line(adapter)}")
        return engine

    def settle(self, engines: Iterable[Engine]) -> None:
        """End the work on one robot: keep the workers of these engines for the next one, and end all others.

        Args:
            engines: engines that have worked without fault and are needed no more.
        """
        with self._lock:
            for engine in engines:
                if isinstance(engine, ProcessEngine) and engine.idle:
                    self._idle.setdefault(_key(engine.child.command, engine.child.cwd), []).append(engine.child)
            kept = [child for idle in self._idle.values() for child in idle]
            for child in self._children:
                if child not in kept:
                    child.close()
            self._children = kept

    def start(
        self, source: str, command: Sequence[str], greeting: bytes, cwd: Path | None = None, adapter: type[Engine] | None = None
    ) -> ProcessEngine:
        """Greet a worker that runs this command: one that has served before, or a new one.

        Args:
            source: source name.
            command: program and arguments.
            greeting: the first line it is sent, see `protocol.greeting`.
            cwd: the folder it runs in; None for this process's own.
            adapter: the adapter that it runs; None if it is a program of the user's.

        Raises:
            EngineUnavailable: its library is not installed.
            EngineFailed: it cannot be started, or its answer is wrong.
        """
        with self._lock:
            idle = self._idle.get(_key(command, cwd), [])
            served = idle.pop() if idle else None
        if served is not None:
            with contextlib.suppress(EngineFailed):  # what it served before may have spoilt it: a new one then
                return ProcessEngine(source, served, protocol.AGAIN + greeting, self.limits, adapter)
        # A program of the user's must not change its own folder: what is remembered of it is a hash over the files there.
        own = own_environment(command[0]) if adapter else {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        env = {**dict.fromkeys(THREAD_VARIABLES, "1"), **own, **kernels()}
        try:
            with self._lock:
                if self._closing.is_set():
                    raise ChildError("the run is over")
                child = Child(command, self._group(), cwd, env)
                self._children.append(child)
        except ChildError as error:
            raise EngineFailed(source, str(error)) from error
        return ProcessEngine(source, child, greeting, self.limits, adapter)

    def _group(self) -> int:
        """Process group of the workers: that of the warden, which is started with the first of them."""
        if self._warden is None:
            own_group: dict[str, Any] = {"process_group": 0} if sys.version_info >= (3, 11) else {"preexec_fn": os.setpgrp}
            script = str(Path(__file__).with_name("warden.py"))
            self._warden = subprocess.Popen([sys.executable, "-I", "-S", script], stdin=subprocess.PIPE, **own_group)
            threading.Thread(target=self._watch, daemon=True).start()
        return self._warden.pid

    def _watch(self) -> None:
        """Kill a worker, and what it has started, when together they use more memory than allowed."""
        watch = MemoryWatch()
        while not self._closing.wait(WATCH):
            for child in list(self._children):
                if child.process.poll() is None and (used := watch.used(child.process.pid)) > self.limits.memory:
                    child.kill_reason = f"used {_size(used)} of memory, {_size(self.limits.memory)} are allowed"
                    child.kill()


def _key(command: Sequence[str], cwd: Path | None) -> tuple[str, ...]:
    """What makes two workers the same."""
    return (*command, str(cwd))


def _size(count: float) -> str:
    return f"{count / 2**30:.1f} GiB" if count >= 2**30 else f"{count / 2**20:.0f} MiB"


def _location(package: str) -> str:
    """Folder of a package, or file of a module, for a worker to import it from."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise ImportError(f"cannot find the package {package!r}")
    return os.path.dirname(spec.origin) if spec.submodule_search_locations else spec.origin
