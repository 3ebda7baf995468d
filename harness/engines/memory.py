"""How much memory a worker and what it has started use."""

from __future__ import annotations

import contextlib
import time

import psutil

LOOK_BELOW = 1.0  # seconds: finding descendants means reading the whole process table


class MemoryWatch:
    """Resident bytes by process id; descendants are looked up once a second."""

    def __init__(self) -> None:
        self._below: dict[int, tuple[float, int]] = {}

    def used(self, pid: int) -> int:
        """Bytes used by the process and its descendants, 0 if it has ended."""
        with contextlib.suppress(psutil.Error):
            process = psutil.Process(pid)
            when, below = self._below.get(pid, (0.0, 0))
            if time.monotonic() - when > LOOK_BELOW:
                below = sum(child.memory_info().rss for child in process.children(recursive=True))
                self._below[pid] = (time.monotonic(), below)
            return int(process.memory_info().rss) + below
        return 0
