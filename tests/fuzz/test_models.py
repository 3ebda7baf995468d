"""Damaged robot model folders: read, shown, compared, identified, cross-checked."""

from __future__ import annotations

import copy
import tempfile
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tests.fuzz.command import check, fuzz
from tests.fuzz.damage import UNDAMAGED, Damage, damages
from tests.fuzz.models import FILES, RANDOM, ROBOTS, generated, packaged, written
from tests.fuzz.trees import Edit, edit_lists, edited

COMMANDS = (*["run"] * 3, "run and explain", "frames", "frames", "identify", "diff", "diff", "export-urdf")
QUICK = ("--no-certify", "--no-explain")

originals = st.sampled_from(ROBOTS).map(packaged) | st.integers(0, RANDOM - 1).map(generated)
# One file is edited, or one name in all of them; its bytes are damaged in one case of eight.
places = st.sampled_from(FILES)
damage_lists = st.sampled_from(range(8)).flatmap(
    lambda n: st.dictionaries(places, damages, min_size=1, max_size=1) if n == 7 else st.just({})
)


def changed(model: dict[str, Any], changes: list[tuple[str, Edit]]) -> Any:
    """A copy of a model with each edit made in its file; names are changed in all files."""
    model = copy.deepcopy(model)
    for name, edit in changes:
        if edit.action == "rename":
            model = edited(model, [edit])
        elif name in model:
            model[name] = edited(model[name], [edit])
    return model


@st.composite
def change_lists(draw: st.DrawFn) -> list[tuple[str, Edit]]:
    """Edits, each with the file it is made in."""
    return [(draw(places), edit) for edit in draw(edit_lists)]


@fuzz
@given(
    original=originals,
    changes=change_lists(),
    damage=damage_lists,
    command=st.sampled_from(COMMANDS),
    samples=st.sampled_from(["0", "5"]),
)
def test_a_damaged_model_folder(
    original: dict[str, Any], changes: list[tuple[str, Edit]], damage: dict[str, Damage], command: str, samples: str
) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        models, out, other = (Path(temporary) / name for name in ("models", "out", "original"))
        folder = models / "robot"
        for made in (folder, other):
            made.mkdir(parents=True)
        written(changed(original, changes), folder, damage)
        written(original, other, {})
        run = ("run", str(folder), "--out", str(out), "--accepted", str(out / "accepted"), "--samples", samples)
        args = {
            "run": (*run, *QUICK),
            "run and explain": run,
            "frames": ("frames", str(folder)),
            "identify": ("identify", str(folder), "--models", str(models)),
            "diff": ("diff", str(folder), str(other)),
            "export-urdf": ("export-urdf", str(folder)),
        }
        check("model folder", args[command], what=f"{changes} { {k: v for k, v in damage.items() if v != UNDAMAGED} }")
        assert {p.name for p in Path(temporary).iterdir()} <= {"models", "out", "original"}
