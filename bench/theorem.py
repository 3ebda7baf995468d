"""How long the theorem of two descriptions takes, all frames, sharpened where it is loose. Exits 1 if a limit is exceeded.

Beside each time stands its ratio to the same bound in double precision, without any proof: both descriptions evaluated by the
in-house FK at the 3^n nodes that determine them, a discrete Fourier transform, and the sum of the coefficients' norms.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.description.locate import default_models_dir, find_model
from harness.description.model import load_model
from harness.kinematics.descriptions import of_table as mechanism_of_table
from harness.kinematics.descriptions import of_urdf as mechanism_of_urdf
from harness.kinematics.mechanism import Mechanism
from harness.run.proving import slides_of
from harness.theorem.descriptions import of_model, of_table
from harness.theorem.statement import theorem

ROUNDS = 5


def median(work: Callable[[], object]) -> float:
    """Median time of a call, after one to warm up [s]."""
    work()
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def double_precision(a: Mechanism, b: Mechanism) -> float:
    """The sum of the norms of the coefficients of the position's difference, in float64 [m]."""
    n = len(a.joints)
    mesh = np.meshgrid(*[np.arange(3) * 2.0 * math.pi / 3.0] * n, indexing="ij")
    q = np.stack([m.ravel() for m in mesh], axis=1)
    D = a.placements(q)[:, :, :3, 3] - b.placements(q)[:, :, :3, 3]
    c = np.fft.fftn(D.reshape(*[3] * n, *D.shape[1:]), axes=range(n)) / 3.0**n
    return float(np.linalg.norm(c, axis=-1).reshape(3**n, -1).sum(axis=0).max())


def of_robot(name: str) -> tuple[float, float]:
    """Seconds of a robot's theorem, and of double precision."""
    model = load_model(find_model(name, default_models_dir()))
    if model.urdf is None or model.urdf_joints is None or model.frames.base.urdf is None:
        raise RuntimeError(f"{name} has no URDF")

    def work() -> object:
        chains = of_model(model, {})
        return theorem(chains["dh"], chains["urdf"], slides_of(model))

    entries = [f for f in model.frames.frames if f.urdf and f.offset is not None]
    table = mechanism_of_table(model.table, {f.name: (f.dh, np.asarray(f.offset)) for f in entries})
    links = {f.name: str(f.urdf) for f in entries}
    joints = model.table.joints
    urdf = mechanism_of_urdf(model.urdf, model.frames.base.urdf, links, model.urdf_joints, joints, [False] * len(joints))
    return median(work), median(lambda: double_precision(table, urdf))


def of_thirty_joints() -> float:
    """Seconds of a chain of thirty joints against the same with one link longer, all thirty frames."""
    rows = tuple(DHRow(name=f"j{i}", kind="revolute", a=0.1, alpha=math.pi / 2 * (-1) ** i, d=0.05, theta=0.0) for i in range(30))
    longer = (*rows[:12], DHRow(name="j12", kind="revolute", a=0.1001, alpha=math.pi / 2, d=0.05, theta=0.0), *rows[13:])
    frames = {str(i): (str(i), ()) for i in range(1, 31)}

    def work() -> object:
        a, b = (of_table(DHTable(r), frames, (), ()) for r in (rows, longer))
        return theorem(a, b, {})

    return median(work)


def main() -> int:
    """Print the table."""
    missed = 0
    for name, limit in (("ur5", 0.5), ("panda", 1.5)):
        seconds, double = of_robot(name)
        missed += seconds > limit
        print(f"theorem of {name}: {seconds:.3f} s, at most {limit} s; {seconds / double:.1f} x double precision")
    seconds = of_thirty_joints()
    missed += seconds > 5.0
    print(f"theorem of 30 joints: {seconds:.3f} s, at most 5 s; 3^30 nodes are none for double precision")
    return min(1, missed)


if __name__ == "__main__":
    sys.exit(main())
