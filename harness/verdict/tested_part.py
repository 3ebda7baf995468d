"""Each source against its own description: whether what was seen speaks against it, and the report entry."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from harness.report import tested_parts as parts
from harness.report.tested_parts import DESCRIPTIONS
from harness.report.text import metres, numbers, radians
from harness.report.verdicts import FrameVerdict, Verdict
from harness.run.outcome import Outcome, Run
from harness.run.probes import AGAIN, COMPARED, FAR, FULL, GRID, SINGLE, SPECIAL, STEPS
from harness.run.tested import FrameTested, Place, Repeated, Size, Tested
from harness.verdict.judge import OwnVerdict

HOW = {
    COMPARED: "at the configurations compared",
    FULL: "in a full block",
    SINGLE: "for one configuration at a time",
    STEPS: "in small steps",
    AGAIN: "for one configuration again, coming from elsewhere",
    SPECIAL: "at right angles and beside them",
    GRID: "on a grid of angles",
    FAR: "many turns away",
}


def judge_tested(run: Run, outcome: Outcome, frames: Mapping[str, FrameVerdict], misreads: bool) -> OwnVerdict | None:
    """What the test of a source against its own description says against it; None if nothing.

    frames: its verdict at each mapped frame that was compared, by name.
    misreads: whether a trait of the engine matters with this URDF.
    """
    tested = outcome.tested
    if tested is None:
        return None
    if tested.invalid:
        return Verdict.INVALID_PLACEMENTS
    if tested.keeps_state:
        return Verdict.KEEPS_STATE
    return Verdict.DISAGREES if _caught(run, outcome, frames, misreads) else None


def _caught(run: Run, outcome: Outcome, frames: Mapping[str, FrameVerdict], misreads: bool) -> Place | None:
    """The difference that counts, the largest in parts of the tolerance; None if there is none.

    A frame at which the source differs from its description already where the comparison has looked is judged by the
    comparison, if its verdict there is another than agreement, or if the engine is known to read such a URDF otherwise.
    """
    tested, tolerance = outcome.tested, _tolerance(outcome)
    best: tuple[float, Place | None] = (1.0, None)
    for frame in tested.frames if tested else ():
        known = misreads or frames.get(_name(run, frame), Verdict.AGREES) is not Verdict.AGREES
        if known and _ratio(frame.compared, tolerance) > 1.0:
            continue
        for size, limit, place in (
            (frame.position, tolerance[0], frame.position_at),
            (frame.rotation, tolerance[1], frame.rotation_at),
        ):
            if size / limit > best[0]:
                best = size / limit, place
    return best[1]


def _tolerance(outcome: Outcome) -> Size:
    """That of the source against the in-house FK: what it may be off its own description."""
    return outcome.planned.tolerance.position, outcome.planned.tolerance.rotation


def _ratio(size: Size, tolerance: Size) -> float:
    return max(x / limit for x, limit in zip(size, tolerance, strict=True))


def _name(run: Run, at: FrameTested | Place | Repeated) -> str:
    return run.model.frames.frames[at.frame].name


def tested_part(run: Run, outcome: Outcome, frames: Mapping[str, FrameVerdict], misreads: bool) -> parts.Tested | None:
    """The report entry; see `judge_tested` for `frames` and `misreads`. None if the source was not tested."""
    tested = outcome.tested
    if tested is None:
        return None
    caught = _caught(run, outcome, frames, misreads)
    return parts.Tested(
        description=tested.description,
        reason=tested.reason,
        configurations=tested.configurations,
        answers=tested.answers,
        calls=tested.calls,
        turns=tested.turns,
        kinds=[
            parts.TestedKind(name=k.name, count=k.count, calls=k.calls, position=k.position, rotation=k.rotation)
            for k in tested.kinds
        ],
        limit=tested.limit,
        ignored_step=tested.ignored_step,
        position=tested.position,
        rotation=tested.rotation,
        worst=_at(run, tested.worst),
        caught=_at(run, caught),
        beyond=_at(run, tested.beyond),
        again=_twice(run, tested.again),
        invalid=tested.invalid,
        invalid_at=_at(run, tested.invalid_at),
        refused=tested.refused,
        problem=_problem(run, tested, caught),
    )


def _at(run: Run, place: Place | None) -> parts.TestedAt | None:
    if place is None:
        return None
    revolute = np.array(run.model.configurations.revolute, dtype=bool)
    turns = float(np.abs(place.q[revolute]).max(initial=0.0)) / (2.0 * math.pi)
    position, rotation = place.off
    return parts.TestedAt(
        kind=place.kind, q=place.q.tolist(), frame=_name(run, place), turns=turns, position=position, rotation=rotation
    )


def _twice(run: Run, again: Repeated | None) -> parts.TestedTwice | None:
    if again is None:
        return None
    first, second = (None, None) if again.off is None else (again.off[0][0], again.off[1][0])
    return parts.TestedTwice(
        change=again.change,
        allowed=again.allowed,
        q=again.q.tolist(),
        frame=_name(run, again),
        first=again.ways[0],
        second=again.ways[1],
        first_off=first,
        second_off=second,
    )


def _problem(run: Run, tested: Tested, caught: Place | None) -> str:
    """What speaks against the source, in one clause; empty if nothing does."""
    if tested.invalid and (at := tested.invalid_at):
        where = f"{_name(run, at)}, asked {HOW[at.kind]}, at q = {numbers(at.q)}"
        return f"{tested.invalid} of its placements are not finite, first {where}"
    if tested.keeps_state and (again := tested.again):
        return f"{_change(run, again)}: its answers depend on what is asked before or beside them"
    if caught is not None:
        off = _size(caught.off, 0.0)
        return f"asked {HOW[caught.kind]}, it has {_name(run, caught)} {off} from where {DESCRIPTIONS[tested.description]} has it"
    return ""


def _change(run: Run, again: Repeated) -> str:
    if again.off is None:
        return f"its answer for one configuration changed by {again.change:.2g}, asked {again.ways[0]} and {again.ways[1]}"
    first, second = (_size(off, again.allowed) for off in again.off)
    return f"asked {again.ways[0]}, it has {_name(run, again)} {first}; the same configuration {again.ways[1]}: {second}"


def _size(off: Size, allowed: float) -> str:
    """`right`, or how far off."""
    if max(off) <= allowed:
        return "right"
    sizes = [text for x, text in ((off[0], metres(off[0])), (off[1], radians(off[1]))) if x > allowed]
    return f"{' and '.join(sizes)} off" if allowed else " and ".join(sizes)
