"""How much memory workers, and what they have started, use."""

from __future__ import annotations

import contextlib
import time

import psutil

LOOK_BELOW = 1.0  # seconds: finding descendants means reading the whole process table


class MemoryWatch:
    """Resident bytes by process id. The process table is read once a second, for all workers together."""

    def __init__(self) -> None:
        self._children: dict[int, list[int]] = {}
        self._read = float("-inf")

    def used(self, pid: int) -> int:
        """Bytes used by the process and its descendants, 0 if it has ended."""
        self._look_below()
        total, todo = 0, [pid]
        while todo:
            current = todo.pop()
            todo += self._children.get(current, [])
            with contextlib.suppress(psutil.Error):
                total += psutil.Process(current).memory_info().rss
        return total

    def _look_below(self) -> None:
        if time.monotonic() - self._read < LOOK_BELOW:
            return
        self._children = {}
        for process in psutil.process_iter(["ppid"]):
            self._children.setdefault(process.info["ppid"], []).append(process.pid)
        self._read = time.monotonic()
