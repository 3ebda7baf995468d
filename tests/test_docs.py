"""The docs: examples run, lines that a diff can show, and names of paths, links, folders and modules that exist."""

from __future__ import annotations

import doctest
import importlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.engines.base import Engine
from tests.test_architecture import FLOORS

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "reports/README.md")]
PAGES += sorted((ROOT / "docs").glob("*.md"))
WITH_EXAMPLES = ("README.md", "docs/api.md")
LONGEST_LINE = 120
LINKED = ("README.md", "CONTRIBUTING.md", *(f"docs/{name}.md" for name in ("api", "causes", "model-files", "theory")))
TERMS = (
    "source", "engine", "reference", "mapped frame", "rigid frame", "gauge", "residual", "noise floor", "gate", "certificate",
    "trait", "description", "placement", "discrepancy", "twist", "tolerance", "accepted deviation", "published placement",
    "worker", "configuration", "base and tool", "canonical parameters", "mutant", "theorem",
)  # fmt: skip


def page_id(page: Path) -> str:
    return str(page.relative_to(ROOT))


each_page = pytest.mark.parametrize("page", PAGES, ids=page_id)


def python_blocks(text: str) -> Iterator[tuple[int, str]]:
    """Each ```python block of a page, with the number of the lines before it."""
    for match in re.finditer(r"^```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE):
        yield text.count("\n", 0, match.start()) + 1, match[1]


def run_block(code: str, name: str, line: int, namespace: dict[str, object]) -> str:
    """Run one block, as a doctest if it has prompts. Returns what came out wrong; the namespace keeps what it defines."""
    if ">>>" not in code:
        exec(compile("\n" * line + code, name, "exec"), namespace)
        return ""
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    test = doctest.DocTestParser().get_doctest(code, namespace, f"{name}:{line}", name, line)
    wrong = io.StringIO()
    doctest.DocTestRunner(optionflags=flags).run(test, out=wrong.write, clear_globs=False)
    namespace.update(test.globs)
    return wrong.getvalue()


def prose(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a page outside code, tables and images, by number, links without their addresses."""
    in_code = False
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("```"):
            in_code = not in_code
        elif not in_code and not line.startswith(("|", "![")):
            yield number, re.sub(r"\]\([^)]*\)", "]", line)


def anchors(page: Path) -> set[str]:
    """The anchors that a page's headings get on GitHub."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def section(page: str, heading: str) -> str:
    """The text of one section, up to the next heading of the same or a higher level."""
    text = (ROOT / page).read_text()
    level = len(heading) - len(heading.lstrip("#"))
    match = re.search(rf"^{re.escape(heading)}\n(.*?)(?=^#{{1,{level}}} |\Z)", text, flags=re.DOTALL | re.MULTILINE)
    assert match is not None, f"{page} has no section {heading!r}"
    return match[1]


def table_rows(text: str) -> list[list[str]]:
    """The cells of each row of the first table, without its two head lines."""
    match = re.search(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    assert match is not None
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in match[0].splitlines()[2:]]


def names_in(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


# Examples ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "example"}
    blocks = list(python_blocks((ROOT / name).read_text()))
    assert blocks
    wrong = [run_block(code, name, line, namespace) for line, code in blocks]
    assert not "".join(wrong), "".join(wrong)


def test_a_wrong_example_is_noticed() -> None:
    namespace: dict[str, object] = {}
    assert run_block(">>> x = 1\n>>> x\n1\n", "page", 1, namespace) == ""
    assert "Expected" in run_block(">>> x\n2\n", "page", 1, namespace)
    assert "NameError" in run_block(">>> y\n2\n", "page", 1, namespace)


# Lines and links --------------------------------------------------------------------------------------


@each_page
def test_lines_of_prose_are_short(page: Path) -> None:
    long = [f"{page.name}:{number}: {len(line)}" for number, line in prose(page.read_text()) if len(line) > LONGEST_LINE]
    assert not long


@each_page
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=page_id)
def test_paths_are_there(page: Path) -> None:
    """Files and folders of the repository that a page names in code. The changelog names former ones too."""
    for path in re.findall(r"`((?:harness|tests|docs|examples|models|urdf)/[\w./-]*)`", page.read_text()):
        assert (ROOT / path).exists(), path


def test_files_of_the_folders_described_are_there() -> None:
    """A bare `file.py` in CONTRIBUTING.md is in one of the folders that its paragraph names."""
    paragraphs = re.split(r"\n(?=- )|\n\n", section("CONTRIBUTING.md", "## How the code is laid out"))
    for paragraph in paragraphs:
        folders = [ROOT / Path(p) for p in re.findall(r"`(harness/\w+/)", paragraph)]
        for file in re.findall(r"`(\w+\.py)`", paragraph) if folders else ():
            assert any((folder / file).is_file() for folder in folders), f"{file} in {paragraph}"


# Glossary ---------------------------------------------------------------------------------------------


def test_the_glossary_explains_every_term_in_a_few_sentences() -> None:
    entries = re.findall(r"^### (.*)\n\n((?:.+\n)+)", (ROOT / "docs" / "glossary.md").read_text(), flags=re.MULTILINE)
    assert sorted(name.lower() for name, _ in entries) == sorted(TERMS)
    for name, text in entries:
        assert len(re.findall(r"[.:;](?=\s)", text)) <= 4, name


@pytest.mark.parametrize("name", LINKED)
def test_pages_link_to_the_glossary(name: str) -> None:
    assert re.search(r"\]\((docs/)?glossary\.md", (ROOT / name).read_text())


# CONTRIBUTING.md --------------------------------------------------------------------------------------


def test_the_floors_are_those_of_the_architecture() -> None:
    rows = table_rows(section("CONTRIBUTING.md", "## How the code is laid out"))
    shown = {names_in(folder)[0]: names_in(imports) for folder, _, imports in rows}
    assert list(shown) == list(FLOORS)
    for folder, names in shown.items():
        in_order = [f"`{name}`" for name in FLOORS if name in FLOORS[folder]]
        assert len(names) == len(set(names)), folder
        assert set(names) == FLOORS[folder], f"{folder}: expected {', '.join(in_order) or 'nothing'}"


def test_the_example_of_an_engine_is_one() -> None:
    text = section("CONTRIBUTING.md", "## Add an engine")
    ((line, code),) = python_blocks(text)
    namespace: dict[str, object] = {"__name__": "acme_fk.crosscheck"}
    run_block(code, "CONTRIBUTING.md", line, namespace)
    adapter = namespace["UrdfAcme"]
    assert isinstance(adapter, type)
    assert issubclass(adapter, Engine)
    assert not adapter.__abstractmethods__
    assert adapter.__name__ in text.split("```toml")[1]


def test_what_an_engine_may_set_is_described() -> None:
    rows = table_rows(section("CONTRIBUTING.md", "### 1. The class"))
    assert {name for cell, *_ in rows for name in names_in(cell)} == set(Engine.__annotations__)


def resolve(dotted: str) -> object:
    """The module, class or function that a dotted name means. Raises ImportError or AttributeError."""
    module = dotted
    rest: list[str] = []
    while True:
        try:
            found: object = importlib.import_module(module)
            break
        except ModuleNotFoundError:
            module, _, name = module.rpartition(".")
            if not module:
                raise
            rest.insert(0, name)
    for name in rest:
        found = getattr(found, name)
    return found


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "docs/api.md", "docs/causes.md", "docs/theory.md"])
def test_dotted_names_can_be_imported(name: str) -> None:
    for dotted in set(re.findall(r"`(harness(?:\.\w+)+)`", (ROOT / name).read_text())):
        resolve(dotted)


@pytest.mark.parametrize("new", [names_in(row[1])[0] for row in table_rows(section("CHANGELOG.md", "### Moved import paths"))])
def test_moved_modules_are_where_the_changelog_says(new: str) -> None:
    resolve(new)
