"""JUnit XML: one case per source and frame, one per published placement, so that a CI server lists what failed."""

from __future__ import annotations

from collections.abc import Iterator

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from harness.errors import shortened
from harness.report.document import Report, Source
from harness.report.regression import Regression
from harness.report.results import PublishedResult
from harness.report.sentences import why, worsened
from harness.report.source_parts import FrameResult
from harness.report.tested_parts import Tested
from harness.report.text import metres, numbers, pasteable, plain, radians
from harness.report.verdicts import Verdict

LONGEST = 4000  # letters of what all failing frames of a source say


def render_junit(report: Report) -> str:
    """The report as JUnit XML text."""
    suite = TestSuite(plain(report.robot.name))
    suite.add_testcases(list(_cases(report)))  # all at once: each addition counts them anew
    xml = JUnitXml()
    xml.add_testsuite(suite)
    xml.update_statistics()  # type: ignore[no-untyped-call]
    return bytes(xml.tostring()).decode()  # type: ignore[no-untyped-call]


def _cases(report: Report) -> Iterator[TestCase]:
    for source in report.sources:
        if source.reference and source.passes:
            continue
        if source.status != "ran":
            yield _not_run(report, source)
        cause = _cause(report, source)
        for frame in source.frames:
            yield _frame(report, source, frame, cause)
        if source.verdict in (Verdict.INVALID_PLACEMENTS, Verdict.KEEPS_STATE):
            yield _invalid(report, source)
        elif source.tested and source.tested.problem:
            yield _own_description(report, source, source.tested)
    for claim in report.published:
        yield _published(report, claim)
    if report.regression is not None and report.regression.strict:
        yield _regression(report, report.regression)


def _case(report: Report, name: str, group: str) -> TestCase:
    return TestCase(plain(name), classname=plain(f"{report.robot.name}.{group}"))


def _not_run(report: Report, source: Source) -> TestCase:
    case = _case(report, source.status, source.name)
    message = plain(f"{source.status}: {source.reason} {source.install}".strip())
    case.result = [Error(message) if source.required else Skipped(message)]
    return case


def _cause(report: Report, source: Source) -> str:
    """What every failing frame of a source says of it: a reproducer, why, the command. Cut short, as it stands there so often."""
    lines = []
    if source.reproducer:
        r = source.reproducer
        lines.append(f"smallest reproducer, frame {r.frame}: q = {numbers(r.q, 17)}, {metres(r.position)}, {radians(r.rotation)}")
    lines += [f"why: {text.strip()}" for text in why(source)]
    lines.append(pasteable(report.settings.command))
    return shortened("\n".join(plain(line) for line in lines), LONGEST)


def _frame(report: Report, source: Source, frame: FrameResult, cause: str) -> TestCase:
    case = _case(report, frame.frame, source.name)
    if frame.passes:
        return case
    failure = Failure(
        plain(f"{frame.verdict}: {metres(frame.position.max)}, {radians(frame.rotation.max)} from {report.settings.reference}")
    )
    lines = [f"tolerance {metres(source.tolerance.position)}, {radians(source.tolerance.rotation)}"]
    if frame.position.worst:
        lines.append(f"worst position at {frame.position.worst.label}: q = {numbers(frame.position.worst.q, 17)}")
    failure.text = "\n".join([*map(plain, lines), cause])
    case.result = [failure]
    return case


def _invalid(report: Report, source: Source) -> TestCase:
    case = _case(report, "placements are rigid transforms that depend on q alone", source.name)
    if source.validity:
        v = source.validity
        again = f"; asked again, one changed by {v.again:.2g}"
        problem = f"; {source.tested.problem}" if source.tested and source.tested.problem else ""
        case.result = [Failure(plain(f"{v.invalid} of {v.checked} are no rigid transforms{again}{problem}"))]
    return case


def _own_description(report: Report, source: Source, tested: Tested) -> TestCase:
    """A source that was seen to compute something else than its description says."""
    case = _case(report, "computes what its description says", source.name)
    failure = Failure(plain(tested.problem))
    lines = [f"{tested.configurations} configurations in {tested.calls} calls"]
    lines += [f"at q = {numbers(tested.caught.q, 17)}"] if tested.caught else []
    failure.text = "\n".join(plain(line) for line in [*lines, pasteable(report.settings.command)])
    case.result = [failure]
    return case


def _regression(report: Report, regression: Regression) -> TestCase:
    """A strict run's own case: nothing grew since it was accepted."""
    case = _case(report, f"nothing grew since {regression.accepted}", "regression")
    if lines := worsened(regression):
        failure = Failure(plain(lines[0]))
        failure.text = "\n".join(plain(line) for line in [*lines, pasteable(report.settings.command)])
        case.result = [failure]
    return case


def _published(report: Report, claim: PublishedResult) -> TestCase:
    case = _case(report, f"{claim.configuration}: DH frame {claim.frame} in {claim.relative_to}", "published")
    if claim.found != claim.status:
        case.result = [Failure(plain(f"filed as {claim.status}, found {claim.found}: off by {claim.position_error:.3g} m"))]
    return case
