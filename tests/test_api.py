"""The Python API: the same answers as the command line, objects that print and can be asserted on, errors with their facts."""

from __future__ import annotations

import html
import inspect
import math
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import harness
from harness.description.locate import default_models_dir
from harness.description.model import RobotModel, load_table
from harness.engines.dh_numpy import DHNumpy
from harness.errors import DescriptionUnavailable
from tests.helpers import assert_placements_close, copied, tables_with_q

Cli = Callable[..., "subprocess.CompletedProcess[str]"]
UR5_URDF = "example-robot-data:robots/ur_description/urdf/ur5_robot.urdf"


def rows_of(model: RobotModel) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[row.a, row.alpha, row.d, row.theta] for row in model.table.rows])


@pytest.fixture(scope="module")
def shifted(models: dict[str, RobotModel]) -> harness.Difference:
    rows = rows_of(models["ur5"])
    rows[0, 2] += 0.000301
    return harness.diff("ur5", rows)


def test_every_public_name_is_there_and_documented() -> None:
    page = (default_models_dir().parent / "docs" / "api.md").read_text()
    for name in harness.__all__:
        assert inspect.getdoc(getattr(harness, name)), name
        assert re.search(rf"`(harness\.)?{name}\b", page), f"{name} is not in docs/api.md"
    assert set(harness.__all__) <= set(dir(harness))
    with pytest.raises(AttributeError, match="no attribute 'crosschek'"):
        _ = harness.crosschek


def test_importing_the_package_imports_nothing_else() -> None:
    code = "import sys; before = set(sys.modules); import harness; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    ours = {name for name in done.stdout.split() if name.startswith(("harness", "numpy", "pydantic", "click"))}
    assert ours == {"harness", "harness.version"}


def test_the_difference_says_which_number(shifted: harness.Difference) -> None:
    assert not shifted.same
    assert shifted.largest.position == pytest.approx(0.000301, abs=1e-12)
    assert shifted.bound is not None
    assert shifted.bound.position >= shifted.largest.position
    (cause,) = shifted.causes
    assert (cause.subject, cause.parameter, cause.unit) == ("shoulder_pan_joint", "d", "m")
    assert cause.size == pytest.approx(0.000301, abs=1e-12)
    assert "0.301 mm" in str(shifted)
    assert str(shifted).startswith("DIFFERENT ur5 and B: ")
    assert repr(shifted).startswith("<Difference DIFFERENT ur5 and B: ")
    assert "canonical standard DH: A = ur5, B = B" in shifted.report
    page = shifted._repr_html_()
    assert "<table>" in page
    assert html.escape(cause.text) in page


def test_the_command_line_prints_the_report(cli: Cli, models: dict[str, RobotModel]) -> None:
    """Column for column: only the spaces between columns may differ."""
    printed = cli("diff", "ur5", "ur10")
    found = harness.diff("ur5", "ur10")
    assert printed.returncode == found.exit_code == 1
    assert re.sub(r" +", " ", printed.stdout).split() == re.sub(r" +", " ", found.report).split()


@pytest.mark.parametrize(
    "given",
    [
        lambda model: model,
        lambda model: model.table,
        lambda model: model.folder,
        lambda model: str(model.folder / "dh.csv"),
        lambda model: (model.folder / "dh.csv").read_text(),
        rows_of,
        lambda model: rows_of(model).tolist(),
        lambda model: model.name,
    ],
    ids=["model", "table", "folder", "csv", "text", "array", "list", "name"],
)
def test_operands_of_every_kind(models: dict[str, RobotModel], given: Callable[[RobotModel], Any]) -> None:
    model = models["ur5"]
    assert harness.diff(model, given(model)).same
    assert harness.diff(given(model), model).same


def test_a_urdf_as_text_path_and_package(models: dict[str, RobotModel]) -> None:
    urdf = models["ur5"].urdf
    assert urdf is not None
    for operand in (urdf, urdf.text, UR5_URDF):
        assert harness.diff("ur5", operand, base="base", tip="tool0").same
        assert not harness.diff("ur5", operand, base=(None, "base_link"), tip=(None, "tool0")).same


@given(tables_with_q())
@settings(max_examples=25)
def test_forward_kinematics_is_that_of_the_engine(case: tuple[harness.DHTable, Any]) -> None:
    table, q = case
    expected = DHNumpy(table).placements(q, table.frames)
    assert_placements_close(harness.forward_kinematics(table, q, table.frames), expected, 0.0)
    assert_placements_close(harness.forward_kinematics(table, q), expected[:, -1], 0.0)
    assert_placements_close(harness.forward_kinematics(table, q[0]), expected[0, -1], 0.0)


@given(st.integers(0, 5), st.sampled_from([2, 0]), st.floats(1e-4, 1.0))
@settings(max_examples=10)
def test_one_length_is_named_whatever_it_is(joint: int, column: int, by: float) -> None:
    """A number of rows that is not that of the table: the largest discrepancy is its size, and it is among the causes."""
    model = harness.load_model("ur5")
    rows = rows_of(model)
    rows[joint, column] += by
    found = harness.diff(model, rows)
    assert not found.same
    assert found.largest.position == pytest.approx(by, rel=1e-6)
    assert found.explanation is not None
    sizes = [c.size for c, others in zip(found.causes, found.explanation.equivalents, strict=True) for c in (c, *others)]
    assert any(abs(size) == pytest.approx(by, rel=1e-6) for size in sizes)


def test_a_cross_check_reads_well(models: dict[str, RobotModel], tmp_path: Path) -> None:
    report = harness.crosscheck("sixr", sources=["dh:pinocchio"], samples=20, certify=False)
    assert report.passes
    assert report.settings.samples == 20
    assert str(report).splitlines()[0] == f"PASS {report.verdict.sentence}"
    assert "dh:pinocchio" in str(report)
    assert repr(report).startswith("<Report PASS sixr AGREES")
    assert "<table>" in report._repr_html_()
    paths = harness.write_report(report, tmp_path / "new")
    assert harness.read_report(paths[0]) == report


def test_a_disagreement_is_in_the_text(tmp_path: Path) -> None:
    folder = copied(tmp_path, "ur5", ("dh.csv", "0.089159", "0.08946"))
    report = harness.crosscheck(folder, sources=["urdf:pinocchio"], samples=20, certify=False)
    assert not report.passes
    assert "d of shoulder_pan_joint: 0.08946 m in dh.csv" in str(report)
    assert "0.301 mm" in str(report)


def test_one_source_may_be_named_alone() -> None:
    assert harness.crosscheck("sixr", sources="dh:pinocchio", samples=5, certify=False).passes


def test_a_session_keeps_engines_and_takes_options(tmp_path: Path) -> None:
    with harness.Session(harness.Options(sources=("dh:pinocchio",), samples=10, certify=False)) as session:
        first, second = (session.crosscheck(name) for name in ("sixr", "stanford"))
        more = session.crosscheck("sixr", options=harness.Options(sources=("dh:pinocchio",), samples=20, certify=False))
    assert first.passes
    assert second.passes
    assert (first.settings.samples, more.settings.samples) == (10, 20)


def test_a_strict_session_needs_its_numbers(tmp_path: Path) -> None:
    with harness.Session(harness.Options(strict=True)) as session, pytest.raises(harness.InputError, match="folder of accepted"):
        session.crosscheck("sixr")
    options = harness.Options(strict=True, accepted=tmp_path)
    with harness.Session(options) as session, pytest.raises(harness.InputError, match="nothing was accepted yet"):
        session.crosscheck("sixr")


def test_identify_and_derive(models: dict[str, RobotModel]) -> None:
    found = harness.identify(models["ur5"].table)
    assert found.same
    assert found.nearest is not None
    assert found.nearest.name == "ur5"
    assert "known table" in str(found)
    assert "same as nearest 'ur5'" in repr(found)
    assert "<table>" in found._repr_html_()
    urdf = models["ur5"].urdf
    assert urdf is not None
    derived = harness.derive_dh(urdf, base="base", tip="tool0")
    assert harness.diff(derived.table, "ur5").same
    assert "shoulder_pan_joint" in str(derived)
    assert harness.derive_dh(urdf.text, base="base", tip="tool0").table.joints == derived.table.joints


ROWS = [[0.1, 0.0, 0.0, 0.0]]
NO_OPERAND: Any = {"a": 1}
THREE: Any = ("a", "b", "c")
WRONG: Any = "modifed"


def table_of() -> harness.DHTable:
    return harness.load_model("ur5").table


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: harness.diff("ur55", ROWS), "no robot model 'ur55'; did you mean 'ur5'?"),
        (lambda: harness.diff("ur5", [[1, 2, 3]]), r"B: expected rows of a, alpha, d, theta, shape \(n, 4\), got shape \(1, 3\)"),
        (lambda: harness.diff("ur5", [[math.nan, 0, 0, 0]]), "B: expected finite numbers, got nan in row 0, column 0"),
        (lambda: harness.diff("ur5", NO_OPERAND), "B: expected a name, a path, text, a DHTable or rows of numbers, got dict"),
        (lambda: harness.diff("ur5", 3), "B: expected a name, a path, text, a DHTable or rows of numbers, got int"),
        (lambda: harness.diff("ur5", []), r"B: expected rows"),
        (lambda: harness.diff("ur5", "<robot"), "B:1"),
        (lambda: harness.diff("ur5", "joint,a\nj,1\n"), "B:1: column 'alpha' is missing"),
        (lambda: harness.diff("ur5", ROWS), "no two of one kind: ur5 has 6 joints"),
        (lambda: harness.diff("ur5", ROWS, base=THREE), "expected one value, or one for a and one for b, got 3"),
        (lambda: harness.diff("ur5", Path("no.urdf")), "no.urdf: no such file"),
        (
            lambda: harness.crosscheck("ur5", sources=["urdf:pinochio"]),
            "no source 'urdf:pinochio'; did you mean 'urdf:pin",
        ),
        (lambda: harness.crosscheck("ur5", samples=-1), "expected samples >= 0, got -1"),
        (lambda: harness.forward_kinematics(harness.load_model("ur5").table, [1, 2]), r"expected q of shape \(6,\) or \(N, 6\)"),
        (
            lambda: harness.forward_kinematics(harness.load_model("ur5").table, [0] * 6, ["7"]),
            "no DH frame '7'; one of base",
        ),
        (lambda: harness.read_report("no.json"), "no.json: no such file"),
        (lambda: harness.load_model("nothing"), "no robot model 'nothing'"),
        (lambda: harness.load_model(Path("nowhere")), "nowhere: no such robot model folder"),
        (lambda: harness.diff("ur5", ROWS, convention=WRONG), "convention: expected 'standard' or 'modified', got 'modifed'"),
        (lambda: harness.derive_dh(UR5_URDF, convention=WRONG), "convention: expected 'standard' or 'modified'"),
        (lambda: harness.diff("ur5", "ur5", tolerance=math.nan), "tolerance: expected a tolerance above 0 and finite, got nan"),
        (lambda: harness.diff("ur5", ":"), "expected PACKAGE:FILE.urdf, got ':'"),
        (lambda: harness.load_model(NO_OPERAND), "expected a name or a folder, got dict"),
        (lambda: harness.read_report(NO_OPERAND), "expected the path of a report's JSON, got dict"),
        (lambda: harness.derive_dh(NO_OPERAND), "expected a path, PACKAGE:FILE.urdf, .* got dict"),
        (lambda: harness.write_report(NO_OPERAND, "x"), "expected a Report, got dict"),
        (lambda: harness.Session(NO_OPERAND), "options: expected harness.Options, got dict"),
        (lambda: harness.Options(samples=WRONG), "samples: expected a whole number, got 'modifed'"),
        (lambda: harness.Options(certify=WRONG), "certify: expected True or False, got 'modifed'"),
        (lambda: harness.Options(limits=WRONG), "limits: expected harness.Limits, got 'modifed'"),
        (lambda: harness.Options(sources=WRONG), "sources: expected a tuple of source names, got 'modifed'"),
        (lambda: harness.forward_kinematics(NO_OPERAND, [0]), "expected a DHTable, got dict"),
        (lambda: harness.forward_kinematics(table_of(), [math.nan] * 6), "q: expected finite joint values, got nan at"),
        (lambda: harness.forward_kinematics(table_of(), WRONG), "q: expected joint values as numbers, got str"),
        (lambda: harness.forward_kinematics(table_of(), [1j] * 6), "q: expected real joint values"),
        (lambda: harness.forward_kinematics(table_of(), [0] * 6, WRONG), "frames: expected a sequence of labels"),
    ],
)
def test_errors_are_the_same_as_on_the_command_line(call: Callable[[], object], message: str) -> None:
    with pytest.raises(harness.InputError, match=message) as raised:
        call()
    assert isinstance(raised.value, harness.CrosscheckError)
    assert raised.value.problem
    assert "\n" not in str(raised.value)


def test_hostile_names_are_escaped(models: dict[str, RobotModel]) -> None:
    text = "joint,a,alpha,d,theta\n<script>x</script>,0.1,0,0,0\n"
    found = harness.diff(text, "joint,a,alpha,d,theta\n\x1b[31mj,0.2,0,0,0\n")
    assert "<script>" not in found._repr_html_()
    assert "\x1b" not in found._repr_html_() + found.report + str(found)


def test_a_model_whose_urdf_is_not_installed_is_still_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    def not_installed(folder: Path) -> RobotModel:
        raise DescriptionUnavailable("example-robot-data is not installed; pip install example-robot-data")

    monkeypatch.setattr("harness.difference.reading.load_model", not_installed)
    monkeypatch.setattr("harness.api.load_folder", not_installed)
    table = load_table(default_models_dir() / "ur5")[1]
    assert harness.diff("ur5", [[r.a, r.alpha, r.d, r.theta] for r in table.rows]).same
    with pytest.raises(harness.CrosscheckError, match="pip install example-robot-data"):
        harness.load_model("ur5")


def test_the_signatures_are_small() -> None:
    for name in (
        "crosscheck",
        "diff",
        "identify",
        "derive_dh",
        "forward_kinematics",
        "load_model",
        "read_report",
        "write_report",
    ):
        assert len(inspect.signature(getattr(harness, name)).parameters) <= 8, name
