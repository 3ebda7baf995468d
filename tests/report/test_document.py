"""A report document is refused where it is read if what renders it could not be made of it, and names only what may be a file."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from pydantic import ValidationError

from harness.cli.main import cli
from harness.description.model import load_model
from harness.description.model_file import ModelFile
from harness.errors import InputError
from harness.report.document import Report
from harness.report.json_file import read_report, to_json
from harness.run.options import Options
from tests.helpers import copied, crosscheck

SOURCES = ("dh:pinocchio", "urdf:pinocchio")
Document = dict[str, Any]


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> Document:
    """The report of a disagreement: it has every part there is."""
    folder = copied(tmp_path_factory.mktemp("document"), "ur5", ("dh.csv", "0.089159", "0.089460"))
    report = crosscheck(load_model(folder), Options(samples=50, sources=SOURCES, command="crosscheck run ur5"))
    return dict(json.loads(to_json(report)))


def source(d: Document) -> Any:
    """The source that disagrees."""
    return next(s for s in d["sources"] if s["name"] == "urdf:pinocchio")


def small(name: str) -> Document:
    """A source that was compared nowhere."""
    tolerance = {"position": 1.0, "rotation": 1.0}
    return {"name": name, "required": False, "status": "ran", "verdict": "agrees", "tolerance": tolerance}


HOSTILE_NAMES = (
    "../../x", "/abs/x", "a/b", "..", ".", "", ".hidden", "-x", "x\0y", "x\n", "x" * 129, "x" * 5000, "index", "INDEX",
    "report.schema", "ü", "a b", "con\\x", "x\u202e",
)  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE_NAMES, ids=[repr(n[:20]) for n in HOSTILE_NAMES])
def test_render_writes_only_under_a_name_that_a_model_may_have(document: Document, tmp_path: Path, name: str) -> None:
    hostile = copy.deepcopy(document)
    hostile["robot"]["name"] = name
    path = tmp_path / "in" / "deep" / "report.json"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(hostile))
    result = CliRunner().invoke(cli, ["render", str(path), "--out", str(tmp_path / "in" / "deep" / "out")])
    assert isinstance(result.exception, InputError)
    assert result.exception.exit_code == 2
    assert "robot.name: not a report: " in str(result.exception)
    assert "\n" not in str(result.exception)
    assert len(str(result.exception)) < 400
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == [path]
    with pytest.raises(ValidationError):  # nor may a model have it
        ModelFile.model_validate({**MODEL, "name": name})


MODEL = {
    "description": "d", "convention": "standard", "provenance": {"document": "d"},
    "tolerance": {"position": 1.0, "rotation": 1.0}, "source": [{"name": "dh:numpy"}],
}  # fmt: skip


@pytest.mark.parametrize("name", ["ur5", "UR-5_e.2", "0", "x" * 128, "a.junit", "indexes"])
def test_every_name_of_a_model_may_be_rendered(document: Document, name: str) -> None:
    assert ModelFile.model_validate({**MODEL, "name": name}).name == name
    named = copy.deepcopy(document)
    named["robot"]["name"] = name
    assert Report.model_validate(named).robot.name == name


BROKEN: dict[str, tuple[Callable[[Document], object], str]] = {
    "a row missing": (lambda d: source(d)["pose"]["frames"][0]["reference"].pop(), "at least 4 items"),
    "a number missing": (lambda d: source(d)["pose"]["frames"][0]["source"][0].pop(), "at least 4 items"),
    "a row too many": (lambda d: source(d)["reproducer"]["source_placement"].append([0, 0, 0, 1]), "at most 4 items"),
    "no rows": (lambda d: d["published"][0].update(computed=[]), "at least 4 items"),
    "a claimed rotation of 2 rows": (lambda d: d["published"][0].update(claimed_rotation=[[1, 0, 0]] * 2), "at least 3 items"),
    "a claimed position of 2": (lambda d: d["published"][0]["claimed_position"].pop(), "at least 3 items"),
    "angles of 4": (lambda d: d["published"][0]["computed_rpy"].append(0), "at most 3 items"),
    "an offset of 3 rows": (lambda d: d["frames"][1]["offset"].pop(), "at least 4 items"),
    "the worst frame": (lambda d: source(d).update(worst_frame="nowhere"), "'nowhere', is none of its frames"),
    "no worst frame": (lambda d: source(d).update(worst_frame=""), "the worst frame, '', is none of its frames"),
    "a frame missing": (lambda d: d["frames"].pop(), "a frame that it does not have"),
    "a frame of the pose": (lambda d: source(d)["pose"]["frames"][0].update(frame="nowhere"), "does not have, 'nowhere'"),
    "a frame of the certificate": (
        lambda d: source(d)["certificate"]["frames"][0].update(frame=""),
        "a frame that it does not have, ''",
    ),
    "a frame of the theorem": (lambda d: d["theorem"]["frames"][0].update(frame="nowhere"), "of frames of the report"),
    "an equality missing": (lambda d: d["theorem"]["equality"].popitem(), "of frames of the report"),
    "a certificate of nothing": (lambda d: source(d)["certificate"].update(frames=[]), "a bound of at least one frame"),
    "a source missing": (lambda d: d["sources"].pop(), "a source that it does not have"),
    "a source twice": (lambda d: d["sources"].append(small(source(d)["name"])), "it has 2 sources called 'urdf:pinocchio'"),
    "a frame twice": (lambda d: d["frames"].append(d["frames"][0]), "it has 2 frames called 'base'"),
    "a pair of nobody": (lambda d: d["pairs"][0].update(b="nobody"), "a source that it does not have, 'nobody'"),
    "limits missing": (lambda d: d["robot"]["lower"].pop(), "a lower and an upper limit of each of 6 joints"),
    "a joint more": (lambda d: d["robot"]["joints"].append("j"), "limit of each of 7 joints"),
    "joint values of the pose": (lambda d: source(d)["pose"]["at"]["q"].pop(), "expected 6 joint values"),
    "joint values of the reproducer": (lambda d: source(d)["reproducer"]["q"].append(0), "expected 6 joint values"),
    "an index below zero": (lambda d: source(d)["pose"]["at"].update(index=-1), "greater than or equal to 0"),
    "an index of 300 digits": (lambda d: source(d)["pose"]["at"].update(index=10**300), "less than 9223372036854775808"),
    "samples of 300 digits": (lambda d: d["settings"].update(samples=10**300), "less than"),
    "a seed below zero": (lambda d: d["settings"].update(seed=-1), "greater than or equal to 0"),
    "half a character": (lambda d: d["settings"].update(command="\ud800"), "characters that are none"),
    "a decade that is none": (lambda d: source(d)["frames"][0]["position"]["decades"].update(x=1), "match pattern"),
    "a decade of 400 digits": (lambda d: source(d)["frames"][0]["position"]["decades"].update({"1" * 400: 1}), "match pattern"),
    "counts below zero": (lambda d: source(d)["frames"][0]["position"].update(count=-1), "greater than or equal to 0"),
}


# A page has each source with each, and each frame of each source.
TOO_MUCH: dict[str, tuple[Callable[[Document], object], str]] = {
    "sources": (lambda d: d["sources"].extend(small(f"s{i}") for i in range(200)), "at most 200 sources, got 203"),
    "frames": (
        lambda d: d["frames"].extend({**d["frames"][0], "name": f"f{i}"} for i in range(1000)),
        "at most 1000 frames, got",
    ),
    "results": (
        lambda d: source(d)["frames"].extend(source(d)["frames"][:1] * 50_000),
        "at most 50000 frames of all sources together, got 5",
    ),
    "joints": (
        lambda d: [
            d["robot"].update(joints=["j"] * 1001, lower=[0] * 1001, upper=[0] * 1001),
            d.update(sources=[], pairs=[], theorem=None),
        ],
        "at most 1000 joints, got 1001",
    ),
    "letters of a source": (lambda d: d["sources"].append(small("x" * 1001)), "names of at most 1000 letters, got one of 1001"),
    "letters of a frame": (lambda d: d["frames"].append({**d["frames"][0], "name": "x" * 1001}), "at most 1000 letters"),
    "letters of the reference": (lambda d: d["settings"].update(reference="x" * 1001), "at most 1000 letters"),
}
BROKEN |= TOO_MUCH


@pytest.mark.parametrize("kind", BROKEN)
def test_what_could_not_be_rendered_is_refused_where_it_is_read(document: Document, tmp_path: Path, kind: str) -> None:
    spoil, message = BROKEN[kind]
    broken = copy.deepcopy(document)
    spoil(broken)
    path = tmp_path / "report.json"
    path.write_text(json.dumps(broken))
    with pytest.raises(InputError, match=message) as caught:
        read_report(path)
    assert "\n" not in str(caught.value)
    assert "Value error" not in str(caught.value)
    assert str(caught.value).startswith(str(path))
