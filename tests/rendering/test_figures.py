"""Figures: what is drawn is what was compared, magnified as it says, and no name is taken for markup."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness import se3
from harness.description.model import RobotModel
from harness.rendering import figures
from harness.rendering.figures import SEEN, _factor, _magnified, _placements, apart, distribution, letters, skeletons
from harness.rendering.html import colour, render_html
from harness.rendering.scripts import data, own, plotly
from harness.report.pose import FramePair, Pose
from harness.report.source_parts import At
from harness.run.options import Options
from harness.se3 import Array
from tests.helpers import crosscheck, remade, transforms

AT = At(index=0, label="zero", q=[0.0])


def pose(*pairs: tuple[Array, Array]) -> Pose:
    frames = [FramePair(frame=f"f{i}", reference=a.tolist(), source=b.tolist()) for i, (a, b) in enumerate(pairs)]
    return Pose(at=AT, frame="f0", frames=frames)


ARM = (np.eye(4), se3.translation((0.0, 0.0, 1.0)), se3.translation((1.0, 0.0, 1.0)))


@given(transforms, transforms)
def test_magnified_once_is_the_source_itself(T_a: Array, T_b: Array) -> None:
    angle = float(se3.rotation_error(T_a, T_b))
    if angle < 3.0:  # near a half turn the axis is not known from the matrix
        np.testing.assert_allclose(_magnified(T_a[None], T_b[None], 1.0)[0], T_b, atol=1e-7)


@given(transforms, st.floats(0.0, 1e-3), st.floats(0.0, 1e-3), st.sampled_from([10.0, 100.0, 1000.0]))
def test_magnified_differences_are_that_much_larger(T_a: Array, length: float, angle: float, factor: float) -> None:
    T_b = T_a @ se3.translation((length, 0.0, 0.0)) @ se3.rotation("y", angle)
    T = _magnified(T_a[None], T_b[None], factor)[0]
    assert se3.position_error(T_a, T) == pytest.approx(factor * length, abs=1e-9)
    assert se3.rotation_error(T_a, T) == pytest.approx(factor * angle, abs=1e-6)


@pytest.mark.parametrize(
    ("off", "factor"),
    [
        (se3.translation((0.000301, 0.0, 0.0)), 100.0),
        (se3.translation((3e-7, 0.0, 0.0)), 100000.0),
        (se3.translation((0.5, 0.0, 0.0)), 1.0),
        (se3.rotation("z", 0.002), 100.0),
        (se3.rotation("z", np.pi), 1.0),
        (np.eye(4), 1.0),
    ],
)
def test_the_factor_makes_a_difference_visible_and_no_more(off: Array, factor: float) -> None:
    pairs = pose((ARM[0], ARM[0]), (ARM[1], ARM[1]), (ARM[2], ARM[2] @ off)).frames
    assert _factor(pairs) == factor
    T_a, T_b = _placements(pairs)
    moved = se3.position_error(T_a, _magnified(T_a, T_b, factor)).max()
    assert moved <= max(2.0 * SEEN, float(se3.position_error(T_a, T_b).max()))


def test_apart_says_both_errors() -> None:
    off = pose((ARM[2], ARM[2] @ se3.translation((0.000301, 0.0, 0.0)) @ se3.rotation("x", 0.5))).frames[0]
    assert apart(off) == "0.301 mm, 28.6 deg"


@pytest.mark.parametrize("name", ["<b>x</b>", "&lt;i&gt;", "<a href='javascript:alert(1)'>y</a>", "a<br>b"])
def test_letters_stand_for_themselves(name: str) -> None:
    shown = letters(name)
    assert shown.replace("\u200b", "") == name
    assert not any(shown[i : i + 2] in ("<b", "</", "<a", "<i", "&l") for i in range(len(shown)))


def test_data_cannot_leave_its_script_element() -> None:
    value = {"</script><script>alert(1)</script>": "<!-- & \u2028"}
    text = data(value)
    assert "<" not in text
    assert "&" not in text
    assert text.isascii()
    assert json.loads(text) == value
    with pytest.raises(ValueError, match="not JSON compliant"):
        data(float("nan"))


def test_plotly_is_packed_the_same_each_time() -> None:
    plotly.cache_clear()
    first = plotly()
    plotly.cache_clear()
    assert plotly() == first
    assert first.version.count(".") == 2
    assert len(first.text) < 2.6e6
    assert own("report.js").hash.startswith("'sha256-")


def test_every_drawn_number_is_one_compared(models: dict[str, RobotModel]) -> None:
    report = crosscheck(models["ur5"], Options(samples=50, seed=0, sources=("dh:pinocchio", "urdf:pinocchio")))
    figures = skeletons(report)
    assert set(figures) == {"source-1", "source-2"}
    for key, figure in figures.items():
        source = report.sources[int(key.split("-")[1])]
        assert source.pose is not None
        by_name = {f.frame: f for f in source.pose.frames}
        first, second = figure["true"][:2]
        hovered = [text.split(":")[0] for text in first["hovertext"]]
        assert sorted(hovered) == sorted(by_name)
        for i, name in enumerate(hovered):
            for trace, T in ((first, by_name[name].reference), (second, by_name[name].source)):
                np.testing.assert_allclose([trace[k][i] for k in "xyz"], [row[3] for row in T[:3]], rtol=1e-6, atol=1e-9)
    bars = distribution(report)
    for i, source in enumerate(s for s in report.sources if s.frames):
        frame = next(f for f in source.frames if f.frame == source.worst_frame)
        assert sum(bars[2 * i]["y"]) == frame.position.count
        assert sum(bars[2 * i + 1]["y"]) == frame.rotation.count


def test_what_is_drawn_has_a_budget(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    report = crosscheck(models["ur5"], Options(samples=20, seed=0, sources=("dh:pinocchio", "urdf:pinocchio"), certify=False))
    worse = [remade(s, verdict="disagrees") if s.name == "urdf:pinocchio" else s for s in report.sources]
    report = remade(report, sources=worse)
    one = len(json.dumps(skeletons(report)["source-2"]))
    monkeypatch.setattr(figures, "BUDGET", one + 10)
    assert list(skeletons(report)) == ["source-2"]
    many = [remade(worse[2], name=f"urdf:engine{i}") for i in range(60)]
    monkeypatch.undo()
    assert len(render_html(remade(report, sources=[*worse, *many]))) < 3e6


def test_colours_grow_darker_with_the_exponent() -> None:
    assert len({colour(10.0**-k) for k in range(0, 17, 2)}) >= 7
    assert colour(0.0) == colour(1e-17)


@pytest.mark.parametrize("huge", [1e10, 1e200, 1.7e308])
@pytest.mark.filterwarnings("error")
def test_what_is_too_large_to_be_drawn_is_left_out(models: dict[str, RobotModel], huge: float) -> None:
    """An engine may return anything: its picture is not worth the report."""
    report = crosscheck(models["sixr"], Options(samples=10, sources=("urdf:pinocchio",), certify=False))
    source = report.sources[-1]
    far = np.array(source.pose.frames[-1].source) if source.pose else np.eye(4)
    far[0, 3], far[1, 1] = huge, -huge
    frames = [FramePair(frame=f.frame, reference=f.reference, source=f.source) for f in source.pose.frames] if source.pose else []
    frames[-1] = remade(frames[-1], source=far.tolist())
    assert source.pose is not None
    spoilt = remade(source, pose=remade(source.pose, frames=frames))
    far_off = remade(report, sources=[*report.sources[:-1], spoilt])
    assert list(skeletons(report)) == ["source-1"]
    assert skeletons(far_off) == {}
    assert "m, " in apart(frames[-1])
    assert render_html(far_off).count("data-pose") >= 1
