"""Reports: valid against their schema, complete, escaped, and never written by halves."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from junitparser import JUnitXml, TestSuite
from lxml import html as lxml_html

from harness.description.model import RobotModel, load_model
from harness.errors import InputError
from harness.reading import REPORT_BYTES
from harness.rendering.files import prepare, write, write_index, write_report, write_summary
from harness.rendering.html import render_html
from harness.rendering.junit import render_junit
from harness.rendering.markdown import render_markdown
from harness.report.document import Report
from harness.report.json_file import read_report, schema, to_json
from harness.report.text import metres, numbers, plain, radians
from harness.run.options import Options
from harness.verdict.accepted import accepted_from
from harness.writing import replace_together
from tests.helpers import compared, crosscheck, remade

FAST = ("dh:pinocchio", "urdf:pinocchio")


@pytest.fixture(scope="module")
def reports(models: dict[str, RobotModel]) -> dict[str, Report]:
    return {
        name: crosscheck(model, Options(samples=100, seed=0, sources=FAST, command=f"crosscheck run {name}"))
        for name, model in models.items()
    }


@pytest.fixture
def disagreeing(copy_model: Callable[..., Path]) -> Report:
    return crosscheck(
        load_model(copy_model("ur5", ("dh.csv", "0.089159", "0.089460"))),
        Options(samples=100, seed=0, sources=FAST, command="crosscheck run ur5"),
    )


def test_every_report_is_valid_against_the_schema(reports: dict[str, Report], disagreeing: Report) -> None:
    definition = schema()
    jsonschema.Draft202012Validator.check_schema(definition)
    validator = jsonschema.Draft202012Validator(definition)
    for report in [*reports.values(), disagreeing]:
        validator.validate(json.loads(to_json(report)))
    broken = json.loads(to_json(disagreeing))
    broken["verdict"]["exit_code"] = 7
    assert list(validator.iter_errors(broken))
    broken = json.loads(to_json(disagreeing))
    broken["sources"][0]["surprise"] = 1
    assert list(validator.iter_errors(broken))


def test_json_round_trip(reports: dict[str, Report], tmp_path: Path) -> None:
    path = write(tmp_path / "x.json", to_json(reports["stanford"]))
    assert read_report(path) == reports["stanford"]


def test_what_varies_sits_in_one_block(reports: dict[str, Report]) -> None:
    document = json.loads(to_json(reports["ur5"]))
    environment = json.dumps(document.pop("environment"))
    rest = json.dumps(document)
    for word in ("created", "duration", "platform", "engine_seconds", "python"):
        assert f'"{word}"' in environment
        assert f'"{word}"' not in rest


@pytest.mark.parametrize("robot", ["ur5", "iiwa14", "humanoid_arm", "stanford"])
def test_html_says_what_the_document_says(reports: dict[str, Report], robot: str) -> None:
    report = reports[robot]
    page = lxml_html.fromstring(render_html(report))
    text = " ".join(page.text_content().split())
    for expected in (
        report.verdict.sentence,
        report.robot.description,
        *(frame.name for frame in report.frames),
        *(s.name for s in report.sources),
        *(p.provenance for p in report.published),
        *report.robot.hashes.values(),
        report.settings.command,
    ):
        assert expected in text
    headings = [h.text for h in page.iter("h2")]
    assert headings == [
        "Verdict", "For which configurations", "Who disagrees", "Where", "Why", "How sure", "What moved since it was accepted",
        "How to reproduce",
    ]  # fmt: skip
    assert {"Proven: the two descriptions, at every configuration", "Canonical parameters side by side", "What did not run"} <= {
        h.text for h in page.iter("h3")
    }
    proof = report.sources[2].certificate
    assert proof is not None
    assert all(f"≤ {metres(bound.position_upper)}" in text for bound in proof.frames)
    assert not page.xpath("//iframe | //object | //base | //img[@src] | //link[not(@rel='icon')]")
    assert {a.split(":")[0] for a in page.xpath("//@src | //@href") if not a.startswith("#")} == {"data"}
    assert len(render_html(report)) < 3e6
    assert {a[1:] for a in page.xpath("//@href") if a.startswith("#")} <= set(page.xpath("//@id"))
    assert len(page.xpath("//@id")) == len(set(page.xpath("//@id")))


def test_html_of_a_disagreement_locates_it(disagreeing: Report) -> None:
    text = " ".join(lxml_html.fromstring(render_html(disagreeing)).text_content().split())
    assert "ur5 DISAGREES: urdf:pinocchio" in text
    assert "Smallest reproducer: frame tool0 at q = [0, 0, 0, 0, 0, 0] is 0.301 mm" in text
    assert "What to change, on one side or the other" in text
    assert "1 of 36 numbers differ: d of shoulder_pan_joint by -0.301 mm." in text
    assert "≤ 0.301 mm" in text
    assert "filed as 'holds' and was found 'wrong'" in text


def test_markdown_fits_a_review(reports: dict[str, Report], disagreeing: Report) -> None:
    for report in [*reports.values(), disagreeing]:
        text = render_markdown(report)
        assert len(text.splitlines()) <= 60
        assert report.settings.command in text
    text = render_markdown(disagreeing)
    assert text.startswith("## FAIL: ur5\n")
    assert "7 of 11 frames are outside tolerance, first upper\\_arm\\_link" in text
    assert "**filed as holds**" in text


def test_junit_lists_what_failed(reports: dict[str, Report], disagreeing: Report) -> None:
    passed = JUnitXml.fromstring(render_junit(reports["ur5"]).encode())
    assert (passed.tests, passed.failures, passed.errors) == (11 + 11 + 11, 0, 0)
    failed = JUnitXml.fromstring(render_junit(disagreeing).encode())
    names = {case.name for suite in failed for case in suite if case.result and case.classname == "ur5.urdf:pinocchio"}
    assert {"tool0", "forearm_link"} <= names
    assert "base" not in names
    texts = [case.result[0].text for suite in failed for case in suite if case.result and case.name == "tool0"]
    assert any("smallest reproducer" in text and "crosscheck run ur5" in text for text in texts)


def test_junit_counts_its_cases_once(reports: dict[str, Report], monkeypatch: pytest.MonkeyPatch) -> None:
    """To count them at each case takes minutes for some thousand."""
    count: Any = TestSuite.update_statistics
    counted = []

    def counting(suite: TestSuite) -> None:
        counted.append(suite)
        count(suite)

    monkeypatch.setattr(TestSuite, "update_statistics", counting)
    render_junit(reports["ur5"])
    assert 1 <= len(counted) <= 2


def test_what_every_failing_frame_says_is_short_in_junit(disagreeing: Report) -> None:
    """A long command, or cause, once in the document must not be a thousand times in the page."""
    long = remade(disagreeing, settings=remade(disagreeing.settings, command=f"crosscheck run {'x' * 100_000}"))
    assert len(render_junit(long)) < 100_000
    assert "smallest reproducer" in render_junit(long)


def test_index_lists_every_report_in_the_folder(reports: dict[str, Report], disagreeing: Report, tmp_path: Path) -> None:
    for name in ("sixr", "stanford"):
        write_report(reports[name], tmp_path)
    (tmp_path / "other.json").write_text('{"not": "ours"}')
    (tmp_path / "old.json").write_text('{"format": "fk-crosscheck report", "version": "0.1"}')
    text = lxml_html.fromstring(write_index(tmp_path).read_text()).text_content()
    assert "All 2 robots agree" in text
    write_report(disagreeing, tmp_path)
    page = lxml_html.fromstring(write_index(tmp_path).read_text())
    assert "1 of 3 robots do not pass: ur5" in page.text_content()
    assert [a.get("href") for a in page.iter("a")] == ["sixr.html", "stanford.html", "ur5.html"]
    assert {"robot", "verdict", "since accepted"} <= {b.text for b in page.iter("button")}
    assert json.loads((tmp_path / "report.schema.json").read_text()) == json.loads(json.dumps(schema()))


def test_the_index_leaves_out_what_it_cannot_read_and_says_so(
    reports: dict[str, Report], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_report(reports["sixr"], tmp_path)
    assert capsys.readouterr().err == ""
    text = (tmp_path / "sixr.json").read_text()
    (tmp_path / "a.json").mkdir()
    (tmp_path / "b.json").symlink_to("nowhere")
    (tmp_path / "c.json").write_text("[" * 100_000)
    os.mkfifo(tmp_path / "d.json")
    (tmp_path / "e.json").symlink_to("/dev/zero")
    with (tmp_path / "f.json").open("wb") as file:
        file.truncate(REPORT_BYTES + 1)
    (tmp_path / "g.json").write_bytes(b"\xff\xfe\xfd")
    (tmp_path / "h.json").write_text(text.replace('"worst_frame": "', '"worst_frame": "no '))
    (tmp_path / "i.json").write_text('{"format": "fk-crosscheck report", "version": "0.1"}')
    (tmp_path / "j.json").write_text("1" * 5000)
    (tmp_path / "k<b>\x1b.json").write_text("[]")
    (tmp_path / "copy.json").write_text(text)
    (tmp_path / "mutation.json").write_text('{"format": "fk-crosscheck mutation score"}')  # ours, and no report
    page = lxml_html.fromstring(write_index(tmp_path).read_text())
    assert "All 1 robots agree" in page.text_content()
    listed = [li.text_content() for li in page.xpath("//ul/li")]
    names = [*(f"{c}.json" for c in "abc"), "copy.json", *(f"{c}.json" for c in "defghij"), "k<b>\ufffd.json"]
    assert [text.split(" (")[0] for text in listed] == names
    assert "expected a file" in listed[0]
    assert "belongs into sixr.json" in listed[3]
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith(f"note: not listed in {tmp_path / 'index.html'}: a.json (")
    assert err.endswith("and 7 more\n")


def test_the_index_links_only_to_what_is_there(reports: dict[str, Report], tmp_path: Path) -> None:
    for name in ("sixr", "stanford"):
        write_report(reports[name], tmp_path)
    (tmp_path / "sixr.html").unlink()
    page = lxml_html.fromstring(write_index(tmp_path).read_text())
    assert [a.get("href") for a in page.iter("a")] == ["stanford.html"]
    assert "sixr" in page.text_content()


def full(*_: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("call", ["replace", "write", "symlink", "fsync"])
def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str) -> None:
    path = write(tmp_path / "report.json", "old")
    if call == "symlink":
        write_together(tmp_path, "old")
    monkeypatch.setattr(os, call, full)
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        write_together(tmp_path, "new") if call == "symlink" else write(path, "new")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["report.json"]


def write_together(folder: Path, text: str) -> None:
    """One file as `write_report` writes four."""
    try:
        replace_together(folder, "report", {"report.json": text})
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}") from None


@pytest.mark.parametrize("call", ["replace", "write", "symlink", "link", "mkdir"])
@pytest.mark.parametrize("step", [1, 2, 3, 4])
def test_a_full_disk_leaves_all_reports_of_a_robot(
    reports: dict[str, Report], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, step: int
) -> None:
    write_report(reports["sixr"], tmp_path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    real, count = getattr(os, call), [0]

    def fails(*args: Any, **kwargs: Any) -> Any:
        count[0] += 1
        return full() if count[0] >= step else real(*args, **kwargs)

    later = remade(reports["sixr"], settings=remade(reports["sixr"].settings, command="another"))
    monkeypatch.setattr(os, call, fails)
    monkeypatch.setattr("shutil.copy2", full)
    if call == "mkdir" and step == 4:  # there are but three folders
        write_report(later, tmp_path)
        return
    with pytest.raises(InputError, match=r"sixr\.\*: cannot be written: No space left on device; choose another --out"):
        write_report(later, tmp_path)
    monkeypatch.undo()
    prepare(tmp_path)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


@pytest.mark.parametrize("kind", ["a file", "read only", "no such"])
def test_a_folder_that_cannot_be_written_to(
    reports: dict[str, Report], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    folder = tmp_path / "reports"
    if kind == "a file":
        folder.write_text("")
    elif kind == "read only":  # root may write anywhere: the system says what it says of a disk that is read only
        folder.mkdir()

        def refuses(*_: object, **__: object) -> None:
            raise OSError(30, "Read-only file system")

        monkeypatch.setattr(os, "open", refuses)
        monkeypatch.setattr(os, "mkdir", refuses)
    reason = {"a file": "Not a directory|File exists", "read only": "Read-only", "no such": "No such file"}[kind]
    for attempt in (lambda: write_report(reports["sixr"], folder), lambda: write_index(folder), lambda: write(folder / "x", "")):
        with pytest.raises(InputError, match=f"cannot be written: ({reason})"):
            attempt()
    if kind != "no such":
        with pytest.raises(InputError, match=f"cannot write reports here: ({reason})"):
            prepare(folder)


def test_the_next_start_ends_what_a_killed_one_has_begun(reports: dict[str, Report], tmp_path: Path) -> None:
    write_report(reports["sixr"], tmp_path)
    hidden = tmp_path / f".sixr.{'a' * 16}.crosscheck-swap"
    for side in ("old", "new"):
        (hidden / side).mkdir(parents=True)
    (hidden / "now").symlink_to("new")
    (hidden / "new" / "sixr.md").write_text("new")
    (hidden / "old" / "sixr.md").write_text("old")
    (tmp_path / "sixr.md").unlink()
    (tmp_path / "sixr.md").symlink_to(f"{hidden.name}/now/sixr.md")
    (tmp_path / f".index.html.{'b' * 16}.crosscheck-tmp").write_text("half")
    assert (tmp_path / "sixr.md").read_text() == "new"
    prepare(tmp_path)
    assert (tmp_path / "sixr.md").read_text() == "new"
    assert sorted(p.name for p in tmp_path.iterdir() if not p.is_symlink()) == sorted(
        f"sixr.{end}" for end in ("html", "json", "junit.xml", "md")
    )


def test_the_output_folder_is_made(tmp_path: Path) -> None:
    prepare(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (metres(0.000301), "0.301 mm"),
        (metres(5.25e-12), "5.2e-12 m"),
        (metres(0.0), "0 m"),
        (metres(1.25), "1.25 m"),
        (radians(3.141592653589793), "180 deg"),
        (radians(2e-11), "2.0e-11 rad"),
        (numbers([0.2, -0.0, 1 / 3]), "[0.2, 0, 0.333333]"),
        (plain("a\nb\x1b[0m"), "a b\ufffd[0m"),
    ],
)
def test_how_numbers_read(shown: str, expected: str) -> None:
    assert shown == expected


@pytest.mark.parametrize("robots", [["sixr"], ["sixr", "stanford"]])
def test_the_summary_of_a_job_is_the_markdown(
    reports: dict[str, Report], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, robots: list[str]
) -> None:
    path = tmp_path / "summary.md"
    path.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(path))
    for name in robots:
        write_summary(reports[name])
    assert path.read_text() == "before\n" + "".join(render_markdown(reports[name]) + "\n" for name in robots)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path))
    with pytest.raises(InputError, match="GITHUB_STEP_SUMMARY: cannot be written"):
        write_summary(reports[robots[0]])


def test_markdown_is_a_screenful_however_much_there_is(disagreeing: Report) -> None:
    many = [remade(disagreeing.sources[2], name=f"urdf:engine{i}") for i in range(40)]
    out = [remade(s, name=f"{s.name}b", status="not run", verdict="not run", frames=[], reason="x") for s in many]
    report = remade(disagreeing, sources=[*disagreeing.sources, *many, *out], published=disagreeing.published * 9)
    report = compared(report, accepted_from(disagreeing), False)
    text = render_markdown(report)
    assert len(text.splitlines()) <= 60
    assert "more in the HTML report" in text
    assert text.splitlines()[-1] == "Reproduce: `crosscheck run ur5`"
