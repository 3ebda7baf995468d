"""The HTML report in a browser: complete, at rest in any size and light, and moving where it should."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from harness.rendering import figures
from harness.rendering.files import write_report
from harness.report.document import Report
from tests.browser.conftest import Open, until
from tests.rendering.test_hostile import NAMES, rename

SECTIONS = ("verdict", "configurations", "who", "where", "why", "sure", "moved", "reproduce")
PARTS = ("matrix", "pose", "mapping", "parameters", "absent", "skeleton", "distribution", "copy", "markdown")


def violations(page: Any) -> list[str]:
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [f"{v['id']}: {node['html'][:200]}" for v in found for node in v["nodes"]]


@pytest.mark.parametrize("robot", ["ur5", "stanford"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_a_report_is_whole_and_accessible(open_page: Open, site: Path, robot: str, scheme: str, width: int) -> None:
    page = open_page(f"file://{site}/{robot}.html", width, scheme)
    assert page.evaluate(f"[...{list(SECTIONS + PARTS)}].filter(id => !document.getElementById(id))") == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#skeleton canvas").count() >= 1
    assert page.locator("#distribution .bars path").count() > 0
    assert violations(page) == []
    page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert violations(page) == []


def test_the_accessibility_check_sees_a_violation(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/index.html", drawn=False)
    page.evaluate("document.querySelector('main').append(document.createElement('button'))")
    assert any("button-name" in v for v in violations(page))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_the_index_is_accessible_and_sorts(open_page: Open, site: Path, scheme: str, width: int) -> None:
    page = open_page(f"file://{site}/index.html", width, scheme, drawn=False)
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width

    def robots() -> list[str]:
        return [str(text) for text in page.locator("tbody th a").all_inner_texts()]

    assert robots() == ["panda", "stanford", "ur5"]
    page.get_by_role("button", name="robot", exact=True).click()
    page.get_by_role("button", name="robot", exact=True).click()
    assert robots() == ["ur5", "stanford", "panda"]
    page.get_by_role("button", name="worst position").press("Enter")
    assert robots()[-1] == "ur5"
    assert page.locator("th[aria-sort=ascending]").inner_text() == "worst position"
    page.get_by_role("button", name="verdict").click()
    assert robots()[0] == "ur5"
    page.get_by_role("link", name="ur5").click()
    page.wait_for_selector("html[data-drawn=yes]")
    assert page.locator("h1").inner_text() == "ur5"


def eye(page: Any) -> list[float]:
    found = page.evaluate("document.getElementById('skeleton')._fullLayout.scene._scene.getCamera().eye")
    return [found[k] for k in "xyz"]


def moved_from(page: Any, before: list[float]) -> list[float]:
    """Where the eye is, once it has left `before` and is at rest."""
    last = before
    for _ in range(100):
        page.wait_for_timeout(200)
        now = eye(page)
        if now == last and max(abs(a - b) for a, b in zip(now, before, strict=True)) > 0.1:
            return now
        last = now
    raise AssertionError(f"the eye stayed at {before}")


def test_the_skeleton_turns_under_the_mouse_and_by_keyboard(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    before = eye(page)
    page.locator("#skeleton").scroll_into_view_if_needed()
    box = page.locator("#skeleton").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 150, y + 30, steps=8)
    page.mouse.up()
    turned = moved_from(page, before)
    page.get_by_role("button", name="Turn left").focus()
    page.keyboard.press("Enter")
    further = moved_from(page, turned)
    page.get_by_role("button", name="Reset view").click()
    assert moved_from(page, further) == pytest.approx(before, abs=1e-6)


def test_the_skeleton_shows_the_source_chosen_magnified_or_not(open_page: Open, site: Path, documents: dict[str, Report]) -> None:
    page = open_page(f"file://{site}/ur5.html")
    assert page.locator("#skeleton-source option:checked").inner_text() == "urdf:pinocchio"  # the first that disagrees
    assert "100 times" in page.locator("#skeleton-factor").inner_text()

    def apart() -> float:
        z = page.evaluate("skeleton.data.slice(0, 2).map(t => t.z)")
        return float(max(abs(a - b) for a, b in zip(z[0], z[1], strict=True)))

    assert apart() == pytest.approx(0.0301, abs=1e-5)
    page.get_by_label("magnify").uncheck()
    until(page, "Math.abs(skeleton.data[1].z[8] - skeleton.data[0].z[8]) < 0.001")
    assert apart() == pytest.approx(0.000301, abs=1e-6)
    page.locator("#skeleton-source").select_option(label="dh:pinocchio")
    until(page, "skeleton.data[1].name === 'dh:pinocchio'")
    assert apart() < 1e-6
    assert page.locator("[data-pose]:visible h4").all_inner_texts() == ["dh:pinocchio"]
    pose = documents["ur5"].sources[1].pose
    assert pose is not None
    order = [frame.name for frame in documents["ur5"].frames]
    frames = sorted(pose.frames, key=lambda f: order.index(f.frame))
    assert page.evaluate("skeleton.data[0].x") == pytest.approx([f.reference[0][3] for f in frames], abs=1e-6)


def test_a_source_that_is_not_drawn_says_so(
    open_page: Open, documents: dict[str, Report], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "BUDGET", len(json.dumps(figures.skeletons(documents["ur5"])["source-2"])) + 10)
    write_report(documents["ur5"], tmp_path)
    page = open_page(f"file://{tmp_path}/ur5.html")
    page.locator("#skeleton-source").select_option(label="dh:pinocchio")
    until(page, "skeleton.textContent.startsWith('Not drawn')")
    assert page.locator("#source-1").is_visible()
    page.locator("#skeleton-source").select_option(label="urdf:pinocchio")
    until(page, "skeleton.data?.[1].name === 'urdf:pinocchio'")
    assert page.locator("#skeleton canvas").count() >= 1


def test_a_matrix_cell_leads_to_its_detail(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    row = page.locator("tr", has=page.locator("th", has_text="urdf:pinocchio")).filter(has=page.locator("td.heat")).first
    row.locator("a", has_text="0.301 mm").first.click()
    target = page.locator("tr:target")
    assert target.is_visible()  # inside a closed part, which opened
    assert "dh:numpy and urdf:pinocchio" in target.inner_text()
    assert "0.301 mm" in target.inner_text()
    until(page, "document.querySelector('tr:target').getBoundingClientRect().bottom < innerHeight")
    target.get_by_role("link", name="urdf:pinocchio").click()
    until(page, "document.getElementById('source-2').checkVisibility()")
    page.get_by_role("link", name="dh:pinocchio").first.click()
    until(page, "skeleton.data[1].name === 'dh:pinocchio'")
    assert page.locator("#source-1").is_visible()
    assert not page.locator("#source-2").is_visible()


def test_every_link_inside_leads_somewhere(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    links = page.evaluate("""[...document.querySelectorAll('a[href^="#"]')].map(a => a.getAttribute('href'))""")
    assert len(set(links)) > 10
    for address in sorted(set(links)):
        page.evaluate(f"location.hash = {address!r}")
        until(page, f"document.querySelector({address!r}).checkVisibility()")


def test_the_copy_button_gives_the_markdown(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    page.get_by_role("button", name="Copy as Markdown").click()
    until(page, "document.getElementById('copied').textContent === 'copied'")
    assert page.evaluate("navigator.clipboard.readText()") == (site / "ur5.md").read_text()


def test_the_copy_button_works_without_the_clipboard_interface(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    page.evaluate("void (navigator.clipboard.writeText = () => Promise.reject(new Error('no')))")
    page.get_by_role("button", name="Copy as Markdown").click()
    until(page, "document.getElementById('copied').textContent === 'copied'")
    assert page.evaluate("navigator.clipboard.readText()") == (site / "ur5.md").read_text()


def test_on_paper_everything_is_open_and_nothing_is_a_control(open_page: Open, site: Path) -> None:
    page = open_page(f"file://{site}/ur5.html")
    until(page, "skeleton.dataset.kept === 'yes'")
    assert len(page.pdf()) > 50_000
    assert page.evaluate("[...document.querySelectorAll('details')].every(d => d.open)")
    page.emulate_media(media="print")
    for hidden in ("nav", "#copy", "#skeleton-source"):
        assert not page.locator(hidden).is_visible()
    assert page.locator("#parameters").is_visible()
    assert page.evaluate("document.getElementById('skeleton-paper').naturalWidth") == 1000
    assert page.locator("#skeleton-paper").is_visible()


def test_without_3d_the_tables_say_the_same(open_page: Open, site: Path, browser: Any) -> None:
    context = browser.new_context(offline=True)
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page = context.new_page()
    page.goto(f"file://{site}/ur5.html")
    until(page, "document.getElementById('skeleton').textContent.includes('shows no 3D')")
    assert page.locator("#source-2").is_visible()
    context.close()


def test_a_new_reader_finds_the_wrong_number(open_page: Open, site: Path) -> None:
    """What is seen first, without scrolling, on a phone as well: that it fails, which number, by how much, on which sides."""
    for width in (1280, 390):
        page = open_page(f"file://{site}/ur5.html", width)
        seen = page.evaluate(
            """[...document.querySelectorAll('main *')].filter(e => e.children.length === 0)
               .filter(e => { const r = e.getBoundingClientRect(); return r.bottom < 900 && r.height > 1; })
               .map(e => e.textContent).join(' ')"""
        )
        for part in ("FAIL", "d of shoulder_pan_joint", "0.08946 m in dh.csv", "0.089159 m in the URDF", "-0.301 mm"):
            assert part in seen
        marked = page.locator("#parameters ~ .scroll td.marked").all_inner_texts()
        assert [text.split()[0] for text in marked] == ["89.46", "89.159"]


# Text in a figure may be drawn in more pieces than another; nothing else may differ.
DRAWN = "SVG|G|TEXT|TSPAN|PATH|CLIPPATH|RECT"
ELEMENTS = f"[...document.querySelectorAll('main *')].map(e => e.tagName).filter(t => !/^({DRAWN})$/i.test(t)).join()"


@pytest.mark.parametrize("first", range(0, len(NAMES), 4))
def test_hostile_names_do_nothing(open_page: Open, site: Path, documents: dict[str, Report], tmp_path: Path, first: int) -> None:
    document = json.loads(documents["ur5"].model_dump_json())
    for old, name in zip(
        ("tool0", "shoulder_pan_joint", "upper_arm_link", "wrist_1_link"), NAMES[first : first + 4], strict=True
    ):
        document = rename(document, old, name)
    write_report(Report.model_validate(document), tmp_path)
    page = open_page(f"file://{tmp_path}/ur5.html")
    page.get_by_role("button", name="Copy as Markdown").click()
    until(page, "document.getElementById('copied').textContent === 'copied'")
    assert page.evaluate("navigator.clipboard.readText()") == (tmp_path / "ur5.md").read_text()
    assert page.evaluate(ELEMENTS) == open_page(f"file://{site}/ur5.html").evaluate(ELEMENTS)
