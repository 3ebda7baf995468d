"""The command as its users call it: in a process of its own, exit codes, one line for wrong input, no traceback."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.report.document import Report
from tests.helpers import remade

Cli = Callable[..., "subprocess.CompletedProcess[str]"]
FAST = ("--source", "dh:pinocchio", "--source", "urdf:pinocchio", "--samples", "50")


def one_line_error(result: subprocess.CompletedProcess[str], code: int, message: str) -> None:
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr + result.stdout
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert re.search(message, lines[0]), lines[0]


def test_run_one_robot(cli: Cli, tmp_path: Path) -> None:
    result = cli("run", "ur5", *FAST)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert "PASS ur5 AGREES" in result.stdout
    assert "1 of 1 robots agree; reports in reports" in result.stdout
    written = {p.name for p in (tmp_path / "reports").iterdir()}
    assert written == {"ur5.json", "ur5.html", "ur5.md", "ur5.junit.xml", "index.html", "report.schema.json"}


def test_run_all_robots_of_a_folder(cli: Cli, copy_model: Callable[..., Path]) -> None:
    good = copy_model("sixr")
    copy_model("ur3", ("dh.csv", "0.1519", "0.1520"))
    copy_model("ur5", ("dh.csv", "revolute", "revolut"))
    result = cli("run", "--models", str(good.parent), *FAST)
    assert result.returncode == 1  # a disagreement found stays found
    assert "PASS sixr" in result.stdout
    assert "FAIL ur3" in result.stdout
    assert "1 of 3 robots agree" in result.stdout
    assert re.fullmatch(r"error: .*ur5/dh.csv:2: unknown joint type 'revolut'.*\n", result.stderr)


def test_a_folder_instead_of_a_name(cli: Cli, copy_model: Callable[..., Path]) -> None:
    result = cli("run", str(copy_model("sixr")), *FAST)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_command_in_the_report_reproduces_it(cli: Cli, copy_model: Callable[..., Path], tmp_path: Path) -> None:
    folder = copy_model("ur5", ("dh.csv", "0.089159", "0.089460"))
    cli("run", "ur5", "--models", str(folder.parent), *FAST, "--seed", "3")
    report = Report.model_validate_json((tmp_path / "reports" / "ur5.json").read_text())
    words = report.settings.command.split()
    assert words[:2] == ["crosscheck", "run"]
    again = cli(*words[1:], "--json")
    assert again.returncode == 1
    same = {"environment": report.environment}
    assert remade(Report.model_validate_json(again.stdout), **same) == report


def test_without_a_certificate(cli: Cli, tmp_path: Path) -> None:
    with_it, without = cli("run", "ur5", *FAST), cli("run", "ur5", *FAST, "--no-certify")
    assert (with_it.returncode, without.returncode) == (0, 0)
    assert "at every configuration (proven)" in with_it.stdout
    assert "what their own description says" in with_it.stdout
    assert "every configuration" not in without.stdout
    report = Report.model_validate_json((tmp_path / "reports" / "ur5.json").read_text())
    assert report.settings.command.endswith("--no-certify")
    assert all(source.certificate is None for source in report.sources)


def test_a_run_adds_to_the_summary_of_the_job(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "summary.md").write_text("before\n")
    cli("run", "sixr", *FAST, "--no-certify", GITHUB_STEP_SUMMARY=str(tmp_path / "summary.md"))
    written = (tmp_path / "reports" / "sixr.md").read_text()
    assert (tmp_path / "summary.md").read_text() == "before\n" + written + "\n"


def test_json_and_quiet(cli: Cli) -> None:
    result = cli("run", "ur5", "sixr", *FAST, "--json")
    documents = [Report.model_validate_json(line) for line in result.stdout.splitlines()]
    assert [d.robot.name for d in documents] == ["ur5", "sixr"]
    quiet = cli("run", "ur5", *FAST, "--quiet")
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("run", "ur55"), r"no robot model 'ur55'; did you mean 'ur5'\?"),
        (("run", "ur5", "--models", "nowhere"), "nowhere: no such folder of robot models"),
        (("run", "ur5", "--source", "urdf:pinochio"), r"no source 'urdf:pinochio'; did you mean 'urdf:pinocchio'\?"),
        (("run", "ur5", "--reference", "numpy"), "no source 'numpy'"),
        (("run", "ur5", "--samples", "many"), "'many' is not a valid integer"),
        (("run", "ur5", "--samples", "-1"), "expected samples >= 0, got -1"),
        (("run", "ur5", "--sampels", "1"), "No such option.*--sampels"),
        (("runn",), "No such command 'runn'"),
        (("frames", "ur55"), "no robot model 'ur55'"),
        (("frames", "nowhere.urdf"), "nowhere.urdf: no such file"),
        (("render", "nowhere.json"), "nowhere.json: no such file"),
        (("completion", "tcsh"), "'tcsh' is not one of"),
    ],
)
def test_wrong_usage(cli: Cli, args: tuple[str, ...], message: str) -> None:
    one_line_error(cli(*args), 2, message)


BOMB = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"><link name="x"/></robot>'
MANY = "<robot name='r'>" + "".join(f"<link name='l{i}'/>" for i in range(10_000)) + "</robot>"
CYCLE = (
    "<robot name='r'><link name='root'/><link name='a'/><link name='b'/>"
    "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
    "<joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint></robot>"
)


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("ur5e.urdf", "<robot", "ur5e.urdf:1: not well-formed XML"),
        ("ur5e.urdf", BOMB, "ur5e.urdf.*entity"),
        (
            "ur5e.urdf",
            '<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot name="r"><link name="x"/></robot>',
            "not allowed in a URDF",
        ),
        ("ur5e.urdf", MANY, "expected at most 5000 links"),
        ("ur5e.urdf", CYCLE, "hang on a cycle: a, b"),
        ("dh.csv", "joint,a,alpha,d\nx,nan,0,0\n", r"dh.csv:2: column 'a': expected a finite number, got 'nan'"),
        ("dh.csv", "joint,a,alpha,d\nx,0,0,inf\n", r"dh.csv:2: column 'd': expected a finite number, got 'inf'"),
        ("configurations.toml", '[[configuration]]\nname = "x"\nunit = "rad"\nq = [0, 0]\n', "expected 6 values .* got 2"),
        (
            "frames.toml",
            '[[frame]]\nname = "base"\ndh = 0\nurdf = "bass"\n',
            r"no link 'bass' in ur5e.urdf; did you mean 'base'\?",
        ),
    ],
)
def test_wrong_input(cli: Cli, copy_model: Callable[..., Path], tmp_path: Path, file: str, text: str, message: str) -> None:
    folder = copy_model("ur5e", (file, "", text))
    (tmp_path / "reports").mkdir()
    (tmp_path / "reports" / "ur5e.json").write_text("an earlier report")
    one_line_error(cli("run", "ur5e", "--models", str(folder.parent), "--quiet"), 2, message)
    assert (tmp_path / "reports" / "ur5e.json").read_text() == "an earlier report"


def test_a_urdf_package_that_is_not_installed(cli: Cli, copy_model: Callable[..., Path]) -> None:
    folder = copy_model("ur5", ("model.toml", 'package = "example-robot-data"', 'package = "no-such-robots"'))
    result = cli("run", "ur5", "--models", str(folder.parent), "--quiet")
    one_line_error(result, 3, "no-such-robots is not installed; pip install no-such-robots")


def test_an_unwritable_output_folder(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file, not a folder")
    one_line_error(cli("run", "ur5", "--out", "taken"), 2, "taken: --out: cannot write reports here: .*; choose another --out")
    one_line_error(cli("run", "ur5", "--out", "/proc/nowhere"), 2, "cannot write reports here")


def test_ctrl_c_leaves_earlier_reports_whole(cli: Cli, tmp_path: Path) -> None:
    assert cli("run", "ur5", *FAST, "--quiet").returncode == 0
    before = {p.name: p.read_bytes() for p in (tmp_path / "reports").iterdir()}
    process = subprocess.Popen(
        [sys.executable, "-m", "harness", "run", "ur5", "--samples", "100000000", *FAST[:4]],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        time.sleep(3)
        assert process.poll() is None, "it ended before it could be interrupted"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == 130
    assert err.strip() == "interrupted: reports written before are unchanged"
    assert "Traceback" not in out
    assert {p.name: p.read_bytes() for p in (tmp_path / "reports").iterdir()} == before


def on_a_terminal(tmp_path: Path, *args: str, **env: str) -> str:
    """What a terminal shows: stdout and stderr on a pseudo-terminal."""
    ours, theirs = pty.openpty()
    clean = {k: v for k, v in os.environ.items() if k not in ("CI", "NO_COLOR", "FORCE_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "harness", *args], cwd=tmp_path, env={**clean, "TERM": "xterm-256color", **env},
        stdin=theirs, stdout=theirs, stderr=theirs, close_fds=True,
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    try:
        while True:
            try:
                data = os.read(ours, 65536)
            except OSError:
                break
            if not data:
                break
            shown += data
        process.wait(timeout=60)
    finally:
        process.kill()
        os.close(ours)
    return shown.decode(errors="replace")


def test_colours_and_progress_only_where_they_belong(cli: Cli, tmp_path: Path) -> None:
    args = ("run", "sixr", "--source", "urdf:pinocchio", "--samples", "30000")
    shown = on_a_terminal(tmp_path, *args)
    assert "\x1b[1;32mPASS" in shown
    assert "/30014" in shown  # the progress bar
    assert "\x1b[1;32m" not in on_a_terminal(tmp_path, *args, NO_COLOR="1")
    assert "/30014" not in on_a_terminal(tmp_path, *args, CI="true")
    piped = cli(*args)
    assert "\x1b" not in piped.stdout + piped.stderr
    assert "/30014" not in piped.stdout + piped.stderr


def test_frames(cli: Cli, tmp_path: Path) -> None:
    robot = cli("frames", "ur5e")
    assert robot.returncode == 0
    for text in (
        "ur5e, standard DH",
        "shoulder_pan_joint: revolute, axis [0, 0, 1]",
        "tool0  [tool0 = DH frame 6]",
        "base_link  [base_link = DH frame 0 via base, declared offset]",
        "1.570796327 is pi/2 cut short",
    ):
        assert text in robot.stdout
    panda = cli("frames", "panda")
    assert "mimics 1 * panda_finger_joint1 + 0" in panda.stdout
    assert "[panda_link3 = DH frame 3]" in panda.stdout
    (tmp_path / "cycle.urdf").write_text(CYCLE)
    cycle = cli("frames", "cycle.urdf")
    assert cycle.returncode == 2
    assert "error" in cycle.stdout
    assert "cycle" in cycle.stdout


def test_engines(cli: Cli) -> None:
    result = cli("engines")
    assert result.returncode == 0
    for text in (
        "dh:numpy built in",
        "dh:pinocchio pin ",
        "urdf:yourdfpy yourdfpy ",
        "the travel of a prismatic joint is multiplied",
    ):
        assert text in result.stdout


def test_render(cli: Cli, tmp_path: Path) -> None:
    cli("run", "ur5", *FAST, "--quiet")
    result = cli("render", "reports/ur5.json", "--out", "again")
    assert result.returncode == 0
    for name in ("ur5.html", "ur5.md", "ur5.junit.xml"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "reports" / name).read_bytes()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("[]", "expected a document with"),
        (
            '{"format": "fk-crosscheck report", "version": "9.0"}',
            "expected report version 1.4, got '9.0'; run the cross-check again",
        ),
        ('{"format": "fk-crosscheck report", "version": "1.4"}', "robot: not a report: Field required"),
    ],
)
def test_render_what_is_no_report(cli: Cli, tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "x.json").write_text(text)
    one_line_error(cli("render", "x.json"), 2, message)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts(cli: Cli, shell: str) -> None:
    script = cli("completion", shell)
    assert script.returncode == 0
    assert "_CROSSCHECK_COMPLETE" in script.stdout


def test_completion_knows_robots_and_sources(cli: Cli) -> None:
    shell = {"_CROSSCHECK_COMPLETE": "bash_complete"}
    command = [sys.executable, "-c", "from harness.cli.main import cli; cli(prog_name='crosscheck')"]
    for words, cword, expected in (
        ("crosscheck run ur", "2", "ur5e"),
        ("crosscheck run ur5 --source urdf:p", "4", "urdf:pinocchio"),
    ):
        env = {**os.environ, **shell, "COMP_WORDS": words, "COMP_CWORD": cword}
        result = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=False)
        assert expected in result.stdout


def test_help_and_version(cli: Cli) -> None:
    assert "Cross-validate" in cli("--help").stdout
    assert cli("--version").stdout.startswith("crosscheck, version ")
    assert cli().returncode in (0, 2)


def test_a_third_partys_engine_joins_through_its_entry_point(cli: Cli, tmp_path: Path) -> None:
    """Nothing of this project is touched: a distribution with an entry point is enough, and a broken one harms nobody."""
    site = tmp_path / "site"
    info = site / "acme_fk-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-fk\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[fk_crosscheck.engines]\ndh-acme = acme_fk:AcmeFK\ndh-bad = acme_nowhere:Bad\n")
    (site / "acme_fk.py").write_text(
        "from harness.engines.dh_numpy import DHNumpy\n\n\nclass AcmeFK(DHNumpy):\n"
        "    source = 'dh:acme'\n    requirements = ('acme-fk>=1',)\n"
    )
    path = {"PYTHONPATH": str(site)}
    listed = cli("engines", **path)
    assert "dh:acme acme-fk 1.0" in listed.stdout
    assert "dh:bad broken: entry point acme_nowhere:Bad: ModuleNotFoundError" in listed.stdout
    result = cli("run", "ur5", "--source", "dh:acme", "--samples", "10", "--json", **path)
    assert result.returncode == 0
    assert json.loads(result.stdout)["environment"]["versions"]["dh:acme"]["acme-fk"] == "1.0"
    broken = cli("run", "ur5", "--source", "dh:bad", "--samples", "10", **path)
    assert broken.returncode == 3
    assert "dh:bad is required and not run: entry point acme_nowhere:Bad" in broken.stdout
