"""Imports run one way: cli -> crosscheck -> {analysis, engines, report} -> description -> {se3, errors}."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

import harness

ROOT = Path(harness.__file__).parent

# A module may import from its own layer (same package) and from those listed.
BASE = {"harness", "harness.se3", "harness.errors"}
ALLOWED = {
    "description": {"harness.description", *BASE},
    "report": {"harness.report", *BASE},
    "comparison": {"harness.comparison", *BASE},
    "certificate": {"harness.certificate", "harness.description", *BASE},
    "cause": {"harness.cause", "harness.kinematics", "harness.description", *BASE},
    "workers": {"harness.workers", "harness.engines", "harness.description", *BASE},
}


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("harness"):
            found.add(node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.startswith("harness")}
    return found


@pytest.mark.parametrize("layer", sorted(ALLOWED))
def test_arrows_run_one_way(layer: str) -> None:
    for path in (ROOT / layer).glob("*.py"):
        for name in imports(path):
            package = ".".join(name.split(".")[:2])
            assert package in ALLOWED[layer], f"{path.name} imports {name}"


@pytest.mark.parametrize("name", ["se3.py", "errors.py"])
def test_the_ground_floor_imports_nothing_of_ours(name: str) -> None:
    assert imports(ROOT / name) <= {"harness.se3", "harness.errors"} - {f"harness.{name.removesuffix('.py')}"} - {
        "harness.errors"
    }


def test_there_is_no_cycle() -> None:
    graph = {
        "harness." + ".".join(p.relative_to(ROOT).with_suffix("").parts): imports(p)
        for p in ROOT.rglob("*.py")
        if p.name != "__main__.py"
    }
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, f"import cycle: {' -> '.join([*path, name])}"
        if name not in done:
            for other in graph.get(name, ()):
                visit(other, (*path, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def test_engine_modules_do_not_import_their_library() -> None:
    """Listing the engines must work, and be quick, with none of them installed."""
    heavy = {"pinocchio", "torch", "pytorch_kinematics", "yourdfpy", "mujoco", "pydrake", "urchin", "kinpy", "ikpy", "placo"}
    heavy |= {"frax", "jax", "idyntree", "sympy", "roboticstoolbox", "spatialmath", "PyKDL"}
    for path in ROOT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not heavy & {name.split(".")[0] for name in names}, path


def closure(start: Path) -> set[Path]:
    """A module and everything of ours that it imports, directly or not."""
    found, todo = set(), [start]
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            files = (ROOT.parent / Path(*name.split(".")).with_suffix(".py") for name in imports(path))
            todo += [file for file in files if file.is_file()]
    return found


ADAPTERS = sorted(p for p in (ROOT / "engines").glob("*.py") if p.name.startswith(("dh_", "urdf_")))


@pytest.mark.parametrize("path", [*ADAPTERS, ROOT / "workers" / "worker.py"], ids=lambda p: p.stem)
def test_a_worker_needs_numpy_and_the_library_alone(path: Path) -> None:
    """Its environment may be the system's Python, or one that holds versions of its own of whatever the harness needs."""
    allowed = {*sys.stdlib_module_names, "numpy", "harness"}
    for module in closure(path):
        for node in ast.walk(ast.parse(module.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert {name.split(".")[0] for name in names} <= allowed, f"{path.name} needs {names} of {module.name}"


def test_modules_hold_one_idea() -> None:
    long = {path.name: n for path in ROOT.rglob("*.py") if (n := len(path.read_text().splitlines())) > 300}
    assert not long
