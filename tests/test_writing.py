"""Files written whole or not at all, several together or none: killed, failing or raced at every single step."""

from __future__ import annotations

import errno
import os
import signal
import time
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from harness import writing
from harness.writing import clean, locked, replace_file, replace_together

NAMES = ("ur5.json", "ur5.html", "ur5.md", "ur5.junit.xml")
STEPS = ("open", "write", "fsync", "link", "symlink", "replace", "mkdir", "unlink", "rmdir")
OLD, NEW = (dict.fromkeys(NAMES, text) for text in ("old", "new"))


@pytest.fixture(autouse=True)
def _quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """A killed process loses nothing that it has written; waiting for the disk is for a loss of power."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


def shown(folder: Path) -> dict[str, str]:
    """What a reader sees who opens the files by their names."""
    return {name: (folder / name).read_text() for name in NAMES if (folder / name).exists()}


def tidy(folder: Path) -> bool:
    """Whether there are plain files alone, and none is hidden."""
    return all(p.is_file() and not p.is_symlink() and not p.name.startswith(".") for p in folder.iterdir())


def at_step(monkeypatch: pytest.MonkeyPatch, step: int, do: Callable[[], Any], again: bool) -> list[int]:
    """Let the `step`th call that changes something end in `do()`; again: and all later ones. Returns the count, which grows."""
    count = [0]

    def patched(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            count[0] += 1
            if count[0] == step or (again and count[0] > step):
                do()
            return real(*args, **kwargs)

        return call

    for name in STEPS:
        monkeypatch.setattr(os, name, patched(getattr(os, name)))
    return count


def killed_at(folder: Path, step: int) -> bool:
    """Write the new files in a process that is killed at a step. Returns whether it got to the end."""
    child = os.fork()
    if child == 0:
        at_step(pytest.MonkeyPatch(), step, lambda: os.kill(os.getpid(), signal.SIGKILL), again=False)
        replace_together(folder, "ur5", NEW)
        os._exit(0)
    return os.waitpid(child, 0)[1] == 0


@pytest.mark.parametrize("before", [OLD, {}, {"ur5.json": "old"}], ids=["old", "nothing", "one"])
def test_killed_at_any_step_they_are_all_old_or_all_new(tmp_path: Path, before: dict[str, str]) -> None:
    outcomes = []
    for step in range(1, 200):
        folder = tmp_path / str(step)
        folder.mkdir()
        for name, text in before.items():
            (folder / name).write_text(text)
        ended = killed_at(folder, step)
        seen = shown(folder)
        assert seen in (before, NEW), f"killed at step {step}"
        outcomes.append(seen == NEW)
        clean(folder)
        assert shown(folder) == seen, f"cleaned after step {step}"
        assert tidy(folder)
        if ended:
            break
    assert ended
    assert outcomes == sorted(outcomes), "once new, they stay new"
    assert {True, False} == {*outcomes}


@pytest.mark.parametrize("again", [False, True], ids=["once", "from then on"])
def test_a_full_disk_at_any_step_leaves_all_old_or_all_new(tmp_path: Path, again: bool) -> None:
    def full() -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    for step in range(1, 200):
        folder = tmp_path / str(step)
        folder.mkdir()
        replace_together(folder, "ur5", OLD)
        with pytest.MonkeyPatch.context() as patch:
            count = at_step(patch, step, full, again)
            try:
                replace_together(folder, "ur5", NEW)
                expected = NEW
            except OSError:
                expected = OLD
        assert shown(folder) == expected, f"full at step {step}"
        clean(folder)
        assert shown(folder) == expected
        assert tidy(folder)
        if count[0] < step:
            break
    assert expected == NEW


def test_after_a_failure_the_next_write_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace_together(tmp_path, "ur5", OLD)
    assert not killed_at(tmp_path, 30)
    replace_together(tmp_path, "ur5", NEW)
    assert shown(tmp_path) == NEW
    assert tidy(tmp_path)


def test_a_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    folder, outside = tmp_path / "reports", tmp_path / "precious"
    folder.mkdir()
    outside.write_text("mine")
    (folder / "ur5.json").symlink_to("../precious")
    (folder / "ur5.md").symlink_to("nowhere")
    # A failure puts the links back as they were.
    (folder / "ur5.html").mkdir()
    with pytest.raises(OSError, match=r"ur5\.html is there, and no file"):
        replace_together(folder, "ur5", NEW)
    assert os.readlink(folder / "ur5.json") == "../precious"
    assert os.readlink(folder / "ur5.md") == "nowhere"
    (folder / "ur5.html").rmdir()
    replace_together(folder, "ur5", NEW)
    assert shown(folder) == NEW
    assert tidy(folder)
    assert outside.read_text() == "mine"


def test_links_come_back_after_a_kill(tmp_path: Path) -> None:
    for step in range(1, 100):
        folder = tmp_path / str(step)
        folder.mkdir()
        (folder / "elsewhere").write_text("old")
        for name in NAMES:
            (folder / name).symlink_to("elsewhere")
        ended = killed_at(folder, step)
        assert shown(folder) in (OLD, NEW)
        clean(folder)
        assert shown(folder) in (OLD, NEW)
        if shown(folder) == OLD:
            assert [os.readlink(folder / name) for name in NAMES] == ["elsewhere"] * 4
        if ended:
            break
    assert ended


def test_nobody_can_put_a_link_where_a_temporary_file_will_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("secrets.token_hex", lambda n: "0" * 2 * n)  # even if the name could be foreseen
    (tmp_path / f".x.json.{'0' * 16}.crosscheck-tmp").symlink_to("victim")
    (tmp_path / "victim").write_text("mine")
    with pytest.raises(FileExistsError):
        replace_file(tmp_path / "x.json", "new")
    assert (tmp_path / "victim").read_text() == "mine"
    assert not (tmp_path / "x.json").exists()


def test_temporary_names_cannot_be_foreseen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names: list[str] = []
    real = os.replace

    def noting(a: Path, b: Path) -> None:
        names.append(Path(a).name)
        real(a, b)

    monkeypatch.setattr(os, "replace", noting)
    for _ in range(2):
        replace_file(tmp_path / "x.json", "text")
    assert len({*names}) == 2
    assert not any(str(os.getpid()) in name.replace(".crosscheck-tmp", "").split(".") for name in names)


def test_new_files_have_the_rights_of_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        replace_file(tmp_path / "one", "text")
        replace_together(tmp_path, "ur5", NEW)
        replace_file(tmp_path / "secret", "text", 0o600)
    finally:
        os.umask(before)
    assert {(tmp_path / name).stat().st_mode & 0o777 for name in ("one", *NAMES)} == {0o640}
    assert (tmp_path / "secret").stat().st_mode & 0o777 == 0o600


def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    hidden = f".x.{'a' * 16}"
    (tmp_path / ".x.json.123.tmp").write_text("somebody's")
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "file").write_text("mine")
    (tmp_path / f"{hidden}.crosscheck-tmp").symlink_to("precious/file")
    (tmp_path / f"{hidden}.crosscheck-swap").mkdir()
    (tmp_path / f"{hidden}.crosscheck-swap" / "thesis.txt").write_text("mine")
    (tmp_path / f".y.{'b' * 16}.crosscheck-swap").mkdir()
    (tmp_path / f".y.{'b' * 16}.crosscheck-swap" / "old").symlink_to("../precious")
    (tmp_path / f".z.{'c' * 16}.crosscheck-tmp").write_text("left over")
    clean(tmp_path)
    assert (tmp_path / "precious" / "file").read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        f"{hidden}.crosscheck-swap", f"{hidden}.crosscheck-tmp", ".x.json.123.tmp", "precious",
    ]  # fmt: skip


def test_a_writer_at_work_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = tmp_path / f".x.{'a' * 16}.crosscheck-tmp"
    with locked(tmp_path):
        temporary.write_text("half of it")
        monkeypatch.setattr(writing, "PATIENCE", 0.05)
        start = time.monotonic()
        with pytest.raises(OSError, match="another program has kept the folder"):
            clean(tmp_path)
        assert time.monotonic() - start < 5.0
        assert temporary.exists()
    clean(tmp_path)
    assert not temporary.exists()


def test_without_locks_only_old_leftovers_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", none)
    young, old = (tmp_path / f".{name}.{'a' * 16}.crosscheck-tmp" for name in ("young", "old"))
    young.write_text("")
    old.write_text("")
    os.utime(old, (0, 0))
    replace_together(tmp_path, "ur5", NEW)
    assert shown(tmp_path) == NEW
    assert young.exists()
    assert not old.exists()


@pytest.mark.parametrize("fails", [None, "ur5.md"])
def test_without_links_they_are_renamed_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: str | None) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    replace_together(tmp_path, "ur5", {name: "old" for name in NAMES if name != "ur5.html"})
    before = shown(tmp_path)
    real = os.replace

    def failing(a: Path, b: Path) -> None:
        if fails and (a.parent.name, b.name) == ("new", fails):
            raise OSError(errno.ENOSPC, "No space left on device")
        real(a, b)

    monkeypatch.setattr(os, "symlink", none)
    monkeypatch.setattr(os, "link", none)
    monkeypatch.setattr(os, "replace", failing)
    if fails:
        with pytest.raises(OSError, match="No space left"):
            replace_together(tmp_path, "ur5", NEW)
    else:
        replace_together(tmp_path, "ur5", NEW)
    assert shown(tmp_path) == (before if fails else NEW)
    assert tidy(tmp_path)


def _write_often(folder: Path, text: str) -> None:
    for i in range(15):
        replace_together(folder, "ur5", dict.fromkeys(NAMES, f"{text}{i}"))
        replace_file(folder / "index.html", text)


def test_two_at_once(tmp_path: Path) -> None:
    context = get_context("fork")
    writers = [context.Process(target=_write_often, args=(tmp_path, text)) for text in "ab"]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(60)
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert len({*shown(tmp_path).values()}) == 1
    assert len(shown(tmp_path)) == 4
    assert tidy(tmp_path)
