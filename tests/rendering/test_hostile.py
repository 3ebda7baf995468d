"""Hostile names: whatever a file is called or holds, it changes nothing but its own letters, in every format."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from lxml import html as lxml_html
from markdown_it import MarkdownIt
from rich.console import Console

from harness.description.model import load_model
from harness.rendering.html import render_html, render_index
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.rendering.terminal import show
from harness.report.document import Report
from harness.report.json_file import to_json
from harness.report.text import plain
from harness.run.options import Options
from harness.verdict.accepted import accepted_from, accepted_text
from harness.view.page import table
from harness.view.session import Apart
from tests.helpers import compared, copied, crosscheck, remade

NAMES = (
    "<script>alert(1)</script>",
    "</script></textarea><img src=x onerror=alert(1)>",
    "'\"><svg/onload=alert(1)>",
    "{{7*7}}{% raw %}${7*7}",
    "<!--plotly--><!--markdown-->",
    "`x` **b** _i_ [a](javascript:alert(1)) ![p](http://x.invalid/p.png)",
    "| a | b |",
    "# head ~~s~~ <b>bold</b>",
    "\x1b[31mred\x1b[0m\x1b]0;title\x07\x08",
    "\u202eright to left\u2066",
    "[bold]rich[/bold] [link=http://x.invalid]y[/link]",
    '=HYPERLINK("http://x.invalid")',
    "@everyone #1 www.x.invalid $x^2$",
    "]]><failure>",
    "line\nbreak\r\n## new",
    "&lt;b&gt;&#x41;",
)


def rename(part: Any, old: str, new: str) -> Any:
    """The document with every string `old` in it replaced, keys included."""
    if isinstance(part, dict):
        return {rename(k, old, new): rename(v, old, new) for k, v in part.items()}
    if isinstance(part, list):
        return [rename(x, old, new) for x in part]
    return part.replace(old, new) if isinstance(part, str) else part


@pytest.fixture(scope="module")
def disagreeing(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """A report in which the frame, the joint, the source and the texts that matter have names that can be replaced."""
    folder = copied(tmp_path_factory.mktemp("hostile"), "ur5", ("dh.csv", "0.089159", "0.089460"))
    report = crosscheck(
        load_model(folder), Options(samples=50, seed=0, sources=("dh:pinocchio", "urdf:pinocchio"), command="COMMAND")
    )
    document = json.loads(to_json(report))
    for old in ("tool0", "shoulder_pan_joint"):
        document = rename(document, old, "NAME")
    document["robot"]["description"] = document["robot"]["provenance"]["note"] = "NAME"
    document["robot"]["hashes"]["NAME"] = "NAME"
    document["sources"][1]["reason"] = document["sources"][1]["install"] = "NAME"
    document["lint"].append({"code": "NAME", "level": "warning", "subject": "NAME", "message": "NAME"})
    document["unmapped"] = ["NAME"]
    document["published"][0]["reason"] = document["published"][0]["provenance"] = "NAME"
    document["sources"].append(
        {**document["sources"][1], "name": "NAME", "status": "failed", "verdict": "failed", "frames": [], "pose": None}
    )
    report = Report.model_validate(document)
    first = accepted_from(report)
    source = remade(first.sources["urdf:pinocchio"], verdict="NAME")
    return compared(report, remade(first, sources={**first.sources, "urdf:pinocchio": source}), True)


def hostile(report: Report, name: str) -> Report:
    return Report.model_validate(rename(json.loads(to_json(report)), "NAME", name))


def words(text: str) -> str:
    return " ".join(text.replace("\u200b", "").split())


def shape(page: str) -> list[tuple[str, tuple[str, ...]]]:
    """The page without its letters: every element with the names of its attributes."""
    return [(str(e.tag), tuple(e.attrib)) for e in lxml_html.document_fromstring(page).iter()]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("render", [render_html, lambda r: render_index([r])], ids=["report", "index"])
def test_html(disagreeing: Report, name: str, render: Callable[[Report], str]) -> None:
    page = render(hostile(disagreeing, name))
    assert shape(page) == shape(render(disagreeing))
    assert not re.search("[\x00-\x08\x0b-\x1f\u202a-\u202e\u2066-\u2069]", page)
    assert words(plain(name)) in words(lxml_html.document_fromstring(page).text_content())


@pytest.mark.parametrize("name", NAMES)
def test_markdown(disagreeing: Report, name: str) -> None:
    rendered = [
        MarkdownIt("commonmark").enable(["table", "strikethrough"]).render(render_markdown(report))
        for report in (disagreeing, hostile(disagreeing, name))
    ]
    assert shape(rendered[1]) == shape(rendered[0])
    page = lxml_html.document_fromstring(rendered[1])
    assert words(plain(name)) in words(page.text_content())
    for code in list(page.iter("code")):
        code.drop_tree()
    # What GitHub looks for in the finished page, outside code: a mention, an issue.
    assert not re.search(r"@\w|#\d", page.text_content())


@pytest.mark.parametrize("name", NAMES)
def test_junit(disagreeing: Report, name: str) -> None:
    texts = [render_junit(disagreeing), render_junit(hostile(disagreeing, name))]
    trees = [lxml_html.etree.fromstring(text.encode()) for text in texts]
    assert [(e.tag, tuple(e.attrib)) for e in trees[1].iter()] == [(e.tag, tuple(e.attrib)) for e in trees[0].iter()]
    assert any(plain(name) in case.get("name") for case in trees[1].iter("testcase"))


@pytest.mark.parametrize("name", NAMES)
def test_json(disagreeing: Report, name: str) -> None:
    report = hostile(disagreeing, name)
    assert Report.model_validate_json(to_json(report)) == report
    assert "\x1b" not in to_json(report)
    numbers = accepted_from(report)
    assert type(numbers).model_validate_json(accepted_text(numbers)) == numbers


@pytest.mark.parametrize("name", NAMES)
def test_terminal(disagreeing: Report, name: str) -> None:
    outputs = []
    for report in (disagreeing, hostile(disagreeing, name)):
        file = io.StringIO()
        show(report, Console(file=file, force_terminal=True, width=4000, color_system="standard"))
        outputs.append(file.getvalue())
    escapes = [re.findall(r"\x1b\[[0-9;]*[A-Za-z]|\x1b.|[\x07\x08\u202a-\u202e\u2066-\u2069]", text) for text in outputs]
    assert escapes[1] == escapes[0]
    assert outputs[1].count("\n") == outputs[0].count("\n")
    assert words(plain(name)) in words(outputs[1])


@pytest.mark.parametrize("name", NAMES)
def test_the_table_of_a_view(name: str) -> None:
    def page(name: str) -> str:
        return table(
            "reference",
            [name],
            {name: name},
            np.zeros(1),
            [Apart(source=name, frame=name, position=1.0, rotation=1.0, within=False)],
        )

    assert shape(page(name)) == shape(page("NAME"))
    assert words(plain(name)) in words(lxml_html.document_fromstring(page(name)).text_content())
