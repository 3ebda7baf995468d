"""Turns the results of a run into the report document: sources, frames, published values, verdict, environment."""

from __future__ import annotations

import platform
from datetime import datetime, timezone

from harness import __version__, se3
from harness.description.configurations import Configuration
from harness.description.published import Published
from harness.report import document as doc
from harness.run.results import Results
from harness.verdict.gate import verdict
from harness.verdict.judge import check_claim
from harness.verdict.model_part import side_by_side, trees
from harness.verdict.source_part import assemble_source


def assemble(results: Results) -> doc.Report:
    """The report of a finished run."""
    sources = [assemble_source(results, participant) for participant in results.participants]
    published = [
        _published(results, configuration, claim)
        for configuration in results.model.configurations.fixed
        for claim in configuration.published
    ]
    settings = _settings(results)
    return doc.Report(
        robot=_robot(results),
        settings=settings,
        verdict=verdict(results.model.name, sources, published, settings),
        sources=sources,
        frames=_frames(results),
        unmapped=_unmapped(results),
        trees=trees(results.model),
        parameters=side_by_side(results),
        pairs=_pairs(results),
        published=published,
        lint=_lint(results),
        environment=_environment(results),
    )


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
        gate=results.model.file.gate,
        certify=options.certify,
        not_chosen=[s.name for s in results.model.file.source if s.name not in {p.name for p in results.participants}],
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
                measured_from=results.measured_from.get(frame.name, ""),
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
    found += [
        doc.Lint(code="suspect-number", level="warning", subject=s.where, message=f"{s.where}: {s.why}")
        for s in results.model.suspects
    ]
    return found


def _environment(results: Results) -> doc.Environment:
    versions: dict[str, dict[str, str]] = {}
    for participant in results.participants:
        versions[participant.name] = participant.bound.engine.installed() if participant.bound else {}
    return doc.Environment(
        created=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        duration=results.seconds,
        loading=results.loaded_in,
        waiting_seconds={p.name: p.bound.waited for p in results.participants if p.bound is not None},
        engine_seconds={p.name: p.bound.seconds for p in results.participants if p.bound is not None},
        versions=versions,
        harness=__version__,
        python=platform.python_version(),
        platform=platform.platform(),
    )
