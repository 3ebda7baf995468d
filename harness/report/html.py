"""The report as one self-contained HTML file: no script, no network, everything from an input escaped."""

from __future__ import annotations

import math
from collections.abc import Sequence

from jinja2 import Environment, PackageLoader, StrictUndefined

from harness.report.document import PairResult, Report, Source, Statistics
from harness.report.text import for_all, metres, numbers, plain, radians

# ColorBrewer YlOrBr: light to dark, told apart by the colour-blind, always with the number beside it.
_SCALE = ("#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506")


def _environment() -> Environment:
    env = Environment(
        loader=PackageLoader("harness.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: type(value)(plain(value)) if isinstance(value, str) else value,
    )
    env.filters.update(metres=metres, radians=radians, numbers=numbers, colour=colour, bars=bars, for_all=for_all)
    env.tests["failing"] = lambda verdict: verdict not in ("agrees", "agrees as accepted", "accepted", "reference")
    return env


def render_html(report: Report) -> str:
    """One robot's report."""
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            report=report,
            matrix=_matrix(report),
            frames=[frame.name for frame in report.frames],
            by_frame={s.name: {f.frame: f for f in s.frames} for s in report.sources},
            disagreeing=[s for s in report.sources if s.reproducer],
        )
    )


def render_index(reports: Sequence[Report]) -> str:
    """The list of all robots."""
    return _environment().get_template("index.html.j2").render(reports=reports)


def colour(value: float, low: float = -16.0, high: float = -1.0) -> str:
    """Inline style of a matrix cell: background by the power of ten, text dark or light to match."""
    exponent = math.log10(value) if value > 0 else low
    step = round((exponent - low) / (high - low) * (len(_SCALE) - 1))
    step = min(max(step, 0), len(_SCALE) - 1)
    return f"background:{_SCALE[step]};color:{'#fff' if step >= 6 else '#222'}"


def bars(statistics: Statistics) -> list[tuple[str, int, float]]:
    """(decade, count, height 0...1) for every decade from the lowest to the highest that occurs."""
    counts = {int(k): v for k, v in statistics.decades.items()}
    if not counts:
        return []
    top = max(counts.values())
    return [(f"1e{k}", counts.get(k, 0), counts.get(k, 0) / top) for k in range(min(counts), max(counts) + 1)]


def _matrix(report: Report) -> list[tuple[Source, list[PairResult | None]]]:
    """Rows of the sources x sources matrix, None where a pair was not compared."""
    ran = [s for s in report.sources if s.status == "ran"]
    pairs = {frozenset((p.a, p.b)): p for p in report.pairs}
    return [(a, [pairs.get(frozenset((a.name, b.name))) for b in ran]) for a in ran]
