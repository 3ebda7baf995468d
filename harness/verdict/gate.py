"""The gate: from what every source did to one exit code, and a sentence that says why."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from harness.errors import ExitCode
from harness.report import document as doc
from harness.report import results
from harness.report.proof_parts import Theorem
from harness.report.proven import proven_text
from harness.report.regression import Regression
from harness.report.sentences import worsened
from harness.report.tested import all_tested
from harness.report.text import metres, radians
from harness.report.verdicts import Verdict
from harness.se3 import REPEATED

# What hides what, if several apply. A disagreement found stays found. After a fault of the harness nothing else is sure.
_ORDER = (ExitCode.DISAGREES, ExitCode.INTERNAL, ExitCode.WRONG_INPUT, ExitCode.NOT_VERIFIED)


def combined(codes: Iterable[int]) -> int:
    """The exit code of several robots: 1 before all, then 70, 2 and 3. 0 only if every code is 0, whatever their order."""
    places = {int(code): place for place, code in enumerate(_ORDER)}
    above_0 = (code for code in codes if code)
    return int(min(above_0, key=lambda code: (places.get(code, len(places)), code), default=ExitCode.AGREES))


def gate(
    robot: str,
    sources: Sequence[doc.Source],
    published: Sequence[results.PublishedResult],
    settings: doc.Settings,
    theorem: Theorem | None,
) -> doc.GateVerdict:
    """The verdict on a robot. A missing required source never hides a disagreement."""
    wrong, missing = [], []
    for source in sources:
        if source.verdict.disagrees:
            wrong.append(f"{source.name}: {describe(source)}")
        elif source.status != "ran" and source.required:
            install = f" ({source.install})" if source.install else ""
            missing.append(f"{source.name} is required and {source.status}: {source.reason}{install}")
    if misfiled := [claim for claim in published if claim.found != claim.status]:
        wrong.append(_misfiled(misfiled))
    compared = [s for s in sources if s.frames]
    if not compared and not missing and not wrong:
        missing.append("no source was compared: " + "; ".join(f"{s.name} {s.status}" for s in sources))
    if wrong:
        others = [s.name for s in sources if s.verdict.disagrees][1:]
        sentence = f"{robot} DISAGREES: {wrong[0]}" + (f"; likewise {', '.join(others)}" if others else "")
        return doc.GateVerdict(exit_code=1, sentence=sentence, reasons=wrong + missing)
    if missing:
        return doc.GateVerdict(exit_code=3, sentence=f"{robot} IS NOT VERIFIED: {missing[0]}", reasons=missing)
    accepted = sum(f.verdict is Verdict.ACCEPTED for s in sources for f in s.frames)
    count = f"{len(compared)} source{'s' if len(compared) > 1 else ''}"
    sentence = f"{robot} AGREES: {count} within tolerance of the reference at {settings.fixed + settings.samples} configurations"
    if accepted:
        sentence += f", {accepted} deviations as accepted"
    sentence += _proven(compared, theorem)
    sentence += f"; {text}" if (text := all_tested(sources)) else ""
    sentence += _asides(sources, settings)
    return doc.GateVerdict(exit_code=0, sentence=sentence)


def held_to(verdict: doc.GateVerdict, robot: str, moved: Regression | None) -> doc.GateVerdict:
    """The verdict of a strict run: it fails also if anything moved for the worse since the numbers were accepted."""
    if moved is None or not moved.strict or not moved.worse:
        return verdict
    reasons = worsened(moved)
    if verdict.exit_code == 1:
        return doc.GateVerdict(exit_code=1, sentence=verdict.sentence, reasons=[*verdict.reasons, *reasons])
    sentence = f"{robot} MOVED since it was accepted: {reasons[0]}"
    return doc.GateVerdict(exit_code=1, sentence=sentence, reasons=[*reasons, *verdict.reasons])


def _asides(sources: Sequence[doc.Source], settings: doc.Settings) -> str:
    """What was not compared, so that nobody takes it for agreement."""
    text = ""
    for status in ("not run", "failed"):
        if names := [s.name for s in sources if s.status == status and not s.required]:
            text += f"; {status}: {', '.join(names)}"
    for source in sources:
        if source.required and source.status == "ran" and source.absent:
            text += f"; {source.name} was compared without {', '.join(source.absent)}"
    return f"{text}; not chosen: {', '.join(settings.not_chosen)}" if settings.not_chosen else text


def _proven(compared: list[doc.Source], theorem: Theorem | None) -> str:
    """What is proven of the two descriptions; accepted deviations speak for themselves."""
    if theorem is None:
        return ""
    aside = {f.frame for s in compared for f in s.frames if f.verdict is Verdict.ACCEPTED}
    text = proven_text(theorem, [bound.frame for bound in theorem.frames if bound.frame not in aside])
    return f"; {text}{' (accepted deviations aside)' if aside else ''}" if text else ""


def _misfiled(claims: list[results.PublishedResult]) -> str:
    first, more = claims[0], len(claims) - 1
    rotation = "" if first.rotation_error is None else f", {first.rotation_error:.2g} in the rotation"
    return (
        f"published placement of DH frame {first.frame} in {first.relative_to} at {first.configuration!r} is filed as "
        f"{first.status!r} and was found {first.found!r}: off by {metres(first.position_error)}{rotation}"
        + (f" (and {more} more like it)" if more else "")
    )


def _by_test(source: doc.Source) -> str:
    """What was seen only where the source was tested against its own description; empty if the comparison shows it too."""
    compared = {
        Verdict.INVALID_PLACEMENTS: source.validity is not None and source.validity.first is not None,
        Verdict.KEEPS_STATE: source.validity is not None and source.validity.again > REPEATED,
    }.get(source.verdict, any(not f.passes for f in source.frames))
    return "" if source.tested is None or compared else source.tested.problem


def describe(source: doc.Source) -> str:
    """Where and by how much a source is off, in one clause."""
    if by_test := _by_test(source):
        return by_test
    if source.verdict is Verdict.INVALID_PLACEMENTS and source.validity is not None and source.validity.first is not None:
        v = source.validity
        return (
            f"{v.invalid} of {v.checked} placements are not rigid transforms (residual {v.residual:.2g}), "
            f"first {v.first_frame} at {v.first.label if v.first else ''}"
        )
    if source.verdict is Verdict.KEEPS_STATE and source.validity is not None and source.validity.again_at is not None:
        v, at = source.validity, source.validity.again_at
        return f"its answer for {at.label} changed by {v.again:.2g} when asked again: it depends on what was asked before"
    worst = source.worst
    failing = [f for f in source.frames if not f.passes]
    if worst.passes:
        worst = failing[0]
    if worst.verdict is Verdict.NOT_CERTIFIED:
        why = source.certificate.reason if source.certificate else "no certificate was made"
        bound = next((b for b in source.certificate.frames if b.frame == worst.frame), None) if source.certificate else None
        if bound is not None:
            apart = f"{metres(bound.position_upper)}, {radians(bound.rotation_upper)}"
            why = f"of the table and the URDF no less than {apart} can be proven for every configuration"
        return f"{worst.frame} is within tolerance where it was sampled, but {why}"
    if worst.verdict is Verdict.NOT_COMPARED:
        return f"frame {worst.frame} was not compared: the engine does not have it or returned nothing finite"
    sizes = (
        (metres(worst.position.max), worst.position.max > source.tolerance.position),
        (radians(worst.rotation.max), worst.rotation.max > source.tolerance.rotation),
    )
    by = f"{worst.frame} off by {', '.join(text for text, over in sizes if over) or ', '.join(text for text, _ in sizes)}"
    if worst.verdict in (Verdict.DEVIATION_CHANGED, Verdict.DEVIATION_VANISHED) and worst.accepted:
        by += f"; the {worst.verdict} from the accepted {worst.accepted.position:g} m, {worst.accepted.rotation:g} rad"
    where = (
        worst.position.worst
        if worst.position.max / source.tolerance.position >= (worst.rotation.max / source.tolerance.rotation)
        else worst.rotation.worst
    )
    first = f"; first frame that disagrees: {source.first_disagreeing_frame}" if failing[0].frame != worst.frame else ""
    cause = source.explanation.changes if source.explanation else []
    because = f"; because {' and '.join(change.text for change in cause)}" if cause else ""
    return f"{by} at {where.label if where else '?'}{first}{because}"
