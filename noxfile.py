"""Every step of CI, to be run at home.

`nox -s crosscheck`, `tests`, `browser`, `mutate`, `engines`, `cpp`, `matrix`, `lint`, `types`, `bench`.
"""

from __future__ import annotations

import os
import shutil
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


@nox.session
def crosscheck(session: nox.Session) -> None:
    """Cross-check all robots with all engines, strictly against reports/accepted/; reports go to reports/."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", ".[all]")
    # With other arguments the numbers cannot be compared with those on file.
    session.run("crosscheck", "run", "--samples", "10000", "--out", "reports", *(session.posargs or ["--strict"]))


@nox.session
def tests(session: nox.Session) -> None:
    """The test suite on this Python with the newest pin."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", "--editable", ".[all,test]")
    session.run("pytest", *session.posargs)


@nox.session
def mutate(session: nox.Session) -> None:
    """How good the gate is: faults put into all robots on purpose, caught or not, and their causes named or not."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", ".[all]")
    session.run("crosscheck", "mutate", "--out", "reports", *session.posargs)


@nox.session
def engines(session: nox.Session) -> None:
    """Every engine there is, in its own environment: install them, try each case by case, cross-check all robots."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", "--editable", ".[all,test]")
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
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", "--editable", ".[pinocchio,yourdfpy,robots,view,browser,test]")
    session.run("pytest", "tests/browser", *session.posargs, env={"CROSSCHECK_TESTS_BROWSER": str(chromium)})


@nox.session
def cpp(session: nox.Session) -> None:
    """The C++ controller: build it, run its tests, cross-check it. Needs CMake, a C++17 compiler, Eigen and GoogleTest."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", ".[pinocchio,robots,test]")
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
    session.install(CONSTRAINTS, "ruff")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")


@nox.session
def types(session: nox.Session) -> None:
    """Types: mypy, strict."""
    session.install(CONSTRAINTS, "mypy", "nox", "types-psutil", ".[test]")
    session.run("mypy")


@nox.session
def bench(session: nox.Session) -> None:
    """Speed and memory as ratios within one run, the start, 10 000 random certificates, derive-dh on every packaged chain."""
    session.install(CONSTRAINTS, f"pin=={NEWEST_PIN}", ".[all,test]")
    session.run("python", "bench/bench.py")
    session.run("python", "bench/startup.py")
    session.run("python", "bench/engines.py")
    session.run("python", "bench/soundness.py", *(session.posargs or ["10000"]))
    session.run("python", "bench/derive_all.py")
