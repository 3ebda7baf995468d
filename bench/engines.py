"""How well a run with every installed engine uses the cores, and what it costs to move placements between processes.

    python bench/engines.py [ROBOT] [SAMPLES]

Prints the sum of the engines' own times, the slowest, the wall time, and what the cores allow: no run can be shorter than the
slowest engine with its start, nor than all processor time spread evenly over the cores.
"""

from __future__ import annotations

import os
import resource
import sys
import time

from harness.description.locate import default_models_dir, find_model
from harness.description.model import load_model
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck

WALL = 1.2  # times what the cores allow
TRANSFER = 0.10  # of the run


def processor_seconds() -> float:
    """Spent by this process and by all that have ended below it."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def main(robot: str = "ur5", samples: str = "10000") -> int:
    """Measure one run. Returns 1 if a target is missed."""
    model = load_model(find_model(robot, default_models_dir()))
    before, start = processor_seconds(), time.perf_counter()
    report = crosscheck(model, Options(samples=int(samples), all_engines=True, certify=False))
    wall, busy = time.perf_counter() - start, processor_seconds() - before
    environment = report.environment
    own, waited = environment.engine_seconds, environment.waiting_seconds
    slowest = max(own, key=lambda name: own[name])
    for name in sorted(own, key=lambda name: own[name]):
        print(f"  {name:28} {own[name]:7.2f} s in the engine, {waited[name] - own[name]:6.3f} s around it")
    print(f"{len(own)} engines: {sum(own.values()):.1f} s together, slowest {slowest} {own[slowest]:.1f} s, all loaded after")
    cores = os.cpu_count() or 1
    allowed = max(own[slowest], busy / cores)
    transfer = sum(max(waited[name] - own[name], 0.0) for name in own) / wall
    print(f"  {environment.loading:.1f} s; wall {wall:.1f} s, processor time {busy:.1f} s on {cores} cores")
    print(f"wall / what {cores} cores allow: {wall / allowed:.2f} (target <= {WALL})")
    print(f"moving placements between processes: {100 * transfer:.1f} % of the run (target <= {100 * TRANSFER:.0f} %)")
    return int(wall > WALL * allowed or transfer > TRANSFER)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
