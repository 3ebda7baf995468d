"""Damaged report documents: rendered, accepted, listed in the index, held against; and damaged files of accepted numbers."""

from __future__ import annotations

import json
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.description.model import load_model
from harness.report.json_file import to_json
from harness.run.options import Options
from harness.verdict.accepted import accepted_from, accepted_text
from tests.fuzz.command import check, fuzz
from tests.fuzz.damage import Damage, put, seldom_damaged
from tests.fuzz.models import generated, written
from tests.fuzz.trees import Edit, edit_lists, edited, json_text
from tests.helpers import copied, crosscheck

# A run costs more than reading a report. Whether it looks at the damaged file does not depend on the robot: a small one does.
COMMANDS = (*["render"] * 8, *["accept"] * 4, "index", "accepted numbers", "accepted numbers, strict")
SMALL = 4  # a random model of few joints
KINDS = ("agrees", "wrong number", "wrong base", "engine missing", "small")


class Reports:
    """Real robot models and their reports, made when they are first asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @cache  # noqa: B019 - there is one object of this class
    def model(self, kind: str) -> Path:
        """The folder of a model."""
        folder = self._folder / kind.replace(" ", "_")
        if kind == "small":
            folder.mkdir()
            return written(generated(SMALL), folder)
        edits = {"wrong number": ("dh.csv", "joint3,prismatic,0,", "joint3,prismatic,0.001,")}
        edits["wrong base"] = ("model.toml", 'rpy = ["-pi/2", 0, 0]', 'rpy = ["pi/2", 0, 0]')
        return copied(folder, "stanford", *([edits[kind]] if kind in edits else []))

    @cache  # noqa: B019
    def document(self, kind: str) -> Any:
        """A report: of a robot that agrees, of one with a wrong number and its cause, of one without an engine, ..."""
        options = Options(
            samples=5,
            sources=() if kind == "small" else ("dh:pinocchio", "urdf:pinocchio"),
            workers=(("mine", ("/nonexistent",)),) if kind == "engine missing" else (),
        )
        return json.loads(to_json(crosscheck(load_model(self.model(kind)), options)))

    @cache  # noqa: B019
    def numbers(self) -> Any:
        """The accepted numbers of the small robot."""
        options = Options(samples=5, certify=False, explain=False)
        return json.loads(accepted_text(accepted_from(crosscheck(load_model(self.model("small")), options))))


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Reports:
    """Robot models and their reports."""
    return Reports(tmp_path_factory.mktemp("reports"))


@fuzz
@given(kind=st.sampled_from(KINDS), changes=edit_lists, damage=seldom_damaged, command=st.sampled_from(COMMANDS))
def test_a_damaged_report(kind: str, changes: list[Edit], damage: Damage, command: str, reports: Reports) -> None:
    numbers = command.startswith("accepted")
    document = reports.numbers() if numbers else reports.document(kind)
    name, small = document["robot"] if numbers else document["robot"]["name"], reports.model("small")
    with tempfile.TemporaryDirectory() as temporary:
        out, accepted = Path(temporary) / "out", Path(temporary) / "accepted"
        for folder in (out, accepted):
            folder.mkdir()
        path = (accepted if numbers else out) / f"{name}.json"
        put(path, json_text(edited(document, changes)), damage)
        run = (
            "run",
            str(small),
            "--out",
            str(out),
            "--accepted",
            str(accepted),
            "--samples",
            "5",
            "--no-certify",
            "--no-explain",
        )
        args = {
            "render": ("render", str(path), "--out", str(out / "new")),
            "accept": ("accept", str(reports.model(kind)), "--out", str(out), "--accepted", str(accepted)),
            "index": (*run, "--quiet"),
            "accepted numbers": run,
            "accepted numbers, strict": (*run, "--strict", "--json"),
        }
        check("report", args[command], what=f"{kind}, {command}: {changes} {damage}")
        assert {p.name for p in Path(temporary).iterdir()} <= {"out", "accepted"}
        shutil.rmtree(out)
