"""Speed and memory of the harness, as ratios within one run: machines differ, ratios hold.

Prints one row a figure with its target and exits 1 if one is missed. N = 100 000, UR5, all six frames read.
"""

from __future__ import annotations

import gc
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytorch_kinematics as pk
import torch

from harness.description.locate import default_models_dir, find_model
from harness.description.model import RobotModel, load_model
from harness.engines.dh_numpy import DHNumpy
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck

N = 100_000
ROUNDS = 5
LINKS = ("shoulder_link", "upper_arm_link", "forearm_link", "wrist_1_link", "wrist_2_link", "tool0")
LABELS = ("1", "2", "3", "4", "5", "6")


def seconds(work: Callable[[], object]) -> float:
    """Wall time of one call [s]."""
    gc.collect()
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def pinocchio_loop(text: str, q: Any) -> Callable[[], object]:
    """A Python loop over framesForwardKinematics that reads six placements, as its users write it."""
    model = pin.buildModelFromXML(text)
    data = model.createData()
    ids = [model.getFrameId(name, pin.FrameType.BODY) for name in LINKS]

    def work() -> object:
        out = np.empty((len(q), len(ids), 4, 4))
        for k, q_k in enumerate(q):
            pin.framesForwardKinematics(model, data, q_k)
            for slot, i in enumerate(ids):
                out[k, slot] = data.oMf[i].homogeneous
        return out

    return work


def pytorch_chain(text: str, q: Any, batch: int) -> Callable[[], object]:
    """pytorch-kinematics' chain on the CPU in float64, in batches, reading six placements."""
    chain = pk.build_chain_from_urdf(text.encode()).to(dtype=torch.float64)
    indices = chain.get_frame_indices(*LINKS)
    tensor = torch.from_numpy(q)

    def work() -> object:
        with torch.no_grad():
            for start in range(0, len(q), batch):
                poses = chain.forward_kinematics(tensor[start : start + batch], indices)
                for name in LINKS:
                    poses[name].get_matrix().numpy()
        return None

    return work


def engine_rows(model: RobotModel) -> list[tuple[str, float, float, str]]:
    """dh:numpy against the loop and the batched chain: medians of ratios of runs taken in turn."""
    if model.urdf is None:
        raise RuntimeError("the benchmark needs a model with a URDF")
    q = model.configurations.random(0, 0, N)
    in_house = DHNumpy(model.table)
    rivals = {
        "Pinocchio loop": (pinocchio_loop(model.urdf.text, q), 12.0),
        "pytorch-kinematics, one batch": (pytorch_chain(model.urdf.text, q, N), 12.0),
        "pytorch-kinematics, batches of 4096": (pytorch_chain(model.urdf.text, q, 4096), 0.0),
    }
    ours: list[float] = []
    ratios: dict[str, list[float]] = {name: [] for name in rivals}
    in_house.placements(q, LABELS)
    for name, (work, _) in rivals.items():
        if not name.startswith("Pinocchio"):
            work()  # the first batched call pays for allocation
    for _ in range(ROUNDS):
        for name, (work, _) in rivals.items():
            mine = min(seconds(lambda: in_house.placements(q, LABELS)) for _ in range(3))
            ours.append(mine)
            ratios[name].append(seconds(work) / mine)
    print(f"dh:numpy {statistics.median(ours) / N * 1e6:.2f} us a configuration (median of {len(ours)}; informative)")
    return [(f"{name} / dh:numpy", statistics.median(ratios[name]), target, "at least") for name, (_, target) in rivals.items()]


def overhead_row(model: RobotModel) -> tuple[str, float, float, str]:
    """Wall time of a run over the sum of the time spent inside its engines."""
    options = Options(samples=N, seed=0, sources=("dh:pinocchio", "urdf:pinocchio"), certify=False)
    ratios = []
    for _ in range(3):
        environment = crosscheck(model, options).environment
        ratios.append(environment.duration / sum(environment.engine_seconds.values()))
    return "run / sum of engine times (3 sources)", statistics.median(ratios), 1.5, "at most"


_PEAK = """
import re, sys
from pathlib import Path
from harness.verdict.crosscheck import crosscheck
from harness.description.locate import default_models_dir, find_model
from harness.description.model import load_model
from harness.run.options import Options
model = load_model(find_model("ur5", default_models_dir()))
crosscheck(model, Options(int(sys.argv[1]), 0, ("dh:pinocchio", "urdf:pinocchio")))
# Not getrusage: across fork and exec it keeps the peak of the parent.
print(int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024)
"""


def memory_row() -> tuple[str, float, float, str]:
    """Peak memory [MB] of 1 000 000 samples over that of 10 000, each in a process of its own (Linux)."""
    few, many = (
        float(subprocess.run([sys.executable, "-c", _PEAK, n], capture_output=True, text=True, check=True).stdout)
        for n in ("10000", "1000000")
    )
    print(f"peak memory {few:.0f} MB with 10 000 samples, {many:.0f} MB with 1 000 000")
    return "peak memory, 1 000 000 less 10 000 samples [MB]", many - few, 100.0, "at most"


def main() -> int:
    """Run everything and print the table."""
    model = load_model(find_model("ur5", default_models_dir()))
    missed = 0
    for name, value, target, sense in [
        *engine_rows(model),
        overhead_row(model),
        memory_row(),
    ]:
        met = value >= target if sense == "at least" else value <= target
        missed += not met
        verdict = "" if target == 0.0 else f"{sense} {target:g}: {'met' if met else 'MISSED'}"
        print(f"{name:62s} {value:8.2f}  {verdict or 'informative'}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
