"""Randomly perturbed random chains: no proven bound may lie below what mpmath, another library, finds. Exits 1 if one does.

    python bench/soundness.py [CHAINS] [--tight N] [--intervals N]

CHAINS (10000) chains of three to seven joints, a quarter of them sliding: the discrepancy at the worst configurations that were
found, with 50 digits, is at most the bound. --tight (200): how close the sharpest bounds are to what was found, and how long they
take; at least nine of ten must be within a tenth. --intervals (1000): at 100 random configurations of each of so many chains, the
lower end of an interval that encloses the discrepancy is at most the bound; for half the bound that must fail.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from harness.description.dh import DHTable
from harness.se3 import Array, chord_angle
from harness.theorem.chain import Chains
from harness.theorem.descriptions import of_table
from harness.theorem.prove import Effort, FrameBound, prove
from tests.theorem.independent import chord_at_least, found, perturbed, position_at_least, random_table

SLIDE = 0.7
PLAIN = Effort(nodes=0)
SHARP = Effort(above=0.0, nodes=40_000_000)
WITHIN, LIMIT = 1.1, 10.0  # the ratio aimed at, and the seconds it may take


def pair(seed: int) -> tuple[DHTable, DHTable, np.random.Generator]:
    """A random table and a perturbed one."""
    rng = np.random.default_rng(seed)
    table = random_table(rng, int(rng.integers(3, 8)))
    return table, perturbed(table, rng, 10.0 ** rng.uniform(-12, 0)), rng


def chains(table: DHTable) -> Chains:
    """The end of a table."""
    return of_table(table, {"end": (str(len(table.rows)), ())}, (), ())


def proven(a: DHTable, b: DHTable, effort: Effort) -> FrameBound:
    """What is proven of two tables."""
    reach = np.array([SLIDE * (a.kind(joint) == "prismatic") for joint in a.joints])
    return prove(chains(a), chains(b), np.stack([-reach, reach], axis=1), effort)["end"]


def seen(a: DHTable, b: DHTable, bound: FrameBound) -> tuple[float, float]:
    """The largest discrepancies at the worst configurations, with 50 digits: position [m], rotation [rad]."""
    both = [found(a, b, q) for q in bound.worst]
    return max(x for x, _ in both), float(chord_angle(np.array(max(y for _, y in both))))


def sound(count: int) -> int:
    """How many chains have a bound below what was found."""
    failures, ratios = 0, []
    for seed in range(count):
        a, b, _ = pair(seed)
        bound = proven(a, b, PLAIN)
        position, rotation = seen(a, b, bound)
        failures += position > bound.position or rotation > bound.rotation * (1.0 + 1e-12)
        ratios.append(bound.position / position if position > 0.0 else 1.0)
    low, high, top = np.quantile(ratios, [0.5, 0.95, 1.0])
    print(f"{count} chains: {failures} bounds exceeded; proven / found: median {low:.2f}, 95 % {high:.2f}, largest {top:.2f}")
    return failures


def tight(count: int) -> int:
    """How many of ten are missing to nine of ten within a tenth; 0 if none is."""
    close, slowest, late = 0, 0.0, 0
    for seed in range(count):
        a, b, _ = pair(seed)
        start = time.perf_counter()
        bound = proven(a, b, SHARP)
        seconds = time.perf_counter() - start
        slowest, late = max(slowest, seconds), late + (seconds > LIMIT)
        position, rotation = seen(a, b, bound)
        parts = [(x, y) for x, y in ((bound.position, position), (bound.rotation, rotation)) if y > 1e-25]
        ratio = max((x / y for x, y in parts), default=1.0)
        close += ratio <= WITHIN
        if ratio > WITHIN:
            print(f"  chain {seed}, {len(a.joints)} joints: proven {ratio:.3f} times what was found, in {seconds:.1f} s")
    share = close / max(count, 1)
    print(f"{count} chains sharpened: {share:.1%} within {WITHIN} times; slowest {slowest:.1f} s, {late} above {LIMIT:g} s")
    return int(share < 0.9)


def by_intervals(count: int) -> int:
    """How many chains have a configuration that mpmath's intervals put above the bound. 1 also if half the bound passes."""
    failures = halves = 0
    for seed in range(count):
        a, b, rng = pair(seed)
        bound = proven(a, b, PLAIN)
        chord = 2.0 * math.sqrt(2.0) * math.sin(min(bound.rotation, math.pi) / 2.0)
        q = configurations(a, rng)
        lows = max(position_at_least(a, b, x) for x in q), max(chord_at_least(a, b, x) for x in q)
        failures += lows[0] > bound.position or lows[1] > chord * (1.0 + 1e-12)
        halves += lows[0] > bound.position / 2.0 or lows[1] > chord / 2.0
    print(f"{count} chains by intervals: {failures} above the bound, {halves} above half of it")
    return failures + int(count > 0 and not halves)


def configurations(table: DHTable, rng: np.random.Generator) -> Array:
    """100 random configurations (100, n), several turns, slides within their range."""
    slides = np.array([table.kind(j) == "prismatic" for j in table.joints])
    reach = np.where(slides, SLIDE, 3.0 * math.pi)
    return np.asarray(rng.uniform(-reach, reach, (100, len(reach))))


def main() -> int:
    """Run all three."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("chains", nargs="?", type=int, default=10_000)
    parser.add_argument("--tight", type=int, default=200)
    parser.add_argument("--intervals", type=int, default=1_000)
    asked = parser.parse_args()
    return min(1, sound(asked.chains) + tight(asked.tight) + by_intervals(asked.intervals))


if __name__ == "__main__":
    sys.exit(main())
