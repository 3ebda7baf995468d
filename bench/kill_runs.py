"""Kills runs over three robots at random moments: every robot's reports are all the old ones or all the new ones.

    python bench/kill_runs.py [COUNT] [--samples N]

Each time a run is killed, with SIGKILL. Then each robot's four files are read: HTML, Markdown and JUnit must be, byte for byte,
what the JSON beside them says. Started again, the run must end with the numbers of one that was not killed, and leave nothing
behind. Checkpoints are written after every block, so that killed runs continue. Exit code 1 if anything is half done.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from harness.rendering.html import render_html
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report.json_file import read_report, to_json

ROBOTS = ("sixr", "stanford", "ur5")
ENDS = (".json", ".html", ".md", ".junit.xml")
START = "import harness.run.checkpoint as c; c.EVERY = 0.0; from harness.cli.main import main; main()"


def command(folder: Path, samples: int, seed: int) -> list[str]:
    """A run over the robots, with two engines that start quickly."""
    sources = ("--source", "dh:pinocchio", "--source", "urdf:pinocchio")
    options = ("--samples", str(samples), "--seed", str(seed), "--out", str(folder), "--no-certify", "--quiet")
    return [sys.executable, "-c", START, "run", *ROBOTS, *sources, *options]


def numbers(path: Path) -> dict[str, Any]:
    """A report's document without what varies."""
    document = dict(json.loads(path.read_text()))
    document.pop("environment")
    document["settings"].pop("command")
    return document


def seed_of(folder: Path, robot: str) -> int | None:
    """The seed of a robot's reports; None if it has none. Raises AssertionError if they are half of one run, half of another."""
    there = [end for end in ENDS if (folder / f"{robot}{end}").exists()]
    if not there:
        return None
    assert len(there) == len(ENDS), f"{robot} has {', '.join(there)} alone"
    report = read_report(folder / f"{robot}.json")
    texts = (to_json(report), render_html(report), render_markdown(report), render_junit(report))
    for end, text in zip(ENDS, texts, strict=True):
        assert (folder / f"{robot}{end}").read_text() == text, f"{robot}{end} is not what {robot}.json says"
    return report.settings.seed


class Bench:
    """One folder of reports, written by one run after the other with another seed each."""

    def __init__(self, folder: Path, samples: int) -> None:
        self.folder, self.samples, self.continued = folder / "reports", samples, 0
        self.expected: list[dict[str, dict[str, Any]]] = []
        self.env = {**os.environ, "FK_CROSSCHECK_CACHE": str(folder / "cache")}
        for seed in (0, 1):  # what runs that are not killed give
            whole = folder / f"whole{seed}"
            start = time.perf_counter()
            subprocess.run(command(whole, samples, seed), check=True, env=self.env)
            self.seconds = time.perf_counter() - start
            self.expected.append({robot: numbers(whole / f"{robot}.json") for robot in ROBOTS})

    def kill(self, seed: int, moment: float) -> str:
        """Kill a run at a part of its time, look, and start it again to the end. Returns what was there after the kill."""
        process = subprocess.Popen(command(self.folder, self.samples, seed), env=self.env)
        time.sleep(moment * self.seconds)
        process.kill()
        process.wait()
        seen = [seed_of(self.folder, robot) for robot in ROBOTS]
        again = subprocess.run(
            command(self.folder, self.samples, seed), check=False, env=self.env, stderr=subprocess.PIPE, text=True
        )
        assert again.returncode == 0, again.stderr
        self.continued += "continues an interrupted run" in again.stderr
        for robot in ROBOTS:
            assert seed_of(self.folder, robot) == seed
            assert numbers(self.folder / f"{robot}.json") == self.expected[seed][robot], f"{robot} has other numbers"
        left_over = sorted(p.name for p in self.folder.iterdir() if p.name.startswith("."))
        assert not left_over, f"left over: {', '.join(left_over)}"
        return " ".join("none" if s is None else "new" if s == seed else "old" for s in seen)


def main() -> int:
    """Kill as often as asked, and say what was seen."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("count", type=int, nargs="?", default=100)
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    arguments = parser.parse_args()
    chance, seen = random.Random(arguments.seed), dict[str, int]()
    with tempfile.TemporaryDirectory() as name:
        bench = Bench(Path(name), arguments.samples)
        for i in range(arguments.count):
            try:
                after = bench.kill(i % 2, chance.random())
            except AssertionError as error:
                print(f"kill {i + 1}: {error}")
                return 1
            seen[after] = seen.get(after, 0) + 1
    print(f"{arguments.count} runs over {', '.join(ROBOTS)} killed: none half done, all ended with the same numbers when started")
    print(f"again, {bench.continued} of them from a checkpoint. After the kill the reports of the robots were:")
    for after, number in sorted(seen.items()):
        print(f"{number:5} x {after}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
