"""The house: which folder may import which, and how large a module and a function may grow.

FLOORS is the plan, from the top down. A folder may import itself, what its row names, and GROUND.
CONTRIBUTING.md shows the same table; a test below holds one to the other.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

import harness

ROOT = Path(harness.__file__).parent
GROUND = {"se3", "errors", "version", "reading", "writing", "kernels", "digits"}

GROUND_IMPORTS = {"reading.py": {"harness.errors"}, "digits.py": {"harness.se3"}}

FLOORS: dict[str, set[str]] = {
    "cli": {
        "api", "mutation", "view", "convert", "difference", "verdict", "run", "workers", "engines", "rendering", "report",
        "description",
    },
    "api": {"convert", "difference", "verdict", "run", "engines", "rendering", "report", "description"},
    "mutation": {"verdict", "run", "workers", "cause", "kinematics", "engines", "rendering", "report", "description"},
    "view": {"run", "workers", "kinematics", "rendering", "report", "description"},
    "convert": {"verdict", "run", "kinematics", "engines", "report", "description"},
    "verdict": {"run", "workers", "cause", "theorem", "kinematics", "comparison", "engines", "report", "description"},
    "run": {"workers", "cause", "theorem", "kinematics", "comparison", "engines", "description"},
    "difference": {"workers", "cause", "theorem", "kinematics", "report", "description"},
    "workers": {"engines", "description"},
    "cause": {"kinematics", "description"},
    "theorem": {"description"},
    "kinematics": {"description"},
    "comparison": set(),
    "engines": {"description"},
    "rendering": {"report"},
    "report": set(),
    "description": set(),
}  # fmt: skip

LONGEST_MODULE, LONGEST_FUNCTION, MOST_PARAMETERS = 300, 60, 8

MODULES = sorted(p for p in ROOT.rglob("*.py") if "_data" not in p.parts)


def room_of(module: str) -> str:
    """The room a dotted name is in: `run` for harness.run.plan, `se3` for harness.se3."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "harness"


def imports(path: Path) -> set[str]:
    """Modules of ours that a file imports, by dotted name."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "harness":
            found |= {f"harness.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("harness."):
            found.add(node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.startswith("harness")}
    return {name for name in found if (ROOT / room_of(name)).is_dir() or (ROOT / f"{room_of(name)}.py").is_file()}


def files_of(room: str) -> list[Path]:
    """The modules of a folder, or the one of that name."""
    return sorted((ROOT / room).rglob("*.py")) or [ROOT / f"{room}.py"]


def is_lazy(path: Path) -> bool:
    """The package itself and its start: what they hand on is imported when it is asked for."""
    return path.parent == ROOT and path.name in ("__init__.py", "__main__.py")


def test_every_folder_has_a_floor() -> None:
    folders = {p.parent.name for p in ROOT.glob("*/*.py")}
    modules = {p.stem for p in ROOT.glob("*.py") if not p.name.startswith("__")}
    assert folders | modules == {*FLOORS, *GROUND}


@pytest.mark.parametrize("room", FLOORS)
def test_arrows_run_one_way(room: str) -> None:
    allowed = {room, *FLOORS[room], *GROUND}
    for path in files_of(room):
        for name in imports(path):
            assert room_of(name) in allowed, f"{room}/{path.name} imports {name}: {room} may import {sorted(allowed)}"


def test_the_floors_have_no_circle() -> None:
    below: dict[str, set[str]] = {}
    for room in reversed(FLOORS):
        missing = FLOORS[room] - {*below}
        assert not missing, f"{room} may import {sorted(missing)}, which stand above it in the table"
        below[room] = FLOORS[room]


@pytest.mark.parametrize("name", [f"{name}.py" for name in sorted(GROUND)])
def test_the_ground_floor_imports_nothing_else_of_ours(name: str) -> None:
    assert imports(ROOT / name) == GROUND_IMPORTS.get(name, set())


def test_there_is_no_cycle() -> None:
    graph = {"harness." + ".".join(p.relative_to(ROOT).with_suffix("").parts): imports(p) for p in MODULES if not is_lazy(p)}
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
    for path in MODULES:
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


@pytest.mark.parametrize("path", [*ADAPTERS, ROOT / "workers" / "worker.py", ROOT / "__init__.py"], ids=lambda p: p.stem)
def test_a_worker_needs_numpy_and_the_library_alone(path: Path) -> None:
    """Its environment may be the system's Python, or one that holds versions of its own of whatever the harness needs."""
    allowed = {*sys.stdlib_module_names, "numpy", "harness"}
    for module in closure(path) if path.name != "__init__.py" else {path}:
        for node in ast.walk(ast.parse(module.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert {name.split(".")[0] for name in names} <= allowed, f"{path.name} needs {names} of {module.name}"


def test_modules_hold_one_idea() -> None:
    long = {path.name: n for path in MODULES if (n := len(path.read_text().splitlines())) > LONGEST_MODULE}
    assert not long


def positional_records(path: Path) -> list[str]:
    """Dataclasses and named tuples of more than four fields that may be built by position."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ClassDef):
            continue
        fields = [n for n in node.body if isinstance(n, ast.AnnAssign) and "ClassVar" not in ast.unparse(n.annotation)]
        decorators = [ast.unparse(d) for d in node.decorator_list]
        tuple_like = any(ast.unparse(base) == "NamedTuple" for base in node.bases)
        by_position = any(d.startswith("dataclass") and "kw_only=True" not in d for d in decorators)
        if len(fields) > 4 and (tuple_like or by_position):
            found.append(node.name)
    return found


def test_records_of_many_fields_are_built_by_name() -> None:
    assert {p.name: found for p in MODULES if (found := positional_records(p))} == {}


def test_no_floor_is_allowed_and_not_used() -> None:
    used = {room: {room_of(n) for p in files_of(room) for n in imports(p)} for room in FLOORS}
    assert {room: sorted(FLOORS[room] - used[room]) for room in FLOORS if FLOORS[room] - used[room]} == {}


def functions(path: Path) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    return [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]


def test_functions_fit_a_screen() -> None:
    def length(f: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
        return (f.end_lineno or f.lineno) - f.lineno + 1

    long = {f"{p.name}:{f.name}": length(f) for p in MODULES for f in functions(p) if length(f) > LONGEST_FUNCTION}
    assert not long


def test_functions_take_few_parameters() -> None:
    def count(f: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
        names = [a.arg for a in (*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs)]
        return len([n for n in names if n not in ("self", "cls")])

    many = {f"{p.name}:{f.name}": count(f) for p in MODULES for f in functions(p) if count(f) > MOST_PARAMETERS}
    assert not many


def test_documents_are_built_by_their_constructor() -> None:
    """`model_copy(update=...)` validates nothing: a misspelt field passes."""
    assert [p.name for p in MODULES if "model_copy" in p.read_text()] == []
