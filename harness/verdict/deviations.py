"""Deviations that model.toml accepts: which one is on file for a source and a frame, and which numbers explain it."""

from __future__ import annotations

from harness.description.model import RobotModel
from harness.verdict.judge import Deviation


def deviation_on_file(model: RobotModel, source: str, reference: str, frame: str) -> tuple[Deviation, str] | None:
    """The accepted deviation of `source` from `reference` at `frame`, and its reason.

    On file it is against the in-house FK. Another reference brings its own: two sources with the same one agree.
    """

    def on_file(name: str) -> tuple[Deviation, str] | None:
        for entry in model.file.accepted:
            if entry.covers(name) and frame in entry.frames:
                return Deviation(entry.position, entry.rotation, entry.within), entry.reason
        return None

    own, theirs = on_file(source), on_file(reference)
    if theirs is None or own is None:
        return own or theirs
    return None


def cause_on_file(model: RobotModel, source: str, reference: str) -> dict[tuple[str, str], float]:
    """Which numbers explain the accepted deviations of a source, {(joint, parameter): change [m or rad]}; empty if none do."""
    entries = [e for e in model.file.accepted if e.covers(source) != e.covers(reference)]
    return {(joint, name): size for e in entries for joint, part in e.cause.items() for name, size in part.items()}
