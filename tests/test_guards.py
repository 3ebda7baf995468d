"""The table of bench/guards.py: every text is still there, once, and so are the tests. `nox -s guards` takes the guards out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from harness.reading import parsed_toml

ROOT = Path(__file__).parent.parent
TABLE = ROOT / "bench" / "guards.toml"
GUARDS: list[dict[str, Any]] = parsed_toml(TABLE.read_text(), TABLE)["guard"]


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: f"{guard['item']}: {guard['name']}")
def test_a_guard_can_be_taken_out(guard: dict[str, Any]) -> None:
    text = (ROOT / guard["file"]).read_text()
    assert text.count(guard["old"]) == 1
    compile(text.replace(guard["old"], guard["new"]), guard["file"], "exec")
    assert guard["new"] != guard["old"]
    assert guard["tests"]
    for test in guard["tests"]:
        path, _, name = test.partition("::")
        wanted = rf"^def {name.partition('[')[0] or 'test_.*'}\("
        assert re.search(wanted, (ROOT / path).read_text(), re.MULTILINE), test


def test_names_are_unique_and_items_are_known() -> None:
    names = [guard["name"] for guard in GUARDS]
    assert len({*names}) == len(names)
    assert {guard["item"] for guard in GUARDS} == {1, 2, 3, 4, 5, 7, 8}
