"""Broken files of every kind: a model loads or is refused in one line, and nothing else happens."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.description.locate import default_models_dir
from harness.description.model import load_model
from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import lint
from harness.errors import CrosscheckError, UrdfError

FILES = ("dh.csv", "model.toml", "frames.toml", "configurations.toml")
PIECES = st.sampled_from(
    [
        *("", '"', "[", "]", "{", "}", "=", ",", "#", "\n", "\x00", "\x1b", "-", "<", ">", "&amp;", "é", "\ud7ff"),
        *("nan", "inf", "1e999", "pi/0", "true", "9" * 400, "0 0 1", "fixed", "revolute", "tool0", "base"),
        *("[[frame]]\n", "[joints]\n", "<link/>", "<joint name='x'/>"),
    ]
)


def mutated(text: str, edits: list[tuple[float, int, str]]) -> str:
    """`text` with each edit (where 0...1, how much is cut, what is put there)."""
    for where, cut, piece in edits:
        i = int(where * len(text))
        text = text[:i] + piece + text[i + cut :]
    return text


EDITS = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), PIECES), min_size=1, max_size=4)


@pytest.mark.parametrize("robot", ["stanford", "humanoid_arm"])
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from([*FILES, "urdf"]), EDITS)
def test_a_damaged_model_file(robot: str, name: str, edits: list[tuple[float, int, str]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        models, urdf = Path(folder) / "models", Path(folder) / "urdf"
        shutil.copytree(default_models_dir() / robot, models / robot)
        shutil.copytree(default_models_dir().parent / "urdf", urdf)
        path = urdf / f"{robot}.urdf" if name == "urdf" else models / robot / name
        path.write_text(mutated(path.read_text(encoding="utf-8"), edits), encoding="utf-8")
        try:
            model = load_model(models / robot)
        except CrosscheckError as error:
            assert "\n" not in str(error)  # noqa: PT017 - either outcome is right, a third is not
        else:
            assert model.configurations.fixed_q.shape[1] == len(model.table.joints)


@settings(max_examples=300)
@given(st.binary(max_size=200) | EDITS.map(lambda e: mutated("<robot name='r'><link name='a'/></robot>", e).encode()))
def test_any_bytes_as_a_urdf(data: bytes) -> None:
    try:
        urdf = parse_urdf(data, Path("x.urdf"))
    except UrdfError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert urdf.links
        assert all(finding.message for finding in lint(urdf))
