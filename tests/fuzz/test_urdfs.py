"""Damaged URDFs: the frame tree and its lint, comparison, identification, the table derived from it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.fuzz.command import check, fuzz
from tests.fuzz.damage import Damage, put, seldom_damaged
from tests.fuzz.trees import Edit, edit_lists, edited
from tests.fuzz.urdfs import FILES, RANDOM, links, real, tree, xml_text

# `derive-dh` cross-checks what it has found, and takes the longest.
COMMANDS = (*["frames"] * 4, *["diff"] * 3, "diff with the original", "identify", "derive-dh")

originals = st.sampled_from(FILES).map(real) | st.integers(0, RANDOM - 1).map(tree)


@pytest.fixture(scope="module")
def few_models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of robot models with one that has no table, so that `identify` looks at the packaged tables alone."""
    folder = tmp_path_factory.mktemp("models")
    (folder / "none").mkdir()
    (folder / "none" / "model.toml").touch()
    return folder


@fuzz
@given(data=st.data(), changes=edit_lists, damage=seldom_damaged, command=st.sampled_from(COMMANDS))
def test_a_damaged_urdf(data: st.DataObject, changes: list[Edit], damage: Damage, command: str, few_models: Path) -> None:
    original = data.draw(originals)
    damaged = edited(original, changes)
    _, leaves = links(damaged)
    number = data.draw(st.integers(0, 99))
    tips = [f"--tip={leaves[number % len(leaves)]}"] if leaves and number % 4 else []  # most trees have several leaves
    with tempfile.TemporaryDirectory() as temporary:
        path, other = Path(temporary) / "arm.urdf", Path(temporary) / "original.urdf"
        put(path, xml_text(damaged), damage)
        put(other, xml_text(original))
        args = {
            "frames": ("frames", str(path)),
            "diff": ("diff", str(path), str(path), *tips),
            "diff with the original": ("diff", str(other), str(path), *tips),
            "identify": ("identify", str(path), "--models", str(few_models), *tips),
            "derive-dh": ("derive-dh", str(path), *tips),
        }
        check("URDF", args[command], what=f"{changes} {damage}")
        assert {p.name for p in Path(temporary).iterdir()} <= {"arm.urdf", "original.urdf"}
