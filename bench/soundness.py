"""Randomly perturbed random chains: no certified bound may lie below the largest discrepancy seen. Exits 1 if one does.

`python bench/soundness.py 10000` takes some minutes; the test suite runs a few dozen of the same.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from harness.certificate.certify import certify, found_from, sample
from harness.certificate.interpolation import weights
from harness.certificate.links import certify_links, sample_links
from tests.certificate.test_certify import axes_of, evaluate, links_of, perturbed, random_table


def main(count: int) -> int:
    """Check `count` chains of 3 to 7 joints, revolute and prismatic; print the worst ratios."""
    failures, tightness, refused = 0, [], 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        joints = int(rng.integers(3, 8))
        table = random_table(rng, joints)
        changed = perturbed(table, rng, 10.0 ** rng.uniform(-12, 0))
        a, b, axes, links = evaluate(table), evaluate(changed), axes_of(table), links_of(table)
        own, other = sample(a, axes, rng), sample(b, axes, rng)
        refused += not (own.holds and other.holds)
        D = own.values - other.values
        q = np.column_stack([rng.uniform(axis.lower, axis.upper, 300) for axis in axes])
        position, rotation = found_from(
            lambda q, a=a, b=b: a(q) - b(q),  # type: ignore[misc]
            lambda q, axes=axes, D=D: np.tensordot(weights(axes, q), D, axes=1),  # type: ignore[misc]
            axes, q, 1e-13,
        )  # fmt: skip
        first, second = (sample_links(e, axes, links, rng) for e in (a, b))
        for bounds in (certify(own, other, axes), certify_links(first, second, axes, links, joints)):
            failures += int((position > bounds.position).any() or (rotation > bounds.rotation).any())
        if position[-1] > 1e-9:
            tightness.append(float(certify(own, other, axes).position[-1] / position[-1]))
    q50, q95, q100 = np.quantile(tightness, [0.5, 0.95, 1.0])
    print(f"{count} chains: {failures} bounds exceeded, {refused} premises refused")
    print(f"certified / found at the tip: median {q50:.2f}, 95 % {q95:.2f}, largest {q100:.2f}")
    return 1 if failures or refused else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000))
