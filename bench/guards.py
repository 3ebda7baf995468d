"""Takes each guard out once, in a copy of the tree, and sees whether its test fails: a guard that no test misses may be lost.

    python bench/guards.py [WORD ...] [--jobs N]

The guards are in bench/guards.toml. A WORD chooses those whose item it is, or part of whose name or file. Exit code 1 if the
tests fail with all guards in their places, if one is not caught, or if the text of one is not there any more.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "bench" / "guards.toml"
COPIED = ("harness", "tests", "models", "urdf", "docs", "bench", "examples", "reports", "README.md", "pyproject.toml")
LONGEST = 400  # seconds for the tests of one guard: a guard against waiting for ever is caught by it
FAILED = 1  # what pytest ends with if tests have run, and some have failed


@dataclass(frozen=True, kw_only=True)
class Guard:
    """One guard: `old` is its text in `file`, `new` what stands there without it, `tests` are those that must then fail."""

    item: int
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def is_meant(self, words: list[str]) -> bool:
        """Whether it is one of those asked for; all are, if there are no words."""
        return not words or any(
            word == str(self.item) if word.isdigit() else word in self.name or word in self.file for word in words
        )


def guards() -> list[Guard]:
    """The table."""
    entries = tomllib.loads(TABLE.read_text(encoding="utf-8"))["guard"]
    return [Guard(**{**entry, "tests": tuple(entry["tests"])}) for entry in entries]


def copied(folder: Path) -> Path:
    """A copy of the tree, to be edited."""
    ignored = shutil.ignore_patterns("__pycache__", ".*", "_data")
    for name in COPIED:
        path = ROOT / name
        if path.is_dir():
            shutil.copytree(path, folder / name, ignore=ignored)
        elif path.exists():
            shutil.copy2(path, folder / name)
    return folder


def tested(tree: Path, tests: tuple[str, ...]) -> tuple[int | None, str]:
    """What pytest ends with in a copy, None if it does not end in time; and the first test that fails, or its last line."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    env = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=tree, env=env, capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        return None, f"not ended after {LONGEST} s"
    lines = done.stdout.splitlines() or done.stderr.splitlines() or [""]
    return done.returncode, next((line for line in lines if line.startswith(("FAILED", "ERROR"))), lines[-1])


def problem_of(guard: Guard, tree: Path) -> str:
    """Take a guard out in a copy, run its tests, and put it back. Returns why it is not caught; empty if it is."""
    path = tree / guard.file
    text = path.read_text(encoding="utf-8")
    if text.count(guard.old) != 1:
        return f"its text is there {text.count(guard.old)} times"
    path.write_text(text.replace(guard.old, guard.new), encoding="utf-8")
    try:
        code, line = tested(tree, guard.tests)
    finally:
        path.write_text(text, encoding="utf-8")
    return "" if code in (FAILED, None) else f"pytest ends with {code}: {line[:160]}"


def main() -> int:
    """Take out the guards asked for, one at a time in each copy, and print a line for each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("words", nargs="*", metavar="WORD")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    chosen = [guard for guard in guards() if guard.is_meant(arguments.words)]
    with tempfile.TemporaryDirectory() as name:
        trees: SimpleQueue[Path] = SimpleQueue()
        for i in range(arguments.jobs):
            trees.put(copied(Path(name) / str(i)))

        def tried(guard: Guard) -> str:
            tree = trees.get()
            try:
                return problem_of(guard, tree)
            finally:
                trees.put(tree)

        tree = trees.get()
        code, line = tested(tree, tuple(dict.fromkeys(test for guard in chosen for test in guard.tests)))
        trees.put(tree)
        if code:
            print(f"the tests fail with all guards in their places: {line}")
            return 1
        problems = []
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for guard, problem in zip(chosen, pool.map(tried, chosen), strict=True):
                print(f"{'NOT CAUGHT' if problem else 'caught':10}  {guard.item}  {guard.name}  {problem}".rstrip(), flush=True)
                problems += [guard] if problem else []
    print(f"{len(chosen) - len(problems)} of {len(chosen)} guards caught")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
