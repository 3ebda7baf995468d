"""How long `crosscheck --help` takes, as a ratio to importing NumPy in the same Python: machines differ, ratios hold.

Prints one row with its target and exits 1 if it is missed.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

ROUNDS = 15
TARGET = 2.5
HELP = (sys.executable, "-m", "harness", "--help")
NUMPY = (sys.executable, "-c", "import numpy")


def seconds(command: tuple[str, ...]) -> float:
    """Wall time of a process, from its start to its end [s]."""
    start = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> int:
    """Run both in turn, and print the median of the ratios of the pairs."""
    seconds(HELP), seconds(NUMPY)  # the first run compiles, and reads from the disk
    pairs = [(seconds(HELP), seconds(NUMPY)) for _ in range(ROUNDS)]
    ours, numpy = (statistics.median(times) for times in zip(*pairs, strict=True))
    print(f"crosscheck --help {ours * 1e3:.0f} ms, import numpy {numpy * 1e3:.0f} ms (medians of {ROUNDS}; informative)")
    ratio = statistics.median(one / other for one, other in pairs)
    met = ratio <= TARGET
    print(f"{'crosscheck --help / import numpy':62s} {ratio:8.2f}  at most {TARGET:g}: {'met' if met else 'MISSED'}")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
