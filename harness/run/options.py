"""What a cross-check is asked for: one object, from the command line down to the report."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from numbers import Integral
from pathlib import Path

from harness.description.values import shown
from harness.engines.registry import REFERENCE
from harness.errors import InputError
from harness.workers.pool import Workers
from harness.workers.process import Limits

MOST_SAMPLES = 10**12  # years of computing
MOST_JOBS = 1024


@dataclass(frozen=True, kw_only=True)
class Options:
    """What a cross-check is asked to do.

    samples: random configurations, besides the fixed ones, at most 10^12.
    seed: their seed, below 2^64.
    sources: the sources to compare, which are then required; empty: those of model.toml.
    reference: the source that the others are compared with.
    command: shown in the report as how to reproduce it.
    certify: prove how far the table and the URDF can be apart at every configuration.
    explain: look for the cause of each disagreement.
    all_engines: compare also every engine that model.toml does not list.
    workers: (name, command) of programs that speak the worker protocol.
    limits: time and memory that an engine may take.
    jobs: engines that compute at a time, at most 1024; 0: one a core.
    in_process: engines run here, not in workers, for debugging.
    accepted: folder of the accepted numbers; None: the report does not say what moved since.
    strict: a discrepancy that grew since it was accepted fails.
    resume: a long run keeps a checkpoint where its session says, and continues one that was interrupted.
    probe: test each engine against its own description, if `certify` is wanted too.
    probe_seed: seed of the configurations that this takes, below 2^64. It changes nothing that is compared or accepted.
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
    resume: bool = True
    probe: bool = True
    probe_seed: int = 0
    trust: bool = False

    def reproduced_by(self, command: str) -> Options:
        """The same options, with the command line that reproduces them."""
        return replace(self, command=command)

    def worker_pool(self) -> Workers:
        """Workers as these options want them."""
        return Workers(self.limits, self.jobs, self.in_process)

    def __post_init__(self) -> None:
        """Refuse impossible values. Raises InputError."""
        self._check_types()
        if self.samples < 0:
            raise InputError(f"expected samples >= 0, got {shown(self.samples)}")
        if self.samples > MOST_SAMPLES:
            raise InputError(f"expected samples <= {MOST_SAMPLES}, got {shown(self.samples)}")
        if not 0 <= self.seed < 2**64:
            raise InputError(f"expected 0 <= seed < 2^64, got {shown(self.seed)}")
        if not 0 <= self.probe_seed < 2**64:
            raise InputError(f"expected 0 <= probe seed < 2^64, got {shown(self.probe_seed)}")
        if not 0 <= self.jobs <= MOST_JOBS:
            raise InputError(f"expected jobs >= 0 and <= {MOST_JOBS}, got {shown(self.jobs)}")

    def _check_types(self) -> None:
        if self.accepted is not None:
            if not isinstance(self.accepted, str | Path):
                raise InputError(f"expected a folder, got {self.accepted!r}", key="accepted")
            object.__setattr__(self, "accepted", Path(self.accepted))
        for name in ("samples", "seed", "jobs", "probe_seed"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Integral):
                raise InputError(f"expected a whole number, got {value!r}", key=name)
            object.__setattr__(self, name, int(value))
        for name in ("certify", "explain", "all_engines", "in_process", "strict", "resume", "probe", "trust"):
            if not isinstance(value := getattr(self, name), bool):
                raise InputError(f"expected True or False, got {value!r}", key=name)
        if not isinstance(self.limits, Limits):
            raise InputError(f"expected harness.Limits, got {self.limits!r}", key="limits")
        if not isinstance(self.sources, tuple) or not all(isinstance(source, str) for source in self.sources):
            raise InputError(f"expected a tuple of source names, got {self.sources!r}", key="sources")
