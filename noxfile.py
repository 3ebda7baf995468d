"""Every step of CI, to be run at home.

`nox -s crosscheck`, `tests`, `fuzz`, `browser`, `mutate`, `engines`, `cpp`, `matrix`, `lint`, `types`, `bench`, `guards`,
`audit`, `lock`.

What a session installs is in a lock file of its own, `locks/SESSION.txt`, with the hash of every file; `nox -s lock` writes
them anew from pyproject.toml and constraints.txt. torch is the exception: its CPU build may be a file of this machine.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
import subprocess
import sys
from pathlib import Path

import nox

nox.needs_version = ">=2024.3.2"
nox.options.default_venv_backend = "virtualenv"  # pip: the pinned CPU build of torch is found by pip alone
nox.options.sessions = ["lint", "types", "tests", "crosscheck"]

NEWEST_PIN = "4.1.0"
# The wheels of pin 3.9.0 are built against libraries that its metadata leaves open.
PINS = {"3.9.0": ["cmeel-urdfdom<5", "cmeel-tinyxml2<11"], NEWEST_PIN: []}
PYTHONS = ("3.10", "3.11", "3.12", "3.13")
WITH_TORCH = "3.11"  # the Python that constraints.txt has a CPU build of torch for

CONSTRAINTS = "--constraint=constraints.txt"
LOCKED_PYTHON = (3, 11)  # the lock files are for this one; other Pythons install by constraints.txt
WITHOUT_HASH = "torch"
BUILD = ["hatchling", "editables"]  # what builds the project, without an environment of its own

PIN = f"pin=={NEWEST_PIN}"
# What each lock file is made of. `.` is the project with its extras.
NEEDS = {
    "nox": ["nox"],
    "lint": ["ruff"],
    "types": ["mypy", "nox", "types-psutil", ".[test]"],
    "crosscheck": [PIN, ".[all]"],
    "tests": [PIN, ".[all,test]"],
    "browser": [PIN, ".[pinocchio,yourdfpy,robots,view,browser,test]"],
    "cpp": [PIN, ".[pinocchio,robots,test]"],
    "audit": ["pip-audit"],
}


def install(session: nox.Session, lock: str, editable: bool = False) -> None:
    """Install what a lock file names, by its hashes, then the project; by constraints.txt alone on another Python."""
    needs, path = NEEDS[lock], Path("locks") / f"{lock}.txt"
    project = next((need for need in needs if need.startswith(".")), "")
    flag = ["--editable"] if editable else []
    if sys.version_info[:2] != LOCKED_PYTHON:
        others = [need for need in needs if need != project]
        session.install(CONSTRAINTS, *others, *([*flag, project] if project else []))
        return
    text = path.read_text(encoding="utf-8")
    if local := re.search(rf"^# without a hash: ({WITHOUT_HASH}==\S+)$", text, re.MULTILINE):
        session.install("--no-deps", local[1])
    session.install("--no-deps", "--require-hashes", "--requirement", str(path))
    if project:
        session.install("--no-deps", "--no-build-isolation", *flag, ".")


def found_pythons() -> list[str]:
    """Interpreters of the test matrix that are there: on the PATH, or installed under pyenv."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found = []
    for version in PYTHONS:
        candidates = [str(p) for p in sorted(pyenv.glob(f"{version}.*/bin/python{version}"))]
        path = shutil.which(f"python{version}")
        # A pyenv shim is on the PATH for every version, and fails for those that are not switched on.
        if path and ".pyenv" not in path:
            candidates.append(path)
        if f"{sys.version_info.major}.{sys.version_info.minor}" == version:
            candidates.insert(0, sys.executable)
        found += candidates[:1]
    return found


# Strictly against what is on file; each engine is tested against its own description at other configurations every time.
STRICT = ["--strict", "--probe-seed", "fresh"]


@nox.session
def crosscheck(session: nox.Session) -> None:
    """Cross-check all robots with all engines, strictly against reports/accepted/; reports go to reports/."""
    install(session, "crosscheck")
    # With other arguments the numbers cannot be compared with those on file.
    session.run("crosscheck", "run", "--samples", "10000", "--out", "reports", *(session.posargs or STRICT))


@nox.session
def tests(session: nox.Session) -> None:
    """The test suite on this Python with the newest pin, a process a core; a file's tests share one, and its workers."""
    install(session, "tests", editable=True)
    session.run("pytest", "--numprocesses", "auto", "--dist", "loadfile", *session.posargs)


@nox.session
def fuzz(session: nox.Session) -> None:
    """Damaged model folders, URDFs and reports, 3 500 each, through the command. The seed is printed, and can be given again.

    `nox -s fuzz -- --hypothesis-seed=1` for one that is known; FUZZ=200 for another number of each.
    """
    install(session, "tests", editable=True)
    # Other inputs each time: `tests` has 200 of each, always the same.
    seed = [] if any("seed" in word for word in session.posargs) else [f"--hypothesis-seed={secrets.randbelow(2**32)}"]
    session.run("pytest", "-q", "tests/fuzz", *seed, *session.posargs, env={"CROSSCHECK_FUZZ": os.environ.get("FUZZ", "3500")})


@nox.session
def mutate(session: nox.Session) -> None:
    """How good the gate is: faults put into all robots on purpose, caught or not, and their causes named or not."""
    install(session, "crosscheck")
    session.run("crosscheck", "mutate", "--out", "reports", *session.posargs)


@nox.session
def engines(session: nox.Session) -> None:
    """Every engine there is, in its own environment: install them, try each case by case, cross-check all robots."""
    install(session, "tests", editable=True)
    # 3: one could not be installed here. The cases below then fail for it, the table of the run tells why.
    session.run("crosscheck", "engines", "install", "--all", CONSTRAINTS, success_codes=[0, 3])
    session.run("pytest", "-q", "tests/engines/test_engines.py", env={"CROSSCHECK_TESTS_ENGINES": "all"})
    session.run("crosscheck", "run", "--all-engines", "--out", "reports", *session.posargs)


@nox.session
def browser(session: nox.Session) -> None:
    """Reports and the view in a real browser: Chromium on the PATH, or the one that CHROMIUM names."""
    chromium = (
        os.environ.get("CHROMIUM")
        or shutil.which("chromium")
        or shutil.which("chromium-browser")
        or shutil.which("google-chrome")
    )
    if chromium is None:
        session.error("no Chromium found; install it (Debian: apt install chromium), or say where it is: CHROMIUM=...")
    install(session, "browser", editable=True)
    # Those outside tests/browser need viser, which no other session installs; here none of them is skipped.
    trust = "tests/run/test_trust.py::test_other_commands_start_nothing_either"
    env = {"CROSSCHECK_TESTS_BROWSER": str(chromium)}
    session.run("pytest", "tests/browser", "tests/view", trust, *session.posargs, env=env)


@nox.session
def cpp(session: nox.Session) -> None:
    """The C++ controller: build it, run its tests, cross-check it. Needs CMake, a C++17 compiler, Eigen and GoogleTest."""
    install(session, "cpp")
    build = Path(session.create_tmp()).resolve() / "build"
    source = "examples/cpp_controller"
    session.run("cmake", "-S", source, "-B", str(build), external=True)
    session.run("cmake", "--build", str(build), "--parallel", "2", external=True)
    session.run("ctest", "--test-dir", str(build), "--output-on-failure", external=True)
    session.run("crosscheck", "worker-check", "--", str(build / "fk_worker"), "{model}/dh.csv")
    session.run("pytest", "-q", f"{source}/tests/test_crosscheck.py", env={"FK_WORKER": str(build / "fk_worker")})


@nox.session(python=found_pythons())
@nox.parametrize("pin", list(PINS))
def matrix(session: nox.Session, pin: str) -> None:
    """The test suite on every Python found, with the oldest and the newest pin supported."""
    extras, env = "all,test", {}
    if f"python{WITH_TORCH}" not in str(session.python) and f"/{WITH_TORCH}" not in str(session.python):
        extras = "pinocchio,yourdfpy,robots,test"
        env = {"CROSSCHECK_TESTS_WITHOUT": "urdf:pytorch-kinematics"}
    session.install(CONSTRAINTS, f"pin=={pin}", *PINS[pin], "--editable", f".[{extras}]")
    session.run("pytest", "-q", *session.posargs, env=env)


@nox.session
def lint(session: nox.Session) -> None:
    """Style: ruff's checks and its formatting."""
    install(session, "lint")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")


@nox.session
def types(session: nox.Session) -> None:
    """Types: mypy, strict."""
    install(session, "types")
    session.run("mypy")


@nox.session
def bench(session: nox.Session) -> None:
    """Speed and memory as ratios within one run, the start, the theorem, 10 000 random bounds, derive-dh on every chain."""
    install(session, "tests")
    session.run("python", "bench/bench.py")
    session.run("python", "bench/startup.py")
    session.run("python", "bench/engines.py")
    session.run("python", "bench/theorem.py")
    session.run("python", "bench/soundness.py", *(session.posargs or ["10000"]))
    session.run("python", "bench/derive_all.py")


@nox.session
def guards(session: nox.Session) -> None:
    """Take each guard out once, in a copy of the tree, and see its test fail."""
    install(session, "tests", editable=True)
    session.run("python", "bench/guards.py", *session.posargs)


@nox.session
def audit(session: nox.Session) -> None:
    """Known vulnerabilities in what the lock files name. Without the database nothing is audited, and that is said.

    AUDIT=required makes that a failure: for a machine that must reach it.
    """
    install(session, "audit")
    for path in sorted(Path("locks").glob("*.txt")):
        done = subprocess.run(
            ["pip-audit", "--require-hashes", "--disable-pip", "--requirement", str(path)],
            env={**os.environ, "PATH": os.pathsep.join([*(session.bin_paths or []), os.environ["PATH"]])},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        output = done.stdout + done.stderr
        # A package that is not found in the database was not audited, whatever the summary says.
        if re.search(r"could not be audited|ConnectionError|ServiceError|Max retries|timed out|SSLError|ProxyError", output):
            text = f"the database of vulnerabilities cannot be reached: {path} and those after it were not audited"
            if os.environ.get("AUDIT") == "required":
                session.error(text)
            session.skip(text)
        session.log(f"{path}: {output.strip()}")
        if done.returncode:
            session.error(f"{path} names packages with known vulnerabilities")


@nox.session
def lock(session: nox.Session) -> None:
    """Write the lock files anew: versions as pip chooses them under constraints.txt, hashes of all their files."""
    if sys.version_info[:2] != LOCKED_PYTHON:
        session.error(f"lock files are made by Python {'.'.join(map(str, LOCKED_PYTHON))}")
    session.install("uv")
    folder = Path(session.create_tmp()).resolve()
    chosen = session.posargs or list(NEEDS)
    for name in chosen:
        report, pinned = folder / "report.json", folder / f"{name}.in"
        needs = [*NEEDS[name], *(BUILD if any(need.startswith(".") for need in NEEDS[name]) else [])]
        session.run("pip", "install", "--dry-run", "--ignore-installed", "--quiet", "--report", str(report), CONSTRAINTS, *needs)
        packages = [entry["metadata"] for entry in json.loads(report.read_text())["install"]]
        lines = sorted(f"{p['name'].lower()}=={p['version']}" for p in packages if p["name"] != "fk-crosscheck")
        local = [line for line in lines if line.startswith(f"{WITHOUT_HASH}==")]
        pinned.write_text("\n".join(line for line in lines if line not in local) + "\n")
        options = ["--no-deps", "--generate-hashes", "--no-header", "--no-annotate", "--quiet", "--python-version", "3.11"]
        session.run("uv", "pip", "compile", *options, "--output-file", str(folder / "out.txt"), str(pinned), silent=True)
        # A build of this machine, 2.13.0+cpu, is any 2.13.0 elsewhere.
        exempt = "".join(f"# without a hash: {line.partition('+')[0]}\n" for line in local)
        head = f"# Written by `nox -s lock`; not to be edited.\n{exempt}"
        path = Path("locks") / f"{name}.txt"
        path.parent.mkdir(exist_ok=True)
        path.write_text(head + (folder / "out.txt").read_text())
        session.log(f"{path}: {len(lines)} packages")
