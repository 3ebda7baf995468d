"""The rows of a probe: where both sides are asked, and which rows are for what."""

from __future__ import annotations

import numpy as np
import pytest

from harness.cause.probe import CHECKED, FITTED, Probe
from harness.se3 import Array

LOWER, UPPER = np.array([-3.0, -0.5, 0.0]), np.array([3.0, 0.5, 1.0])
PRISMATIC = (False, True, False)


@pytest.fixture
def probe() -> Probe:
    return Probe.within(LOWER, UPPER, PRISMATIC)


def numbered(probe: Probe) -> Array:
    """Placements (N, 1, 4, 4) of which each entry is the row's number."""
    return np.arange(float(len(probe.q)))[:, None, None, None] * np.ones((1, 1, 4, 4))


def test_random_configurations_come_first_then_zero_then_steps(probe: Probe) -> None:
    assert probe.q.shape == (FITTED + CHECKED + 4, 3)
    assert (probe.q[: FITTED + CHECKED] == np.random.default_rng(0).uniform(LOWER, UPPER, (FITTED + CHECKED, 3))).all()
    assert probe.q[FITTED + CHECKED :].tolist() == [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 1.0]]


def test_every_row_is_in_one_part(probe: Probe) -> None:
    T = numbered(probe)
    observed = probe.observed(T, -T)
    assert observed["fit"].a[:, 0, 0, 0].tolist() == list(range(FITTED))
    assert (observed["fit"].b == -observed["fit"].a).all()
    assert (np.concatenate([observed["fit"].q, observed["check"].q]) == probe.q).all()
    assert (np.concatenate([observed["fit"].a, observed["check"].a]) == T).all()


def test_the_check_is_sampled_then_stepped(probe: Probe) -> None:
    check = probe.observed(numbered(probe), numbered(probe))["check"]
    assert (probe.stepped(check.q) == probe.steps).all()
    assert (probe.sampled(check.q) == probe.random[FITTED:]).all()
    assert probe.stepped(check.a)[:, 0, 0, 0].tolist() == [FITTED + CHECKED + k for k in range(4)]
    assert len(probe.sampled(check.a)) == CHECKED


def test_missing_rows_are_an_error(probe: Probe) -> None:
    T = numbered(probe)
    with pytest.raises(ValueError, match="68 configurations were asked; there are 68 and 67 placements"):
        probe.observed(T, T[:-1])
