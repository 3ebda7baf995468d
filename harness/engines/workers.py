"""All workers of a run: starts them, shares the cores among them, watches their memory, ends them."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from harness.engines import protocol, requirements
from harness.engines.base import Engine
from harness.engines.child import Child, ChildError
from harness.engines.environments import where
from harness.engines.memory import MemoryWatch
from harness.engines.process import Limits, ProcessEngine
from harness.errors import EngineFailed

Result = TypeVar("Result")

WATCH = 0.1  # seconds between two looks at a worker's memory
# One thread a worker: the cores are shared among workers, not fought over by their libraries.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Workers:
    """Context manager. `jobs` workers compute at a time (default: one a core); `in_process` runs adapters here instead.

    When the harness ends, in whatever way, the workers end with it: they are in the process group of a warden that kills
    the group as soon as the pipe to the harness closes.
    """

    def __init__(self, limits: Limits | None = None, jobs: int = 0, in_process: bool = False) -> None:
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
        self._pool.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            for child in self._children:
                child.kill()
        self._pool.shutdown(wait=True)
        for child in self._children:
            child.close()
        if self._warden is not None and self._warden.stdin is not None:
            self._warden.stdin.close()
            self._warden.wait()

    def submit(self, work: Callable[[], Result]) -> Future[Result]:
        """Run `work` when a core is free."""
        return self._pool.submit(work)

    def load(self, adapter: type[Engine], description: protocol.Description, frames: Sequence[str], python: str = "") -> Engine:
        """An engine on `description`, answering at those of `frames` it has; run by `python`, by default the one that has it.

        Raises EngineUnavailable (not installed) or EngineFailed (refuses the description).
        """
        if self.in_process or not adapter.isolated:
            requirements.check(adapter)
            return adapter(description)
        python = python or where(adapter).python
        packages = [f"{name}={_location(name)}" for name in dict.fromkeys(["harness", adapter.__module__.split(".")[0]])]
        script = str(Path(__file__).with_name("worker.py"))
        command = [python, script, f"{adapter.__module__}:{adapter.__qualname__}", *packages]
        greeting = protocol.greeting(description, tuple(frames))
        with self._lock:
            idle = self._idle.get(tuple(command), [])
            child = idle.pop() if idle else None
        if child is not None:
            with contextlib.suppress(EngineFailed):  # what it served before may have spoilt it: a new one then
                return ProcessEngine(adapter.source, child, protocol.AGAIN + greeting, self.limits, adapter)
        return self.start(adapter.source, command, greeting, adapter=adapter)

    def release(self, engine: Engine) -> None:
        """Take back an engine that is needed no more; its worker may serve another description."""
        if isinstance(engine, ProcessEngine) and engine.idle:
            with self._lock:
                self._idle.setdefault(tuple(engine.child.command), []).append(engine.child)

    def start(
        self, source: str, command: Sequence[str], greeting: bytes, cwd: Path | None = None, adapter: type[Engine] | None = None
    ) -> ProcessEngine:
        """Start a worker command and greet it. Raises EngineFailed or EngineUnavailable."""
        env = {**dict.fromkeys(ONE_THREAD, "1"), **os.environ}
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
                if (used := watch.used(child.process.pid)) > self.limits.memory:
                    child.over = f"used {used / 2**30:.1f} GiB of memory, {self.limits.memory / 2**30:.1f} GiB are allowed"
                    child.kill()


def _location(package: str) -> str:
    """Folder of a package, or file of a module, for a worker to import it from."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise ImportError(f"cannot find the package {package!r}")
    return os.path.dirname(spec.origin) if spec.submodule_search_locations else spec.origin
