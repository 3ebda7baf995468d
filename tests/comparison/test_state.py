"""A comparison half done: written, read back and continued it is the one that was never interrupted, to the last digit."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from harness import se3
from harness.comparison.compare import Comparison
from harness.comparison.components import View
from harness.comparison.state import ComparisonState, restore, state_of
from harness.se3 import Array

SOURCES = ("reference", "good", "bad", "partial")
BLOCK = 4096


def comparison() -> Comparison:
    eye = np.tile(np.eye(4), (3, 1, 1))
    views = {name: View((0, 1, 2), eye, None) for name in SOURCES}
    views["partial"] = View((0, None, 1), eye, 0)
    return Comparison(views, "reference", 3, 300)


def answers(start: int, count: int) -> dict[str, Array]:
    """Placements of all sources: one that is near, one with values that are none, one without a frame."""
    rng = np.random.default_rng(start)
    xyz, rpy = rng.uniform(-1, 1, (2, count * 3, 3))
    T = np.array([se3.from_xyz_rpy(a, b) for a, b in zip(xyz, rpy, strict=True)]).reshape(count, 3, 4, 4)
    T[:, 0] = np.eye(4)
    near, bad = T.copy(), T.copy()
    near[..., :3, 3] += rng.normal(0, 1e-9, near[..., :3, 3].shape)
    bad[::7, 1] *= 1.5
    bad[::11, 2, 0, 3] = np.nan
    return {"reference": T, "good": near, "bad": bad, "partial": near[:, [0, 2]]}


@pytest.fixture(scope="module")
def blocks() -> list[tuple[int, dict[str, Array]]]:
    return [(start, answers(start, 700)) for start in (0, 700, 1400)]


def fed(blocks: list[tuple[int, dict[str, Array]]], into: Comparison) -> Comparison:
    for start, raw in blocks:
        into.update(start, {name: raw[name] for name in into.views})
    return into


def through_json(state: ComparisonState) -> ComparisonState:
    return ComparisonState.model_validate_json(state.model_dump_json())


@pytest.mark.parametrize("cut", [1, 2, 3])
def test_continued_it_is_the_same(blocks: list[tuple[int, dict[str, Array]]], cut: int) -> None:
    whole = state_of(fed(blocks, comparison()))
    continued = comparison()
    restore(continued, through_json(state_of(fed(blocks[:cut], comparison()))), 700 * cut)
    fed(blocks[cut:], continued)
    assert state_of(continued).model_dump_json() == whole.model_dump_json()
    assert whole.validity["bad"].invalid > 0
    assert list(continued.pairs) == [(pair.a, pair.b) for pair in whole.pairs]
    every = fed(blocks, comparison())
    for name in every.position:
        assert continued.furthest(name, (1e-9, 1e-9), range(3)) == every.furthest(name, (1e-9, 1e-9), range(3))
        for frame in range(3):
            assert continued.position[name].quantile(frame, 0.95) == every.position[name].quantile(frame, 0.95)
            assert continued.position[name].mean(frame) == every.position[name].mean(frame)


def test_a_source_that_was_taken_out_stays_out(blocks: list[tuple[int, dict[str, Array]]]) -> None:
    first = fed(blocks[:1], comparison())
    first.drop("bad")
    state = through_json(state_of(first))
    with pytest.raises(ValueError, match="its sources cannot be"):
        restore(comparison(), state, 700)
    continued = comparison()
    continued.drop("bad")
    restore(continued, state, 700)
    assert state_of(continued) == state


WRONG: list[tuple[Callable[[Any], Any], str]] = [
    (lambda s: s["position"].pop("good"), "its sources"),
    (lambda s: s["validity"].update(other=s["validity"]["good"]), "its sources"),
    (lambda s: s["position"]["good"]["count"].append(0), "the number of frames"),
    (lambda s: s["position"]["good"]["histogram"].pop(), "the number of frames"),
    (lambda s: s["position"]["good"]["count"].__setitem__(1, 699), "a count"),
    (lambda s: s["position"]["good"]["count"].__setitem__(1, 10**6), "a count"),
    (lambda s: s["position"]["good"]["histogram"][1].append([352, 0]), "a histogram"),
    (lambda s: s["position"]["good"]["histogram"][1].append([s["position"]["good"]["histogram"][1][0][0], 0]), "a histogram"),
    (lambda s: s["position"]["good"]["argmax"].__setitem__(1, 700), "a maximum"),
    (lambda s: s["position"]["good"]["argmax"].__setitem__(1, -1), "a maximum"),
    (lambda s: s["position"]["good"]["max"].__setitem__(1, 1e-30), "a sum"),
    (lambda s: s["validity"]["good"].update(checked=1), "the count of placements"),
    (lambda s: s["validity"]["good"].update(invalid=10**6), "the count of placements"),
    (lambda s: s["validity"]["bad"].update(first=[0, 3]), "the first invalid placement"),
    (lambda s: s["validity"]["bad"].update(first=[700, 1]), "the first invalid placement"),
    (lambda s: s["pairs"][0].update(a="nobody"), "a pair of sources"),
    (lambda s: s["pairs"][0].update(position_frame=3), "the frame of a pair"),
    (lambda s: s["pairs"][0].update(position_frame=-1), "the frame of a pair"),
]


@pytest.mark.parametrize(("spoil", "what"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_state_that_cannot_be_is_refused(
    blocks: list[tuple[int, dict[str, Array]]], spoil: Callable[[Any], Any], what: str
) -> None:
    document = json.loads(state_of(fed(blocks[:1], comparison())).model_dump_json())
    spoil(document)
    new = comparison()
    with pytest.raises(ValueError, match=f"{what} cannot be"):
        restore(new, ComparisonState.model_validate_json(json.dumps(document)), 700)
    assert state_of(new) == state_of(comparison())


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-1", '"0"', "null", "1e999", "true"])
def test_a_number_that_is_none_is_refused(value: str) -> None:
    text = state_of(comparison()).model_dump_json().replace('"reach":0.0', f'"reach":{value}')
    with pytest.raises(ValidationError):
        ComparisonState.model_validate_json(text)
