"""What a browser may say to the view: where its camera is, and that a slider, a box or a button of the page was used.

Everything else that viser would take is ignored, such as a file sent to it or the wish to be shared with the world.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

LARGEST = 64 * 1024  # bytes of a message; those of the page have a few hundred
FARTHEST = 1e6  # of a camera [m], and of its other numbers

Range = tuple[float, float]
Controls = Mapping[str, Range | None]

# Fields of a camera message; of the first ones, how many numbers they hold.
_CAMERA_VECTORS = {"wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3}
_CAMERA_NUMBERS = ("fov", "near", "far")
_CAMERA_PIXELS = ("image_height", "image_width")


def cleaned(message: object, controls: Controls) -> dict[str, Any] | None:
    """The message with nothing in it but what the page says, numbers clipped; None if it is to be ignored.

    Args:
        message: as it was decoded, of any type.
        controls: by identifier, the limits of a slider [rad or m], or None for a box or a button.
    """
    if not isinstance(message, dict):
        return None
    if message.get("type") == "ViewerCameraMessage":
        return _camera(message)
    if message.get("type") == "GuiUpdateMessage":
        return _update(message, controls)
    return None


def _update(message: dict[Any, Any], controls: Controls) -> dict[str, Any] | None:
    """One control was used. Its value alone is taken: viser would set any other property as well."""
    uuid, updates = message.get("uuid"), message.get("updates")
    if not isinstance(uuid, str) or uuid not in controls or not isinstance(updates, dict):
        return None
    given, limits = updates.get("value"), controls[uuid]
    value = clipped(given, *limits) if limits else given if isinstance(given, bool) else None
    return None if value is None else {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}


def clipped(value: object, low: float, high: float) -> float | None:
    """A finite number, moved to the nearest between low and high; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if isinstance(value, float) and not math.isfinite(value):  # an integer may be too long to be asked
        return None
    return float(min(max(value, low), high))


def _camera(message: dict[Any, Any]) -> dict[str, Any] | None:
    """The camera was moved. It is taken whole or not at all."""
    camera: dict[str, Any] = {"type": "ViewerCameraMessage"}
    for name, count in _CAMERA_VECTORS.items():
        given = message.get(name)
        if not isinstance(given, list) or len(given) != count:
            return None
        camera[name] = [clipped(value, -FARTHEST, FARTHEST) for value in given]
        if None in camera[name]:
            return None
    for name in (*_CAMERA_NUMBERS, *_CAMERA_PIXELS):
        camera[name] = clipped(message.get(name), 1.0 if name in _CAMERA_PIXELS else -FARTHEST, FARTHEST)
        if camera[name] is None:
            return None
    return camera | {name: int(camera[name]) for name in _CAMERA_PIXELS}
