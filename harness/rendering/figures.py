"""Figures of a report as Plotly takes them: both skeletons at a source's worst configuration, and how discrepancies are spread.

Colours are those of Okabe and Ito, told apart by the colour-blind; line style, marker or pattern always says the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.report.document import Report, Source
from harness.report.pose import FramePair
from harness.report.source_parts import Statistics
from harness.report.text import metres, plain, radians
from harness.report.verdicts import Verdict
from harness.se3 import Array, position_error, rotation_error

REFERENCE, SOURCE = "#0072B2", "#D55E00"
TRIAD = (("x", "#CC3311"), ("y", "#009E73"), ("z", "#56B4E9"))
BARS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#999999")
PATTERNS = ("", "/", "x", ".", "\\", "-", "|", "+")

SEEN = 0.12  # of the arm's extent: how far apart a magnified difference is drawn
TURNED = 0.6  # rad, likewise
TRIAD_SIZE = 0.06
DRAWN = 1e9  # the largest number in a placement that is drawn: squares of what an engine may return overflow
BUDGET = 450_000  # bytes: with Plotly and the tables a report stays below 3 MB

Figure = dict[str, Any]


def letters(text: str) -> str:
    """Text that stands for itself in a figure: Plotly takes `<b>` and `&lt;` for markup, unless a zero-width space is in it."""
    return plain(text).replace("<", "<\u200b").replace("&", "&\u200b")


def skeletons(report: Report) -> dict[str, Figure]:
    """For each source with a picture, by its place: traces as they are, and magnified by `factor` if too small to see.

    Those that disagree come first; what would make the page larger than BUDGET is left out, and what is too large to be drawn.
    """
    figures: dict[str, Figure] = {}
    order = {label.label: i for i, label in enumerate(report.trees.dh)}
    rank = {frame.name: order.get(frame.dh, len(order)) for frame in report.frames}
    spent = 0
    for i, source in sorted(enumerate(report.sources), key=lambda pair: pair[1].verdict is Verdict.AGREES):
        if source.pose is None:
            continue
        pairs = sorted(source.pose.frames, key=lambda f: rank[f.frame])
        if not pairs or any(np.abs(T).max() > DRAWN for T in _placements(pairs)):
            continue
        factor = _factor(pairs) if source.verdict is not Verdict.AGREES else 1.0
        figure = {
            "true": _traces(pairs, report.settings.reference, source.name, 1.0),
            "magnified": _traces(pairs, report.settings.reference, source.name, factor) if factor > 1.0 else None,
            "factor": factor,
        }
        spent += len(json.dumps(figure))
        if spent > BUDGET:
            break
        figures[f"source-{i}"] = figure
    return figures


def _placements(pairs: Sequence[FramePair]) -> tuple[Array, Array]:
    return np.array([f.reference for f in pairs]), np.array([f.source for f in pairs])


def _extent(T: Array) -> float:
    points = T[:, :3, 3]
    return max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-3)


def _factor(pairs: Sequence[FramePair]) -> float:
    """The power of ten that makes the largest difference visible; 1 if it is, or if there is none."""
    T_a, T_b = _placements(pairs)
    position, rotation = position_error(T_a, T_b).max(), rotation_error(T_a, T_b).max()
    largest = float(max(position / (SEEN * _extent(T_a)), rotation / TURNED))
    return 10.0 ** max(0, math.floor(-math.log10(largest))) if 0.0 < largest < 1.0 else 1.0


def _rotation_vector(R: Array) -> Array:
    """Axis times angle (3,) of a rotation (3, 3)."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = float(np.linalg.norm(v))
    angle = math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))
    return v if sine < 1e-9 else np.asarray(v * (angle / sine))


def _rotation(w: Array) -> Array:
    """The rotation (3, 3) by the angle |w| about w: Rodrigues' formula."""
    angle = float(np.linalg.norm(w))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K))


def _magnified(T_a: Array, T_b: Array, factor: float) -> Array:
    """T_b with its differences from T_a (N, 4, 4) made `factor` times as large: positions, and angles in the frame of T_a."""
    T = T_b.copy()
    T[:, :3, 3] = T_a[:, :3, 3] + factor * (T_b[:, :3, 3] - T_a[:, :3, 3])
    for i, (a, b) in enumerate(zip(T_a[:, :3, :3], T_b[:, :3, :3], strict=True)):
        T[i, :3, :3] = a @ _rotation(factor * _rotation_vector(a.T @ b))
    return T


def _traces(pairs: Sequence[FramePair], reference: str, source: str, factor: float) -> list[Figure]:
    T_a, T_b = _placements(pairs)
    size = TRIAD_SIZE * _extent(T_a)
    names = [letters(f.frame) for f in pairs]
    off = [apart(f) for f in pairs]
    T_b = T_b if factor == 1.0 else _magnified(T_a, T_b, factor)
    shown = [""] * len(names)
    for group in in_one_place(T_a[:, :3, 3], 0.5 * size):  # one label for frames that stand in one place
        shown[group[0]] = ", ".join(names[i] for i in group)
    return [
        _skeleton(T_a, reference, REFERENCE, "solid", "circle", shown, [f"{n}: {letters(reference)}" for n in names]),
        _skeleton(
            T_b, source, SOURCE, "dash", "diamond", [""] * len(names),
            [f"{n}: {letters(source)}, {text} off" for n, text in zip(names, off, strict=True)],
        ),
        *_triads(T_a, size, "solid", True),
        *_triads(T_b, size, "dot", False),
    ]  # fmt: skip


def apart(pair: FramePair) -> str:
    """`0.301 mm, 1.1e-11 rad`: how far apart the two placements of a frame are."""
    T_a, T_b = np.array(pair.reference), np.array(pair.source)
    with np.errstate(over="ignore"):  # an engine may return anything: infinitely far is how far it is
        position, rotation = float(position_error(T_a, T_b)), float(rotation_error(T_a, T_b))
    return f"{metres(position)}, {radians(rotation)}"


def in_one_place(points: Array, gap: float) -> list[list[int]]:
    """Indices of points (N, 3) in groups: each with the first point that is nearer than `gap`."""
    groups: list[list[int]] = []
    for i, point in enumerate(points):
        group = next((g for g in groups if np.linalg.norm(points[g[0]] - point) < gap), None)
        if group is None:
            groups.append([i])
        else:
            group.append(i)
    return groups


def _rounded(values: Array) -> list[float]:
    return [float(f"{x:.7g}") for x in values.tolist()]


def _skeleton(T: Array, name: str, colour: str, dash: str, symbol: str, labels: list[str], hover: list[str]) -> Figure:
    x, y, z = (_rounded(T[:, i, 3]) for i in range(3))
    return {
        "type": "scatter3d", "mode": "lines+markers+text", "name": letters(name), "x": x, "y": y, "z": z, "text": labels,
        "hovertext": hover, "hoverinfo": "text", "textposition": "top center",
        "line": {"color": colour, "width": 7 if dash == "solid" else 5, "dash": dash},
        "marker": {"color": colour, "size": 5, "symbol": symbol},
    }  # fmt: skip


def _triads(T: Array, size: float, dash: str, named: bool) -> list[Figure]:
    """x, y and z axes of all frames, one trace each; their letters at the first frame."""
    traces = []
    for k, (letter, colour) in enumerate(TRIAD):
        ends = T[:, :3, 3] + size * T[:, :3, k]
        lines: list[list[float | None]] = [[], [], []]
        for i in range(3):
            for start, end in zip(_rounded(T[:, i, 3]), _rounded(ends[:, i]), strict=True):
                lines[i] += [start, end, None]
        text = ["", letter] + [""] * (3 * len(T) - 2) if named else []
        traces.append(
            {"type": "scatter3d", "mode": "lines+text" if named else "lines", "name": f"{letter} axes", "showlegend": named,
             "x": lines[0], "y": lines[1], "z": lines[2], "text": text, "hoverinfo": "skip", "legendgroup": letter,
             "line": {"color": colour, "width": 4, "dash": dash}}
        )  # fmt: skip
    return traces


def distribution(report: Report) -> list[Figure]:
    """For each source its discrepancies at its worst frame, counted by power of ten: positions above, rotations below."""
    traces = []
    sources = [s for s in report.sources if s.frames]
    for i, source in enumerate(sources):
        frame = source.worst
        for axis, statistics in (("", frame.position), ("2", frame.rotation)):
            traces.append(_bars(source, statistics, i, axis, visible=i < len(BARS)))
    return traces


def _bars(source: Source, statistics: Statistics, i: int, axis: str, visible: bool) -> Figure:
    counts = sorted((int(k), v) for k, v in statistics.decades.items())
    name = letters(source.name)
    pattern = {"shape": PATTERNS[i % len(PATTERNS)], "fgopacity": 0.9, "size": 6}
    return {
        "type": "bar", "name": name, "legendgroup": name, "showlegend": axis == "", "xaxis": "x" + axis, "yaxis": "y" + axis,
        "x": [k + 0.5 for k, _ in counts], "y": [v for _, v in counts],
        "hovertext": [f"{name}: {v} from 1e{k} to 1e{k + 1}" for k, v in counts], "hoverinfo": "text",
        "marker": {"color": BARS[i % len(BARS)], "pattern": pattern, "line": {"width": 1}},
        "visible": True if visible else "legendonly",
    }  # fmt: skip
