"""One exit code out of several: what hides what, whatever their order."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.errors import ExitCode
from harness.verdict.gate import combined


@pytest.mark.parametrize(
    ("codes", "expected"),
    [
        ((), 0),
        ((0, 0), 0),
        ((0, 1), 1),
        ((1, 70), 1),
        ((1, 2, 3, 70, 0), 1),
        ((70, 2), 70),
        ((70, 3), 70),
        ((0, 70, 3, 2), 70),
        ((2, 3), 2),
        ((0, 3), 3),
    ],
)
def test_what_hides_what(codes: tuple[int, ...], expected: int) -> None:
    for order in itertools.permutations(codes):
        assert combined(order) == expected


@given(st.lists(st.sampled_from(ExitCode)), st.randoms())
def test_the_order_of_the_robots_does_not_matter(codes: list[ExitCode], random: object) -> None:
    shuffled = [*codes]
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    code = combined(codes)
    assert code == combined(shuffled) == combined([*codes, *codes])
    assert (code == 0) == all(c == 0 for c in codes)
    assert (code == 1) == (1 in codes)
    assert code in {0, *codes}
