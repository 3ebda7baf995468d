"""The report as one self-contained HTML file: nothing is loaded, everything from an input is escaped.

Scripts are ours and Plotly's, each allowed by its hash; a script that came in with a name would not run.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import cache
from typing import NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import escape

from harness.rendering import scripts
from harness.rendering.figures import apart, distribution, skeletons
from harness.rendering.markdown import render_markdown
from harness.report.document import Frame, Report, Source
from harness.report.explanation import Explanation
from harness.report.model_parts import Link, ParameterPair
from harness.report.proven import at_most, for_all
from harness.report.results import PairResult
from harness.report.sentences import change_of, changed_text, difference, moved_text
from harness.report.source_parts import FrameResult
from harness.report.tested import all_tested, further_out, own_description
from harness.report.text import degrees, metres, numbers, pasteable, plain, point, quantity, radians
from harness.report.verdicts import Verdict

# ColorBrewer YlOrBr: light to dark, told apart by the colour-blind, always with the number beside it.
_SCALE = ("#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506")
LOWEST, HIGHEST = -16.0, -1.0
TINY = 1e-300


class Cell(NamedTuple):
    """A cell of the matrix: the pair compared, and where its detail is; None where nothing was compared."""

    pair: PairResult
    anchor: str


@cache  # it keeps the compiled templates: to compile one takes longer than to fill it
def _environment() -> Environment:
    env = Environment(
        loader=PackageLoader("harness.rendering", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: type(value)(plain(value)) if isinstance(value, str) else value,
    )
    env.filters.update(
        metres=metres, radians=radians, numbers=numbers, colour=colour, for_all=for_all, quantity=quantity, difference=difference,
        change_of=change_of, moved=moved_text, changed=changed_text, apart=apart, point=point,
        degrees=degrees, pasteable=pasteable, own_description=own_description, further_out=further_out,
    )  # fmt: skip
    return env


def render_html(report: Report) -> str:
    """One robot's report."""
    figures = scripts.data({"skeletons": skeletons(report), "distribution": distribution(report)})
    pages = (scripts.own("common.js"), scripts.own("report.js"))
    plotly = scripts.plotly()
    template = _environment().get_template("report.html.j2")
    page = template.render(
        report=report,
        policy=" ".join([*(page.hash for page in pages), plotly.hash]),
        matrix=_matrix(report),
        pairs=_numbered(report),
        frames=[frame.name for frame in report.frames],
        by_frame={s.name: {f.frame: f for f in s.frames} for s in report.sources},
        mapped=_by_dh(report),
        anchors={s.name: f"source-{i}" for i, s in enumerate(report.sources)},
        failing=failing(report),
        causes=_causes(report),
        misfiled=[p for p in report.published if p.found == "wrong" and p.status == "holds"],
        proven=at_most(report.theorem) if report.theorem and report.theorem.frames else "",
        all_tested=all_tested(report.sources),
        blind={frame.name for frame in report.frames if frame.relation == "rigid"},
        side_by_side=_side_by_side(report),
        certified=[s for s in report.sources if s.certificate],
        tested=[s for s in report.sources if s.tested],
        explained=[s for s in report.sources if s.explanation],
        absent=[s for s in report.sources if s.status != "ran"],
        posed=posed(report),
        tree=_tree(report),
        legend=legend(),
        plotly_version=plotly.version,
    )
    # What is long, or has lines, is put in last. No input can hold such a mark: the template has escaped them all.
    markdown = str(escape(render_markdown(report)))
    texts = {"common": pages[0].text, "report": pages[1].text, "figures": figures, "plotly": plotly.text, "markdown": markdown}
    for name, text in texts.items():
        page = page.replace(f"<!--{name}-->", text, 1)
    return page


def render_index(reports: Sequence[Report], left_out: Sequence[str] = (), without_page: Collection[str] = ()) -> str:
    """The list of all robots.

    reports: their reports.
    left_out: files that are not in the list, each with the reason.
    without_page: names of robots whose HTML is not there to be linked.
    """
    pages = (scripts.own("common.js"), scripts.own("index.js"))
    page = _environment().get_template("index.html.j2").render(
        reports=reports, policy=" ".join(page.hash for page in pages), worst={r.robot.name: _worst(r) for r in reports},
        left_out=left_out, without_page=without_page,
    )  # fmt: skip
    for name, text in (("common", pages[0].text), ("index", pages[1].text)):
        page = page.replace(f"<!--{name}-->", text, 1)
    return page


def failing(report: Report) -> list[Source]:
    """The sources that do not pass, those that disagree first."""
    bad = [s for s in report.sources if not s.passes and (s.required or s.status != "not run")]
    return sorted(bad, key=lambda s: s.verdict in (Verdict.NOT_RUN, Verdict.FAILED))


def posed(report: Report) -> list[Source]:
    """The sources with a picture: first those that disagree, then those that do as accepted."""
    bad = failing(report)
    return sorted(
        (s for s in report.sources if s.pose), key=lambda s: (s not in bad, s.verdict is not Verdict.AGREES_AS_ACCEPTED)
    )


def colour(value: float) -> str:
    """Inline style of a matrix cell: background by the power of ten, text dark or light to match."""
    exponent = math.log10(value) if value > 0 else LOWEST
    step = round((exponent - LOWEST) / (HIGHEST - LOWEST) * (len(_SCALE) - 1))
    step = min(max(step, 0), len(_SCALE) - 1)
    return f"background:{_SCALE[step]};color:{'#fff' if step >= 6 else '#222'}"


def legend() -> list[tuple[str, str]]:
    """(style, text) of each colour of the scale."""
    step = (HIGHEST - LOWEST) / (len(_SCALE) - 1)
    exponents = [LOWEST + i * step for i in range(len(_SCALE))]
    return [(colour(10.0**e), f"1e{round(e)}") for e in exponents]


def _worst(report: Report) -> tuple[FrameResult, FrameResult] | None:
    """The frames that are furthest off, over their source's tolerance: in position, and in rotation."""
    frames = [(f, s.tolerance) for s in report.sources for f in s.frames]
    if not frames:
        return None
    by_position = max(frames, key=lambda pair: pair[0].position.max / max(pair[1].position, TINY))
    by_rotation = max(frames, key=lambda pair: pair[0].rotation.max / max(pair[1].rotation, TINY))
    return by_position[0], by_rotation[0]


def _numbered(report: Report) -> list[Cell]:
    return [Cell(pair, f"pair-{i}") for i, pair in enumerate(report.pairs)]


def _matrix(report: Report) -> list[tuple[Source, list[Cell | None]]]:
    """Rows of the sources x sources matrix, None where a pair was not compared."""
    ran = [s for s in report.sources if s.status == "ran"]
    pairs = {frozenset((cell.pair.a, cell.pair.b)): cell for cell in _numbered(report)}
    return [(a, [pairs.get(frozenset((a.name, b.name))) for b in ran]) for a in ran]


def _causes(report: Report) -> list[tuple[str, Explanation, list[Source]]]:
    """Sources with the same explanation together: their names, the explanation, the sources."""
    groups: dict[tuple[str, ...], list[tuple[Source, Explanation]]] = {}
    for source in report.sources:
        if e := source.explanation:
            groups.setdefault((e.unexplained, *(c.text for c in e.changes)), []).append((source, e))
    return [(", ".join(s.name for s, _ in group), group[0][1], [s for s, _ in group]) for group in groups.values()]


def _side_by_side(report: Report) -> list[tuple[str, list[str], list[tuple[str, list[ParameterPair]]]]]:
    """Two tables, joints and then base and tool: title, heads of the columns, rows of (subject, cells)."""
    rows: dict[str, list[ParameterPair]] = {}
    for pair in report.parameters.rows if report.parameters else []:
        rows.setdefault(pair.subject, []).append(pair)
    tables = []
    for title, ends in (("joint", False), ("base and tool", True)):
        chosen = [(subject, cells) for subject, cells in rows.items() if (subject in ("base", "tool")) == ends]
        heads = [f"{p.parameter} [{'mm' if p.unit == 'm' else 'deg'}]" for p in chosen[0][1]] if chosen else []
        tables.append((title, heads, chosen))
    return [table for table in tables if table[2]]


def _by_dh(report: Report) -> dict[str, list[Frame]]:
    """The mapped frames on each DH frame, by its label."""
    mapped: dict[str, list[Frame]] = {}
    for frame in report.frames:
        mapped.setdefault(frame.dh, []).append(frame)
    return mapped


def _tree(report: Report) -> list[tuple[int, Link]]:
    """The URDF's links with their depth, in the order in which they are listed, parents first."""
    depth: dict[str, int] = {}
    rows = []
    for link in report.trees.urdf:
        depth[link.name] = 0 if link.parent is None else depth.get(link.parent, 0) + 1
        rows.append((depth[link.name], link))
    return rows
