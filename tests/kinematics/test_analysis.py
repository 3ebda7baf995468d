"""Kernels against plain 4x4 algebra, statistics against NumPy, shrinking, verdicts, noise classes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from harness import se3
from harness.comparison.compare import Comparison
from harness.comparison.components import View, components, discrepancies, mapped, matrices, rotation_residual
from harness.comparison.shrink import shrink
from harness.comparison.statistics import Stream
from harness.report.verdicts import FrameVerdict
from harness.se3 import Array
from harness.verdict.judge import Deviation, judge
from harness.verdict.noise import CLASSES, classify
from tests.helpers import assert_placements_close, transforms


@given(st.lists(transforms, min_size=6, max_size=6), st.lists(transforms, min_size=2, max_size=2))
def test_mapped_is_base_inverse_times_frame_times_offset(frames: list[Array], offsets: list[Array]) -> None:
    raw = np.array(frames).reshape(2, 3, 4, 4)  # two configurations, three raw frames, the first of them the base
    view = View((2, None, 1), np.array([offsets[0], np.eye(4), offsets[1]]), 0)
    got = matrices(mapped(components(raw), view))
    for k in range(2):
        for row, (slot, offset) in enumerate(((2, offsets[0]), (1, offsets[1]))):
            assert_placements_close(got[k, row], np.linalg.inv(raw[k, 0]) @ raw[k, slot] @ offset, 1e-12)


@given(st.lists(transforms, min_size=2, max_size=5), st.lists(transforms, min_size=5, max_size=5))
def test_discrepancies_are_those_of_se3(a: list[Array], b: list[Array]) -> None:
    T_a, T_b = np.array(a)[:, None], np.array(b[: len(a)])[:, None]
    position, rotation = discrepancies(components(T_a), components(T_b))
    assert position[0] == pytest.approx(se3.position_error(T_a[:, 0], T_b[:, 0]), abs=1e-14)
    assert rotation[0] == pytest.approx(se3.rotation_error(T_a[:, 0], T_b[:, 0]), abs=1e-7)


@given(transforms)
def test_rotations_have_no_residual(T: Array) -> None:
    assert rotation_residual(components(T[None, None]))[0, 0] < 1e-14


@pytest.mark.parametrize(
    "R",
    [
        np.diag([1.0, 1.0, -1.0]),
        np.diag([-1.0, -1.0, -1.0]),
        1.001 * np.eye(3),
        np.eye(3) + 0.01 * np.eye(3, k=1),
        np.zeros((3, 3)),
    ],
    ids=["reflection", "inversion", "scale", "shear", "zero"],
)
def test_what_is_no_rotation_has_a_residual(R: Array) -> None:
    T = np.eye(4)
    T[:3, :3] = R
    assert rotation_residual(components(T[None, None]))[0, 0] > 1e-3


values = hnp.arrays(np.float64, st.tuples(st.integers(1, 3), st.integers(1, 80)), elements=st.floats(0.0, 1e3))


@given(values, st.integers(1, 40))
def test_streamed_statistics_equal_those_of_the_whole(x: Array, block: int) -> None:
    stream = Stream(x.shape[0])
    for start in range(0, x.shape[1], block):
        stream.update(start, x[:, start : start + block])
    for f, row in enumerate(x):
        assert stream.max[f] == row.max()
        assert row[stream.argmax[f]] == row.max()
        assert stream.argmax[f] == row.argmax()  # the first of equals, whatever the blocks
        assert stream.mean(f) == pytest.approx(row.mean(), rel=1e-12)
        assert sum(stream.decades(f).values()) == row.size == stream.count[f]
        for fraction in (0.5, 0.95, 0.99):
            exact = np.quantile(row, fraction, method="inverted_cdf")
            assert exact <= stream.quantile(f, fraction) * (1 + 1e-12) <= max(exact * 1.1549, 1.2e-15) * (1 + 1e-12)


def test_statistics_leave_out_what_is_not_valid() -> None:
    stream = Stream(2)
    x = np.array([[1.0, np.nan, 3.0], [np.nan, np.nan, np.nan]])
    stream.update(10, x, np.isfinite(x))
    assert (stream.count.tolist(), stream.max.tolist(), stream.argmax.tolist()) == ([2, 0], [3.0, -1.0], [12, -1])
    assert (stream.mean(0), stream.mean(1), stream.quantile(1, 0.5), stream.decades(1)) == (2.0, 0.0, 0.0, {})


def chain(n: int) -> Array:
    return np.tile(np.eye(4), (n, 2, 1, 1))


def compare(broken: Array) -> Comparison:
    view = View((0, 1), np.tile(np.eye(4), (2, 1, 1)), None)
    comparison = Comparison({"a": view, "b": view}, "a", 2, subset=3)
    comparison.update(0, {"a": chain(len(broken)), "b": broken})
    return comparison


@pytest.mark.parametrize(
    ("entry", "value", "invalid"),
    [
        ((4, 1, 0, 3), np.nan, 1),
        ((4, 1, 2, 2), np.inf, 1),
        ((4, 1, 0, 3), 1e200, 1),
        ((4, 1, 3, 3), 1.1, 1),
        ((4, 1, 3, 0), np.nan, 1),
        ((4, 1, 0, 0), -1.0, 1),
        ((4, 1, 0, 1), 1e-5, 1),
        ((4, 1, 0, 1), 1e-8, 0),
        ((4, 1, 2, 3), 5.0, 0),
    ],
)
def test_every_placement_is_checked(entry: tuple[int, ...], value: float, invalid: int) -> None:
    broken = chain(6)
    broken[entry] = value
    comparison = compare(broken)
    assert comparison.validity["b"].invalid == invalid
    assert comparison.validity["b"].checked == 12
    assert comparison.validity["b"].first == ((4, 1) if invalid else None)
    assert comparison.validity["a"].invalid == 0
    finite = abs(value) < 1e100
    assert comparison.position["b"].count.tolist() == ([6, 6] if finite or entry[2] == 3 else [6, 5])


def test_an_engine_of_nothing_but_nan_is_never_compared() -> None:
    comparison = compare(np.full((4, 2, 4, 4), np.nan))
    assert comparison.validity["b"].invalid == 8
    assert comparison.position["b"].count.tolist() == [0, 0]


def test_a_dropped_source_leaves_nothing_behind() -> None:
    comparison = compare(chain(3))
    comparison.drop("b")
    assert (comparison.position, comparison.pairs, list(comparison.views)) == ({}, {}, ["a"])


def test_the_worst_configuration_is_found_across_blocks() -> None:
    broken = chain(5000)
    broken[3210, 1, 0, 3] = 0.25
    comparison = compare(broken)
    assert comparison.position["b"].argmax[1] == 3210
    assert comparison.worst("b", (1e-9, 1e-9), [0, 1]) == (1, 3210)
    assert comparison.worst("b", (1.0, 1.0), [0, 1]) is None
    assert comparison.worst("b", (1e-9, 1e-9), [0]) is None
    assert comparison.pairs["a", "b"].position == 0.0  # the subset ends before it


def test_pairs_are_compared_on_the_subset() -> None:
    broken = chain(5)
    broken[2, 1, 1, 3] = 0.5
    broken[3, 0, 1, 3] = 9.0
    pair = compare(broken).pairs["a", "b"]
    assert (pair.position, pair.position_frame) == (0.5, 1)


@given(hnp.arrays(np.float64, 6, elements=st.floats(-6, 6)), st.sets(st.integers(0, 5), min_size=1))
def test_shrinking_keeps_only_the_joints_that_matter(q: Array, needed: set[int]) -> None:
    def disagrees(q: Array) -> bool:
        return all(abs(q[i]) > 0.01 for i in needed)

    q = np.where(np.abs(q) < 0.1, 0.5, q)
    small = shrink(q, disagrees)
    assert disagrees(small)
    assert set(np.flatnonzero(small)) == needed


def test_shrinking_asks_a_bounded_number_of_times() -> None:
    calls = 0

    def disagrees(q: Array) -> bool:
        nonlocal calls
        calls += 1
        return bool(np.abs(q).sum() > 1.0)

    shrink(np.linspace(1, 2, 7), disagrees)
    assert calls <= 7 * 8 + 7


LIMIT = (1e-9, 1e-9)
MM = Deviation(1e-3, 0.0, 0.02)


@pytest.mark.parametrize(
    ("position", "rotation", "deviation", "expected"),
    [
        (0.0, 0.0, None, "agrees"),
        (1e-9, 1e-9, None, "agrees"),
        (1.1e-9, 0.0, None, "disagrees"),
        (0.0, 1.1e-9, None, "disagrees"),
        (1e-3, 0.0, MM, "accepted"),
        (0.985e-3, 0.0, MM, "accepted"),
        (1.03e-3, 0.0, MM, "deviation changed"),
        (0.97e-3, 0.0, MM, "deviation changed"),
        (1e-3, 1e-3, MM, "deviation changed"),
        (1e-10, 0.0, MM, "deviation vanished"),
        (0.0, 0.1, Deviation(0.0, 0.1, 0.02), "accepted"),
        (1e-6, 0.1, Deviation(0.0, 0.1, 0.02), "deviation changed"),
    ],
)
def test_judging(position: float, rotation: float, deviation: Deviation | None, expected: FrameVerdict) -> None:
    assert judge(position, rotation, LIMIT, deviation) == expected


@pytest.mark.parametrize(
    ("position", "rotation", "reach", "key"),
    [
        (3e-15, 0.0, 1.0, "float64"),
        (5.2e-12, 1.5e-11, 1.0, "pi-12-digits"),
        (3.5e-10, 6.3e-10, 1.6, "pi-10-digits"),
        (8e-8, 8.7e-8, 1.0, "float32"),
        (4e-6, 3.7e-6, 1.0, "pi-5-digits"),
        (0.0003, 0.0, 1.0, "model"),
        (0.0, 3.14, 1.0, "model"),
        (7e-8, 0.0, 0.1, "pi-5-digits"),  # relative to a small arm it is more
    ],
)
def test_noise_classes(position: float, rotation: float, reach: float, key: str) -> None:
    assert classify(position, rotation, reach).key == key
    assert [c.limit for c in CLASSES] == sorted(c.limit for c in CLASSES)
