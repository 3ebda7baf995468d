"""What a cross-check is asked for."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from harness.engines.registry import REFERENCE
from harness.errors import InputError
from harness.workers.pool import Workers
from harness.workers.process import Limits


@dataclass(frozen=True, kw_only=True)
class Options:
    """What a cross-check is asked to do. `sources` empty: those of model.toml. `command` is shown as how to reproduce.

    workers: (name, command) of programs that speak the worker protocol. all_engines: also every engine that model.toml does
    not list. explain: look for the cause of each disagreement. jobs: workers that compute at a time, 0 for one a core.
    in_process: engines run here, not in workers.
    """

    samples: int = 2000
    seed: int = 0
    sources: tuple[str, ...] = ()
    reference: str = REFERENCE
    command: str = ""
    certify: bool = True
    explain: bool = True
    all_engines: bool = False
    workers: tuple[tuple[str, tuple[str, ...]], ...] = ()
    limits: Limits = field(default_factory=Limits)
    jobs: int = 0
    in_process: bool = False

    def reproduced_by(self, command: str) -> Options:
        """The same options, with the command line that reproduces them."""
        return replace(self, command=command)

    def workshop(self) -> Workers:
        """Workers as these options want them."""
        return Workers(self.limits, self.jobs, self.in_process)

    def __post_init__(self) -> None:
        """Refuse impossible numbers. Raises InputError."""
        if self.samples < 0:
            raise InputError(f"expected samples >= 0, got {self.samples}")
        if not 0 <= self.seed < 2**64:
            raise InputError(f"expected 0 <= seed < 2^64, got {self.seed}")
        if self.jobs < 0:
            raise InputError(f"expected jobs >= 0, got {self.jobs}")
