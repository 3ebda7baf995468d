"""Turns the results of a run into the report document: sources, frames, published values, verdict, environment."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from datetime import datetime, timezone

from harness import se3
from harness.description.configurations import Configuration
from harness.description.published import Published
from harness.engines.lint_traits import messages
from harness.report import document as doc
from harness.report import results
from harness.report.proof_parts import Theorem
from harness.run.outcome import Run
from harness.verdict.accepted import AcceptedNumbers, since
from harness.verdict.evidence import theorem
from harness.verdict.gate import gate, held_to
from harness.verdict.judge import check_claim
from harness.verdict.model_part import side_by_side, trees
from harness.verdict.source_part import assemble_source
from harness.version import __version__


@dataclass(frozen=True, kw_only=True)
class _Judged:
    """A report but for what moved since its numbers were accepted, and the final verdict."""

    robot: doc.Robot
    settings: doc.Settings
    sources: list[doc.Source]
    published: list[results.PublishedResult]
    theorem: Theorem | None
    verdict: doc.GateVerdict


def assemble(run: Run, accepted: AcceptedNumbers | None = None) -> doc.Report:
    """The report of a finished run; accepted: the numbers on file, if it is to say what moved since."""
    judged = _judged(run)
    regression = None if accepted is None else since(accepted, judged, run.options.strict)
    return doc.Report(
        robot=judged.robot,
        settings=judged.settings,
        verdict=held_to(judged.verdict, run.model.name, regression),
        sources=judged.sources,
        frames=_frames(run),
        unmapped=_unmapped(run),
        trees=trees(run.model),
        parameters=side_by_side(run),
        pairs=_pairs(run),
        published=judged.published,
        theorem=judged.theorem,
        lint=_lint(run),
        regression=regression,
        environment=_environment(run),
    )


def _judged(run: Run) -> _Judged:
    sources = [assemble_source(run, outcome) for outcome in run.outcomes]
    published = [
        _published(run, configuration, claim)
        for configuration in run.model.configurations.fixed
        for claim in configuration.published
    ]
    settings = _settings(run)
    proven = theorem(run)
    verdict = gate(run.model.name, sources, published, settings, proven)
    return _Judged(robot=_robot(run), settings=settings, sources=sources, published=published, theorem=proven, verdict=verdict)


def _robot(run: Run) -> doc.Robot:
    model = run.model
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
        reach=run.comparison.reach if run.comparison else 0.0,
        hashes=dict(model.hashes),
    )


def _settings(run: Run) -> doc.Settings:
    options = run.options
    fixed = len(run.model.configurations.fixed)
    return doc.Settings(
        reference=run.reference.name,
        sources=[p.name for p in run.outcomes],
        gate=run.model.file.gate,
        certify=options.certify,
        not_chosen=[s.name for s in run.model.file.source if s.name not in {p.name for p in run.outcomes}],
        fixed=fixed,
        samples=options.samples,
        seed=options.seed,
        probe_seed=options.probe_seed,
        subset=run.comparison.subset if run.comparison else 0,
        command=options.command,
    )


def _frames(run: Run) -> list[doc.Frame]:
    frames = []
    for frame in run.model.frames.frames:
        measured = run.offsets.get(frame.name)
        offset = (measured.T_dh_frame if measured else None) if frame.offset is None else frame.offset
        frames.append(
            doc.Frame(
                name=frame.name,
                dh=frame.dh,
                urdf=frame.urdf,
                relation=frame.relation,
                of=frame.of,
                offset=None if offset is None else offset.tolist(),
                measured_from=measured.measured_from if measured else "",
            )
        )
    return frames


def _unmapped(run: Run) -> list[str]:
    labels, links = run.model.unmapped()
    return [f"DH frame {label}" for label in labels] + [f"link {link}" for link in links]


def _pairs(run: Run) -> list[results.PairResult]:
    if run.comparison is None:
        return []
    names = [frame.name for frame in run.model.frames.frames]
    return [
        results.PairResult(
            a=a,
            b=b,
            position=pair.position,
            position_frame=names[pair.position_frame],
            rotation=pair.rotation,
            rotation_frame=names[pair.rotation_frame],
        )
        for (a, b), pair in run.comparison.pairs.items()
    ]


def _published(run: Run, configuration: Configuration, claim: Published) -> results.PublishedResult:
    """Check a claim against the in-house FK, whatever the reference of the run is."""
    T_base_a, T_base_b = run.in_house.engine.placements(configuration.q[None, :], (claim.relative_to, claim.dh))[0]
    T_a_b = se3.inverse(T_base_a) @ T_base_b
    check = check_claim(claim, T_a_b)
    return results.PublishedResult(
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


def _lint(run: Run) -> list[results.Lint]:
    found = [
        results.Lint(code=f.code, level=f.level, subject=f.subject, message=f"URDF line {f.line}: {message}")
        for f, message in zip(run.model.findings, messages(run.model.findings), strict=True)
    ]
    found += [
        results.Lint(code="suspect-number", level="warning", subject=s.where, message=f"{s.where}: {s.why}")
        for s in run.model.suspects
    ]
    return found


def _environment(run: Run) -> doc.Environment:
    versions: dict[str, dict[str, str]] = {}
    for outcome in run.outcomes:
        versions[outcome.name] = outcome.bound.engine.installed() if outcome.bound else {}
    return doc.Environment(
        created=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        duration=run.seconds,
        loading=run.loaded_in,
        waiting_seconds={p.name: p.bound.waited for p in run.outcomes if p.bound is not None},
        engine_seconds={p.name: p.bound.seconds for p in run.outcomes if p.bound is not None},
        versions=versions,
        harness=__version__,
        python=platform.python_version(),
        platform=platform.platform(),
    )
