"""Suggestions: as good as a full search where names are few, and of bounded cost where a file holds thousands."""

from __future__ import annotations

import difflib
import time
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from harness.description.urdf_file import parse_urdf
from harness.description.urdf_lint import lint
from harness.errors import InputError, Suggestions, nearest

WORDS = st.sampled_from(["shoulder", "elbow", "wrist_1", "wrist_2", "tool0", "base_link", "panda_link3", "flange", "forearm"])
NAMES = st.tuples(WORDS, st.sampled_from(["", "_x", "_link"]), st.integers(0, 12).map(str)).map("".join)


@given(st.text("abelrstw_123", max_size=14) | NAMES, st.lists(NAMES, max_size=100))
def test_the_name_suggested_is_the_one_most_alike(name: str, known: list[str]) -> None:
    best = difflib.get_close_matches(name, sorted(set(known)), n=1, cutoff=0.6)
    text = nearest(name, known)
    assert text == f"did you mean {best[0]!r}?" if best else not text.startswith("did you mean")


def test_a_suggestion_takes_milliseconds_whatever_the_names() -> None:
    for name, known in (
        ("lnk_0650", [f"link_{i:04d}" for i in range(100_000)]),
        ("ab" * 50_000, ["ba" * 50_000 + str(i) for i in range(200)]),
        ("ab" * 40, ["ba" * 40 + str(i) for i in range(5000)]),
    ):
        started = time.process_time()
        text = nearest(name, known)
        assert time.process_time() - started < 0.5
        assert len(text) < 250


def test_1300_misspelt_parents_and_leaders() -> None:
    links = "".join(f"<link name='link_{i:04d}'/>" for i in range(1301))
    joints = "".join(
        f"<joint name='joint_{i:04d}' type='revolute'><parent link='lnk_{i:04d}'/><child link='link_{i + 1:04d}'/>"
        f"<axis xyz='0 0 1'/><mimic joint='jont_{i:04d}'/></joint>"
        for i in range(1300)
    )
    urdf = parse_urdf(f"<robot name='r'>{links}{joints}</robot>".encode(), Path("r.urdf"))
    started = time.process_time()
    messages = [finding.message for finding in lint(urdf)]
    assert time.process_time() - started < 2.0
    # One message names the first of the links that do not exist; each leader has a message of its own.
    assert sum("did you mean" in message for message in messages) == 1 + Suggestions.MOST
    assert any("does not exist; 1300 names are known" in message for message in messages)


def test_long_names_are_cut_in_messages() -> None:
    error = InputError(f"no link {'x' * 5000!r}", key="y" * 5000, hint=nearest("z" * 5000, ["z" * 6000]))
    assert len(str(error)) < 600
    assert "xxx... (5002 letters)" in str(error)
    assert "(6000 letters)" in str(error)
    short = f"no link {'x' * 300!r}"
    assert str(InputError(short)) == short
