"""Engines that serve one damaged input after the other, and what the fuzzing came to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from types import TracebackType

import pytest

from harness.engines.base import Description, Engine
from harness.run.options import Options
from harness.workers.pool import Workers
from tests.fuzz.command import STATISTICS


class KeptWorkers(Workers):
    """Workers that are not ended with a run: the next input finds them idle."""

    def __init__(self) -> None:
        super().__init__()
        self._served: list[Engine] = []

    def load(self, adapter: type[Engine], description: Description, frames: Sequence[str], python: str = "") -> Engine:
        """Start an engine as always, and remember it."""
        engine = super().load(adapter, description, frames, python)
        self._served.append(engine)
        return engine

    def settle(self, engines: Iterable[Engine]) -> None:
        """As always; no engine is settled twice."""
        self._served.clear()
        super().settle(engines)

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        """Keep what has worked without fault since the last run on one robot ended."""
        self.settle(list(self._served))

    def end(self) -> None:
        """End them all."""
        super().__exit__(None, None, None)


@pytest.fixture(scope="package", autouse=True)
def _kept_workers() -> Iterator[None]:
    """A worker takes longer to start than an input to be read."""
    workers = KeptWorkers()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Options, "worker_pool", lambda options: workers)
        yield
    workers.end()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show how many inputs there were, the slowest and the largest."""
    if STATISTICS.codes:
        terminalreporter.section("fuzzing")
        for line in STATISTICS.lines():
            terminalreporter.line(line)
