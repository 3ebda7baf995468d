"""What is proven of the two descriptions, as sentences; shared by every format."""

from __future__ import annotations

from collections.abc import Collection

from harness.report.document import Source
from harness.report.proof_parts import FrameBound, Theorem
from harness.report.text import metres, radians


def proven_text(theorem: Theorem, frames: Collection[str]) -> str:
    """`the table and the URDF differ by at most 1.2e-11 m, 8.2e-11 rad at every configuration (proven)`; empty for no frames.

    frames: names of those that count.
    """
    bounds = [bound for bound in theorem.frames if bound.frame in frames]
    if not bounds:
        return ""
    words = {theorem.equality[bound.frame] for bound in bounds}
    position, rotation = _largest(bounds)
    where = f"at every configuration{_slides(theorem)} (proven)"
    if words == {"equal"}:
        return "the table and the URDF are equal at every configuration (proven)"
    apart = f"the table and the URDF differ by at most {metres(position)}, {radians(rotation)} {where}"
    return f"{apart}, by the digits of pi alone" if words <= {"equal", "equal but for the digits of pi"} else apart


def at_most(theorem: Theorem) -> str:
    """`table and URDF at most 1.2e-11 m, 8.2e-11 rad apart`, at any frame; or that they are equal."""
    if theorem.is_equal:
        return "table and URDF are equal"
    position, rotation = _largest(theorem.frames)
    return f"table and URDF at most {metres(position)}, {radians(rotation)} apart"


def _largest(bounds: Collection[FrameBound]) -> tuple[float, float]:
    """The largest of some bounds: position [m], rotation [rad]."""
    return max(b.position_upper for b in bounds), max(b.rotation_upper for b in bounds)


def _slides(theorem: Theorem) -> str:
    ranges = [f"{joint} from {r.lower:g} to {r.upper:g} {r.unit}" for joint, r in theorem.slides.items()]
    return f" with {', '.join(ranges)}" if ranges else ""


def for_all(source: Source) -> str:
    """What is proven of the files that a source and the reference read, at the frame where it is largest.

    `<= 1.6e-11 m`; `equal`; `not claimed`, if the source was seen to compute something else.
    """
    if source.certificate is None:
        return ""
    if source.certificate.status == "refused":
        return "not claimed"
    position, rotation = _largest(source.certificate.frames)
    return f"<= {metres(position)}" if position or rotation else "equal"
