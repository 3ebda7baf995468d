"""No program of a model folder starts before the user has said so, and what is pasted into a shell runs nothing else."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import harness
from harness.cli.main import main
from harness.cli.shared import complete_robots, robot_words
from harness.description.locate import packaged_file
from harness.errors import DescriptionUnavailable, command_line
from harness.report.text import pasteable
from harness.run import trust
from harness.run.plan import programs

Cli = Callable[..., tuple[int, str]]

SCRIPT = "from pathlib import Path\nPath({trace!r}).touch()\n"
FAST = ("--samples", "5", "--no-explain", "--no-certify")


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder of its own for each test."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv("CROSSCHECK_TRUST", raising=False)
    return tmp_path / "data"


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """The file that the stranger's program leaves when it was started."""
    return tmp_path / "started"


@pytest.fixture
def stranger(copy_model: Callable[..., Path], trace: Path) -> Path:
    """A model folder whose model.toml names a script beside it."""
    command = f'command = ["{sys.executable}", "{{model}}/tool.py", "a b"]'
    folder = copy_model("sixr")
    toml = folder / "model.toml"
    own = toml.read_text().partition("[[source]]")[0]
    toml.write_text(f'{own}[[source]]\nname = "dh:sympy"\n\n[[source]]\nname = "tool"\nrequired = false\n{command}\n')
    (folder / "tool.py").write_text(SCRIPT.format(trace=str(trace)))
    return folder


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Cli:
    """Run `crosscheck ARGS` here, without a terminal, in tmp_path; returns exit code and stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*args: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["crosscheck", *args])
        streams = sys.stdout, sys.stderr
        try:
            with pytest.raises(SystemExit) as end:
                main()
        finally:
            sys.stdout, sys.stderr = streams  # the command puts its own in their place
        return int(end.value.code or 0), capfd.readouterr().err

    return run


def asked_of(folder: Path) -> list[trust.Program]:
    return programs(harness.load_model(folder), harness.Options())


def mark_of(folder: Path) -> str | None:
    (program,) = asked_of(folder)
    return trust.fingerprint(program)


def at_terminal(answer: str, *args: str, cwd: Path) -> tuple[int, str]:
    """Run `crosscheck ARGS` with a terminal for stdin and stderr, give one answer, and return exit code and stderr."""
    ours, theirs = pty.openpty()
    try:
        command = [sys.executable, "-m", "harness", *args]
        process = subprocess.Popen(command, cwd=cwd, stdin=theirs, stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        text, given, end = b"", False, time.monotonic() + 120
        try:
            while time.monotonic() < end:
                if select.select([ours], [], [], 0.2)[0]:
                    try:
                        piece = os.read(ours, 4096)
                    except OSError:  # the other end is closed
                        break
                    if not piece:
                        break
                    text += piece
                elif process.poll() is not None:
                    break
                if b"[y/N]" in text and not given:
                    os.write(ours, answer.encode())
                    given = True
            return process.wait(30), text.decode(errors="replace")
        finally:
            process.kill()
            process.wait()
    finally:
        os.close(ours)


def test_nothing_starts_without_a_word(cli: Cli, stranger: Path, trace: Path) -> None:
    code, text = cli("run", str(stranger), *FAST)
    assert code == 2
    assert not trace.exists()
    (line,) = text.splitlines()
    assert f"{stranger}/model.toml: source[1].command" in line
    assert f"{stranger}/tool.py 'a b'" in line
    assert f"crosscheck run {stranger}" in line
    assert line.endswith(" --trust")


@pytest.mark.parametrize("way", ["option", "environment"])
def test_a_word_starts_it_each_time_anew(
    cli: Cli, stranger: Path, trace: Path, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if way == "option":
        cli("run", str(stranger), "--trust", *FAST)
    else:
        monkeypatch.setenv("CROSSCHECK_TRUST", "1")
        cli("run", str(stranger), *FAST)
    assert trace.exists()
    trace.unlink()
    monkeypatch.setenv("CROSSCHECK_TRUST", "0")
    assert cli("run", str(stranger), *FAST)[0] == 2
    assert not trace.exists()


def test_other_robots_are_still_checked(cli: Cli, stranger: Path, tmp_path: Path) -> None:
    assert cli("run", str(stranger), "ur5", *FAST)[0] == 2
    assert (tmp_path / "reports" / "ur5.json").exists()
    assert not (tmp_path / "reports" / "sixr.json").exists()


def test_sources_that_leave_it_out_need_no_word(cli: Cli, stranger: Path, trace: Path) -> None:
    assert cli("run", str(stranger), "--source", "dh:sympy", *FAST)[0] == 0
    assert not trace.exists()


def test_a_worker_of_the_command_line_is_the_users_own(cli: Cli, stranger: Path, trace: Path) -> None:
    worker = f"mine={sys.executable} {{model}}/tool.py"
    code, _ = cli("run", str(stranger), "--worker", worker, "--source", "dh:sympy", *FAST)
    assert code == 3  # it is no worker, but it was started
    assert trace.exists()


@pytest.mark.parametrize("command", ["view", "mutate"])
def test_other_commands_start_nothing_either(cli: Cli, stranger: Path, trace: Path, command: str) -> None:
    if command == "view":
        pytest.importorskip("viser")
    more = ("--source", "urdf:tool") if command == "mutate" else ()
    code, text = cli(command, str(stranger), *more)
    assert code == 2
    assert not trace.exists()
    if command == "view":
        assert text.endswith(f"crosscheck view {stranger} --trust\n")


def test_a_terminal_is_asked_and_the_answer_is_remembered(
    stranger: Path, trace: Path, tmp_path: Path, data: Path, cli: Cli
) -> None:
    code, text = at_terminal("n\n", "run", str(stranger), *FAST, cwd=tmp_path)
    assert code == 2
    assert f"{stranger}/tool.py 'a b'" in text
    assert str(stranger / "model.toml") in text
    assert not trace.exists()

    code, text = at_terminal("y\n", "run", str(stranger), *FAST, cwd=tmp_path)
    assert code == 0
    assert trace.exists()
    (kept,) = (data / "fk-crosscheck" / "allowed").iterdir()
    assert kept.stat().st_mode & 0o777 == 0o600

    assert cli("run", str(stranger), *FAST)[0] == 0  # not asked again, nor is a terminal needed
    (stranger / "dh.csv").write_text((stranger / "dh.csv").read_text() + "\n")
    assert cli("run", str(stranger), *FAST)[0] == 0  # the data of the model are no program
    (stranger / "tool.py").write_text((stranger / "tool.py").read_text() + "# changed\n")
    assert cli("run", str(stranger), *FAST)[0] == 2


@pytest.mark.parametrize("silent", ["--json", "--quiet"])
def test_who_reads_nothing_is_not_asked(stranger: Path, tmp_path: Path, silent: str, trace: Path) -> None:
    code, text = at_terminal("y\n", "run", str(stranger), silent, *FAST, cwd=tmp_path)
    assert code == 2
    assert "[y/N]" not in text
    assert not trace.exists()


def test_the_api_never_asks(stranger: Path, trace: Path) -> None:
    with pytest.raises(harness.UntrustedError) as caught:
        harness.crosscheck(stranger, samples=5)
    assert isinstance(caught.value, harness.InputError)
    assert caught.value.command == (sys.executable, f"{stranger}/tool.py", "a b")
    assert caught.value.where == str(stranger / "model.toml")
    assert not trace.exists()
    (program,) = asked_of(stranger)
    mark = trust.fingerprint(program)
    assert mark
    trust.remember(mark, program)
    with pytest.raises(harness.UntrustedError):  # what the command remembers is no word to the API
        harness.crosscheck(stranger, samples=5)
    options = harness.Options(samples=5, trust=True, certify=False, explain=False)
    with harness.Session(options) as session:
        session.crosscheck(stranger)
    assert trace.exists()


def test_models_that_come_with_the_package_need_no_word(monkeypatch: pytest.MonkeyPatch, stranger: Path) -> None:
    monkeypatch.setattr("harness.description.locate.default_models_dir", lambda: stranger.parent)
    assert asked_of(stranger) == []


def test_what_changes_the_fingerprint(stranger: Path, tmp_path: Path) -> None:
    (stranger / "other.sh").write_text("echo\n")
    (stranger / "link").symlink_to("other.sh")
    (tmp_path / "outside.py").write_text("1\n")
    marks = [mark_of(stranger)]

    def changed() -> bool:
        marks.append(mark_of(stranger))
        return marks[-1] not in marks[:-1] and marks[-1] is not None

    (stranger / "numpy.py").write_text("evil")  # a module beside the script is imported by it
    assert changed()
    (stranger / "other.sh").write_text("echo 1\n")
    assert changed()
    (stranger / "link").unlink()
    (stranger / "link").symlink_to("tool.py")
    assert changed()
    for name in ("one", "two"):  # a link to a folder: what is in it is not looked at
        (tmp_path / name).mkdir()
        (stranger / "folder").unlink(missing_ok=True)
        (stranger / "folder").symlink_to(f"../../{name}")
        assert changed()
    (stranger / "__pycache__").mkdir()
    (stranger / "__pycache__" / "numpy.cpython-311.pyc").write_bytes(b"1")
    assert changed()
    toml = stranger / "model.toml"
    toml.write_text(toml.read_text().replace('"a b"', '"a c"'))
    assert changed()
    toml.write_text(toml.read_text().replace('"a c"', '"../../outside.py"'))
    assert changed()
    (tmp_path / "outside.py").write_text("2\n")
    assert changed()
    toml.write_text(toml.read_text().replace("../../outside.py", "{model}/dh.csv"))
    assert changed()
    (stranger / "dh.csv").write_text((stranger / "dh.csv").read_text() + "\n")  # named by the command: not only data
    assert changed()


def test_what_does_not_change_the_fingerprint(stranger: Path, tmp_path: Path) -> None:
    before = mark_of(stranger)
    assert before
    (stranger / ".git").mkdir()
    (stranger / ".git" / "index").write_text("1")
    (stranger / "frames.toml").write_text((stranger / "frames.toml").read_text() + "\n")
    assert mark_of(stranger) == before
    moved = stranger.rename(stranger.with_name("elsewhere"))
    assert mark_of(moved) == before


def test_what_cannot_be_looked_at_is_not_remembered(stranger: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(stranger / "pipe")  # is not opened: that would wait for ever
    assert mark_of(stranger)
    monkeypatch.setattr(trust, "MOST_BYTES", 10)
    assert mark_of(stranger) is None
    monkeypatch.undo()
    monkeypatch.setattr(trust, "MOST_FILES", 1)
    assert mark_of(stranger) is None


def test_a_mark_of_another_kind_is_no_word(stranger: Path, data: Path) -> None:
    mark = mark_of(stranger)
    assert mark
    folder = trust.allowed_folder()
    folder.mkdir(parents=True)
    (folder / mark).symlink_to("/etc/passwd")
    assert not trust.is_remembered(mark)
    (folder / mark).unlink()
    (folder / mark).mkdir()
    assert not trust.is_remembered(mark)


def test_a_yes_that_cannot_be_kept_holds_once(stranger: Path, trace: Path, tmp_path: Path, data: Path) -> None:
    data.write_text("no folder")
    code, text = at_terminal("yes\n", "run", str(stranger), *FAST, cwd=tmp_path)
    assert code == 0
    assert "could not be kept" in text
    assert trace.exists()


HOSTILE = (
    "a b",
    "it's",
    "$(touch x)",
    "`touch x`",
    "; touch x",
    "-x",
    "--trust",
    "new\nline",
    "\x1b[2J",
    "\u202egnp",
    "back\\",
    "'\n; touch x; '",
    "*",
    "~",
    "é",
    "",
)


@given(st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])), max_size=4))
@example(list(HOSTILE))
def test_a_pasted_line_is_taken_apart_into_its_words(words: list[str]) -> None:
    line = command_line(["printf", "%s\\0", "", *words])
    assert line.isprintable()
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, timeout=20, check=False, env={**os.environ, "LC_ALL": "C.UTF-8"}
    )
    assert done.stdout.decode().split("\0")[:-1] == ["", *words]


@given(st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])), max_size=4))
@example(list(HOSTILE))
def test_a_line_of_ours_stays_as_it_is(words: list[str]) -> None:
    line = command_line(["crosscheck", "run", *words])
    assert pasteable(line) == line


@pytest.mark.parametrize(
    "text",
    [
        "touch started",
        "crosscheck run x; touch started",
        "crosscheck run $(touch started)",
        "crosscheck run x\ntouch started",
        'crosscheck run "$(touch started)"',
        "crosscheck run $'a\\' '; touch started #'",
        "crosscheck run 'a' & touch started",
        "crosscheckers",
    ],
)
@pytest.mark.parametrize("shell", ["bash", "sh"])
def test_the_line_of_a_strangers_report_runs_nothing(text: str, tmp_path: Path, shell: str) -> None:
    line = pasteable(text)
    assert shlex.split(line) == [text]
    subprocess.run([shell, "-c", line], cwd=tmp_path, capture_output=True, timeout=20, check=False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["-$(touch started) it's\nx", "--help", "ur5"])
def test_the_way_out_works_whatever_the_folder_is_called(
    name: str, stranger: Path, tmp_path: Path, trace: Path, cli: Cli
) -> None:
    """The line that the refusal gives is pasted into a shell, and starts that program and nothing else."""
    stranger.rename(tmp_path / name)
    given = os.path.join(".", name)
    _, refused = cli("run", given, *FAST)
    line = refused.split("if you trust it: ")[1].strip()
    shim = tmp_path / "bin" / "crosscheck"
    shim.parent.mkdir()
    shim.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m harness "$@"\n')
    shim.chmod(0o755)
    env = {**os.environ, "PATH": f"{shim.parent}:{os.environ['PATH']}"}
    before = set(tmp_path.iterdir())
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert set(tmp_path.iterdir()) - before == {trace}


def test_a_name_that_means_something_to_a_shell_is_not_completed(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("sixr")
    for name in ("$(touch x)", "-x", "a b"):
        with contextlib.suppress(FileExistsError):
            (folder.parent / name).mkdir()
        (folder.parent / name / "model.toml").write_text("")
    context = click.Context(click.Command("run"))
    context.params["models"] = folder.parent
    assert [item.value for item in complete_robots(context, click.Argument(["robots"]), "")] == ["sixr"]


def test_a_robot_is_named_so_that_it_is_found() -> None:
    assert robot_words(Path("models/a b"), Path("models")) == ["a b", "--models", "models"]
    assert robot_words(Path("models/-x"), Path("models")) == ["./models/-x"]
    assert robot_words(Path("-x"), None) == ["./-x"]
    assert robot_words(Path("../x"), None) == ["../x"]
    assert robot_words(Path("/x/y"), None) == ["/x/y"]


@pytest.mark.parametrize(
    "package", ["no-such-package; touch x", "--index-url=http://x.invalid", "git+https://x.invalid/a", "./a"]
)
def test_only_the_name_of_a_package_is_offered_for_pasting(package: str) -> None:
    with pytest.raises(DescriptionUnavailable) as caught:
        packaged_file(package, "x.urdf")
    assert "pip install" not in str(caught.value)
    with pytest.raises(DescriptionUnavailable, match=r"; pip install no-such-package$"):
        packaged_file("no-such-package", "x.urdf")
