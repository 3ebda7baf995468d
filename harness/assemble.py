"""Turns the results of a run into the report document: sources, frames, published values, verdict, environment."""

from __future__ import annotations

import platform
from datetime import datetime, timezone

from harness import __version__, se3
from harness.analysis.verdict import check_claim
from harness.assemble_source import assemble_source
from harness.description.configurations import Configuration
from harness.description.published import Published
from harness.engines.registry import adapter_of
from harness.errors import CrosscheckError
from harness.report import document as doc
from harness.report.text import metres, radians
from harness.results import Results


def assemble(results: Results) -> doc.Report:
    """The report of a finished run."""
    sources = [assemble_source(results, participant) for participant in results.participants]
    published = [
        _published(results, configuration, claim)
        for configuration in results.model.configurations.fixed
        for claim in configuration.published
    ]
    return doc.Report(
        robot=_robot(results),
        settings=_settings(results),
        verdict=verdict(results.model.name, sources, published, total=_settings(results).fixed + results.options.samples),
        sources=sources,
        frames=_frames(results),
        unmapped=_unmapped(results),
        pairs=_pairs(results),
        published=published,
        lint=_lint(results),
        environment=_environment(results),
    )


def verdict(robot: str, sources: list[doc.Source], published: list[doc.PublishedResult], total: int) -> doc.Verdict:
    """The gate. A disagreement found (1) stays found even if a required source is missing (3)."""
    wrong, missing = [], []
    for source in sources:
        if source.verdict in ("disagrees", "invalid placements"):
            wrong.append(f"{source.name}: {describe(source)}")
        elif source.status != "ran" and source.required:
            install = f" ({source.install})" if source.install else ""
            missing.append(f"{source.name} is required and {source.status}: {source.reason}{install}")
    for claim in published:
        if claim.found != claim.status:
            wrong.append(
                f"published placement of DH frame {claim.frame} at {claim.configuration!r} is filed as {claim.status!r} "
                f"and was found {claim.found!r}, off by {claim.position_error:.3g} m ({claim.provenance})"
            )
    compared = [s for s in sources if s.frames]
    if not compared and not missing and not wrong:
        missing.append("no source was compared: " + "; ".join(f"{s.name} {s.status}" for s in sources))
    skipped = [s.name for s in sources if s.status != "ran" and not s.required]
    if wrong:
        sentence = f"{robot} DISAGREES: {wrong[0]}"
        return doc.Verdict(exit_code=1, sentence=sentence, reasons=wrong + missing)
    if missing:
        return doc.Verdict(exit_code=3, sentence=f"{robot} IS NOT VERIFIED: {missing[0]}", reasons=missing)
    accepted = sum(f.verdict == "accepted" for s in sources for f in s.frames)
    sentence = f"{robot} AGREES: {len(compared)} sources within tolerance of the reference at {total} configurations"
    if accepted:
        sentence += f", {accepted} deviations as accepted"
    if skipped:
        sentence += f"; not run: {', '.join(skipped)}"
    return doc.Verdict(exit_code=0, sentence=sentence)


def describe(source: doc.Source) -> str:
    """Where and by how much a source is off, in one clause."""
    if source.verdict == "invalid placements" and source.validity is not None and source.validity.first is not None:
        v = source.validity
        return (
            f"{v.invalid} of {v.checked} placements are not rigid transforms (residual {v.residual:.2g}), "
            f"first {v.first_frame} at {v.first.label if v.first else ''}"
        )
    worst = next(f for f in source.frames if f.frame == source.worst_frame)
    failing = [f for f in source.frames if f.verdict not in ("agrees", "accepted")]
    if worst.verdict in ("agrees", "accepted"):
        worst = failing[0]
    if worst.verdict == "not compared":
        return f"frame {worst.frame} was not compared: the engine does not have it or returned nothing finite"
    by = f"{worst.frame} off by {metres(worst.position.max)}, {radians(worst.rotation.max)}"
    if worst.verdict.startswith("deviation") and worst.accepted:
        by += f"; the {worst.verdict} from the accepted {worst.accepted.position:g} m, {worst.accepted.rotation:g} rad"
    where = (
        worst.position.worst
        if worst.position.max / source.tolerance.position >= (worst.rotation.max / source.tolerance.rotation)
        else worst.rotation.worst
    )
    first = f"; first frame that disagrees: {source.first_disagreeing_frame}" if failing[0].frame != worst.frame else ""
    return f"{by} at {where.label if where else '?'}{first}"


def _robot(results: Results) -> doc.Robot:
    model = results.model
    provenance = {k: v for k, v in model.file.provenance.model_dump().items() if v}
    return doc.Robot(
        name=model.name,
        description=model.file.description,
        convention=model.table.convention,
        provenance=provenance,
        base=model.frames.base.name,
        joints=list(model.table.joints),
        lower=model.configurations.lower.tolist(),
        upper=model.configurations.upper.tolist(),
        reach=results.comparison.reach if results.comparison else 0.0,
        hashes=dict(model.hashes),
    )


def _settings(results: Results) -> doc.Settings:
    options = results.options
    fixed = len(results.model.configurations.fixed)
    return doc.Settings(
        reference=results.participants[0].name,
        sources=[p.name for p in results.participants],
        selection="command line" if options.sources else "model",
        fixed=fixed,
        samples=options.samples,
        seed=options.seed,
        subset=results.comparison.subset if results.comparison else 0,
        command=options.command,
    )


def _frames(results: Results) -> list[doc.Frame]:
    frames = []
    for frame in results.model.frames.frames:
        offset = results.offsets.get(frame.name) if frame.offset is None else frame.offset
        frames.append(
            doc.Frame(
                name=frame.name,
                dh=frame.dh,
                urdf=frame.urdf,
                relation=frame.relation,
                of=frame.of,
                offset=None if offset is None else offset.tolist(),
                measured_from=results.measured_from if frame.relation == "rigid" else "",
            )
        )
    return frames


def _unmapped(results: Results) -> list[str]:
    labels, links = results.model.unmapped()
    return [f"DH frame {label}" for label in labels] + [f"link {link}" for link in links]


def _pairs(results: Results) -> list[doc.PairResult]:
    if results.comparison is None:
        return []
    names = [frame.name for frame in results.model.frames.frames]
    return [
        doc.PairResult(
            a=a,
            b=b,
            position=pair.position,
            position_frame=names[pair.position_frame],
            rotation=pair.rotation,
            rotation_frame=names[pair.rotation_frame],
        )
        for (a, b), pair in results.comparison.pairs.items()
    ]


def _published(results: Results, configuration: Configuration, claim: Published) -> doc.PublishedResult:
    """Check a claim against the in-house FK, whatever the reference of the run is."""
    if results.in_house is None:
        raise RuntimeError("published placements need the in-house FK")
    T_base_a, T_base_b = results.in_house.engine.placements(configuration.q[None, :], (claim.relative_to, claim.dh))[0]
    T_a_b = se3.inverse(T_base_a) @ T_base_b
    check = check_claim(claim, T_a_b)
    return doc.PublishedResult(
        configuration=configuration.name,
        frame=claim.dh,
        relative_to=claim.relative_to,
        provenance=claim.provenance,
        status=claim.status,
        found=check.found,
        reason=claim.reason,
        claimed_position=claim.position.tolist(),
        claimed_rotation=None if claim.rotation is None else claim.rotation.tolist(),
        computed=T_a_b.tolist(),
        computed_rpy=list(se3.to_rpy(T_a_b)),
        tolerance=claim.tolerance,
        rotation_tolerance=claim.rotation_tolerance,
        position_error=check.position_error,
        rotation_error=check.rotation_error,
    )


def _lint(results: Results) -> list[doc.Lint]:
    found = [
        doc.Lint(code=f.code, level=f.level, subject=f.subject, message=f"URDF line {f.line}: {f.message}")
        for f in results.model.findings
    ]
    found += [doc.Lint(code="suspect-number", level="warning", subject=s.where, message=s.why) for s in results.model.suspects]
    return found


def _environment(results: Results) -> doc.Environment:
    versions: dict[str, dict[str, str]] = {}
    for participant in results.participants:
        try:
            versions[participant.name] = adapter_of(participant.name).versions()
        except CrosscheckError:  # a broken adapter: no version to tell
            versions[participant.name] = {}
    return doc.Environment(
        created=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        duration=results.seconds,
        engine_seconds={p.name: p.bound.seconds for p in results.participants if p.bound is not None},
        versions=versions,
        harness=__version__,
        python=platform.python_version(),
        platform=platform.platform(),
    )
