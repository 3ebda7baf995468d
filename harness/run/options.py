"""What a cross-check is asked for: one object, from the command line down to the report."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from harness.engines.registry import REFERENCE
from harness.errors import InputError
from harness.workers.pool import Workers
from harness.workers.process import Limits


@dataclass(frozen=True, kw_only=True)
class Options:
    """What a cross-check is asked to do.

    samples: random configurations, besides the fixed ones.
    seed: their seed, below 2^64.
    sources: the sources to compare, which are then required; empty: those of model.toml.
    reference: the source that the others are compared with.
    command: shown in the report as how to reproduce it.
    certify: prove a bound for all configurations.
    explain: look for the cause of each disagreement.
    all_engines: compare also every engine that model.toml does not list.
    workers: (name, command) of programs that speak the worker protocol.
    limits: time and memory that an engine may take.
    jobs: engines that compute at a time; 0: one a core.
    in_process: engines run here, not in workers, for debugging.
    accepted: folder of the accepted numbers; None: the report does not say what moved since.
    strict: a discrepancy that grew since it was accepted fails.
    trust: start the programs that a model's own model.toml names; without it, such a model raises UntrustedError.

    Raises InputError for numbers that cannot be.
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
    accepted: Path | None = None
    strict: bool = False
    trust: bool = False

    def reproduced_by(self, command: str) -> Options:
        """The same options, with the command line that reproduces them."""
        return replace(self, command=command)

    def worker_pool(self) -> Workers:
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
