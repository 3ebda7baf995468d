"""What a browser may say to the view: only what its page says, of the right type, and within limits."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.view.messages import FARTHEST, cleaned, clipped

CONTROLS = {"slider": (-1.5, 2.0), "box": None}
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0.0, 0.0, 0.0], "position": [1.0, 2.0, 3.0], "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0], "fov": 1.0, "near": 0.01, "far": 1000.0, "image_height": 900, "image_width": 1280,
}  # fmt: skip

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8) | st.integers(), inner, max_size=4),
    max_leaves=8,
)


def update(uuid: object, **updates: Any) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}


@pytest.mark.parametrize(
    ("given", "expected"),
    [(0.25, 0.25), (1, 1.0), (-7.0, -1.5), (1e308, 2.0), (-1e308, -1.5), (2**64 - 1, 2.0), (10**400, 2.0), (-(10**400), -1.5)],
)
def test_a_slider_stays_between_its_limits(given: float, expected: float) -> None:
    assert cleaned(update("slider", value=given), CONTROLS) == update("slider", value=expected)
    assert clipped(given, -1.5, 2.0) == expected


@pytest.mark.parametrize(
    "given", [math.nan, math.inf, -math.inf, "1.0", "", b"1", [], [1.0], [[1.0]], {"a": 1.0}, {}, None, True, False, 1j]
)
def test_what_is_no_number_moves_no_slider(given: object) -> None:
    assert cleaned(update("slider", value=given), CONTROLS) is None
    assert clipped(given, -1.5, 2.0) is None


@pytest.mark.parametrize("given", [0, 1, 1.0, "true", None, [], [True], {"value": True}, math.nan])
def test_a_box_is_ticked_or_not(given: object) -> None:
    assert cleaned(update("box", value=given), CONTROLS) is None
    for value in (True, False):
        assert cleaned(update("box", value=value), CONTROLS) == update("box", value=value)


def test_nothing_but_the_value_of_a_control_is_set() -> None:
    message = {**update("slider", value=1.0, min=-1e9, max=1e9, disabled=True, label="x", visible=False), "more": "x" * 1000}
    assert cleaned(message, CONTROLS) == update("slider", value=1.0)
    assert cleaned(update("slider", max=1e9), CONTROLS) is None
    assert cleaned(update("box", _impl=True), CONTROLS) is None


@pytest.mark.parametrize("uuid", ["other", "", None, 0, b"slider", ["slider"], {"slider": 1}])
def test_only_controls_of_the_page_are_moved(uuid: object) -> None:
    assert cleaned(update(uuid, value=1.0), CONTROLS) is None


@pytest.mark.parametrize(
    "message",
    [
        None, 1, "x", b"", [], [update("slider", value=1.0)], {}, {"type": None}, {"type": ["GuiUpdateMessage"]},
        {"type": "ShareUrlRequest"}, {"type": "GuiUpdateMessage"}, {"type": "GuiUpdateMessage", "uuid": "slider"},
        {"type": "GuiUpdateMessage", "uuid": "slider", "updates": [["value", 1.0]]},
        {"type": "GuiUpdateMessage", "uuid": "slider", "updates": None}, {"type": "FileTransferStartUpload", "filename": "x"},
        {"type": "Message"}, {"type": "guiupdatemessage", "uuid": "slider", "updates": {"value": 1.0}},
    ],
)  # fmt: skip
def test_other_messages_are_ignored(message: object) -> None:
    assert cleaned(message, CONTROLS) is None


def test_a_camera_is_where_it_says() -> None:
    assert cleaned(CAMERA, CONTROLS) == CAMERA
    assert cleaned({**CAMERA, "more": [0.0] * 10_000}, CONTROLS) == CAMERA


@pytest.mark.parametrize("name", [name for name in CAMERA if name != "type"])
@pytest.mark.parametrize("value", [None, "1", math.nan, math.inf, [], [0.0] * 5, [[0.0]] * 3, [0.0, 0.0, "0"], True, {}])
def test_a_camera_that_is_nowhere_is_ignored(name: str, value: object) -> None:
    assert cleaned({**CAMERA, name: value}, CONTROLS) is None
    assert cleaned({key: field for key, field in CAMERA.items() if key != name}, CONTROLS) is None


def test_a_camera_is_not_farther_than_a_float_can_bear() -> None:
    message = cleaned(
        {**CAMERA, "position": [1e308, -1e308, 10**400], "fov": 1e300, "image_width": -5, "image_height": 1e300}, {}
    )
    assert message is not None
    assert message["position"] == [FARTHEST, -FARTHEST, FARTHEST]
    assert (message["fov"], message["image_width"], message["image_height"]) == (FARTHEST, 1, FARTHEST)


@given(
    anything
    | st.builds(update, st.sampled_from(["slider", "box", "other"]) | anything, value=anything)
    | st.fixed_dictionaries({name: st.just(value) | anything for name, value in CAMERA.items()})
)
def test_whatever_comes_is_ignored_or_made_typed_and_small(message: object) -> None:
    out = cleaned(message, CONTROLS)
    if out is None:
        return
    if out["type"] == "ViewerCameraMessage":
        assert set(out) == set(CAMERA)
        numbers = [
            x for value in out.values() if not isinstance(value, str) for x in (value if isinstance(value, list) else [value])
        ]
        assert all(type(x) in (int, float) and abs(x) <= FARTHEST for x in numbers)
        return
    value = out["updates"]["value"]
    assert out == update(out["uuid"], value=value)
    assert (type(value) is float and -1.5 <= value <= 2.0) if out["uuid"] == "slider" else type(value) is bool
