"""A robot that an engine's library ships itself, named in its own way."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Packaged:
    """The library's own model `robot`; `joints` are the names its joints go by here, in order from the base."""

    robot: str
    joints: tuple[str, ...]
