"""The one place that reads files: what it refuses, within what time and memory, and that no other module reads any."""

from __future__ import annotations

import ast
import os
import re
import socket
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import harness
from harness.description.dh_csv import read_dh_csv
from harness.description.model import load_model
from harness.description.model_file import ModelFile
from harness.description.toml_file import read_toml
from harness.description.urdf_file import parse_urdf, read_urdf
from harness.errors import InputError, ModelFileError, UrdfError
from harness.reading import MOST_VALUES, decoded, is_file, parsed_json, parsed_toml, read_bytes, read_text
from harness.report.json_file import read_report
from harness.verdict.accepted import read_accepted

ROOT = Path(harness.__file__).parent
HERE = Path("here.toml")


def folder(path: Path) -> None:
    path.mkdir()


def pipe(path: Path) -> None:
    os.mkfifo(path)


def unix_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))


def link_to_nothing(path: Path) -> None:
    path.symlink_to("nowhere")


def link_to_itself(path: Path) -> None:
    path.symlink_to(path.name)


def endless_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def file_of_proc(path: Path) -> None:
    path.symlink_to("/proc/self/pagemap")  # says that it is empty, and is hundreds of terabytes


def too_large(path: Path) -> None:
    path.touch()
    os.truncate(path, 10**12)


KINDS: list[tuple[Callable[[Path], None], str]] = [
    (folder, "expected a file, got a folder"),
    (pipe, "expected a file, got a named pipe"),
    (unix_socket, "expected a file, got a socket"),
    (link_to_nothing, "a link to a file that does not exist: nowhere"),
    (link_to_itself, "Too many levels of symbolic links"),
    (endless_device, "expected a file, got a device"),
    (file_of_proc, "bytes, got more"),
    (too_large, "bytes, got 1000000000000"),
]


@pytest.mark.parametrize(("make", "problem"), KINDS, ids=lambda x: getattr(x, "__name__", ""))
@pytest.mark.parametrize(
    ("read", "error"),
    [(read_dh_csv, ModelFileError), (read_urdf, UrdfError), (read_report, InputError), (read_accepted, InputError)],
)
def test_only_regular_files_of_some_size_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Callable[[Path], None], problem: str, read: Callable[[Path], object],
    error: type[InputError],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)  # the name of a socket must be short
    path = Path("input.csv")
    make(path)
    started = time.monotonic()
    with pytest.raises(error) as caught:
        read(path)
    assert problem in str(caught.value)
    assert str(caught.value).startswith("input.csv: ")
    assert time.monotonic() - started < 20.0


def test_a_pipe_that_takes_the_place_of_a_file_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, pipe_path = tmp_path / "f", tmp_path / "pipe"
    path.touch()
    os.mkfifo(pipe_path)
    of_a_file = os.stat(path)
    monkeypatch.setattr(os, "stat", lambda *_, **__: of_a_file)
    with pytest.raises(InputError, match="got a named pipe"):
        read_bytes(pipe_path, 100)


def test_a_file_that_grows_is_read_up_to_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "f"
    path.write_bytes(b"12345")
    assert read_bytes(path, 5) == b"12345"
    with pytest.raises(InputError, match="at most 4 bytes, got 5"):
        read_bytes(path, 4)


def test_names_that_no_file_can_have(tmp_path: Path) -> None:
    for name in ("a\0b", "x" * 300, "x" * 5000):
        with pytest.raises(InputError):
            read_text(tmp_path / name, 100)
        assert not is_file(tmp_path / name)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_with_a_mark_are_read(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "dh.csv"
    path.write_bytes("name,a,alpha,d,theta_offset\nDrehgelenk_ä,0.5,pi/2,0,0\n".encode(encoding))
    rows, _ = read_dh_csv(path)
    assert rows[0].name == "Drehgelenk_ä"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            b"a\nb\xb0",
            "here.toml:2: expected UTF-8 text: invalid start byte (byte 3, 0xb0); save it as UTF-8; it looks like Latin",
        ),
        (b"\xef\xbb\xbfa\nb\xb0", "here.toml:2: expected UTF-8 text: invalid start byte (byte 6, 0xb0)"),
        ("a\n°".encode("utf-16")[:-1], "here.toml:2: expected UTF-16 text: truncated data"),
        (
            "name,a".encode("utf-16-le"),
            "here.toml:1: expected text, got a null character (character 1); save it as UTF-8; it is bin",
        ),
        ("°".encode("utf-32"), "here.toml: expected text, got UTF-32 text; save it as UTF-8"),
        (b"PK\x03\x04...", "here.toml: expected text, got a ZIP archive, as .xlsx and .ods are; save it as CSV"),
    ],
)
def test_other_encodings_are_named(data: bytes, message: str) -> None:
    with pytest.raises(InputError) as caught:
        decoded(data, HERE)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a." * 20_000 + "a = 1", "expected at most 32 parts in a dotted key"),
        ("[" + "a." * 20_000 + "a]", "expected at most 32 parts in a dotted key"),
        ("a." + '"b".' * 40 + "c = 1", "expected at most 32 parts in a dotted key"),
        ("a = " + "[" * 500 + "]" * 500, "expected at most 32 brackets in each other"),
        ("a = " + "{a = " * 500 + "1" + "}" * 500, "expected at most 32 brackets in each other"),
        ('a = ["""quoted"""", ' + "[" * 500, "expected at most 32 brackets in each other"),  # a quote, then three that end it
        ("a = ['''quoted'''', " + "[" * 500, "expected at most 32 brackets in each other"),
        ('a = ["\\"", ' + "[" * 500, "expected at most 32 brackets in each other"),
        ("a = [" + "1, " * 200_000 + "]", "expected at most 100000 keys and values"),
        ("k" * 40_000 + " = 1", "expected keys of at most 200 letters, got one of 40000"),
        ("\na = " + "9" * 5000, "here.toml:2: expected numbers of at most 1000 digits"),
        ("a = 1\na = 2", "not TOML: Cannot overwrite a value"),
    ],
)  # fmt: skip
def test_toml_that_would_keep_the_parser_busy(text: str, problem: str) -> None:
    started = time.process_time()
    with pytest.raises(InputError, match=re.escape(problem)) as caught:
        parsed_toml(text, HERE)
    assert len(str(caught.value)) < 300
    assert time.process_time() - started < 2.0


def test_brackets_and_dots_in_strings_and_comments_are_text() -> None:
    many = "[" * 100 + "." * 100
    for quote in ('"', '"""', "'", "'''"):
        assert parsed_toml(f"a = {quote}{many}{quote} # {many}", HERE) == {"a": many}
    assert parsed_toml('a = "\\"[[["\nb = 1.5', HERE) == {"a": '"[[[', "b": 1.5}
    assert parsed_json('{"a": "' + many + '\\"[[["}', HERE) == {"a": many + '"[[['}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" * 100_000, "expected at most 32 brackets in each other"),
        ('{"a":' * 100_000, "expected at most 32 brackets in each other"),
        ('["\\\\", ' + "[" * 100_000, "expected at most 32 brackets in each other"),
        ("[" + "1," * (MOST_VALUES + 1), f"expected at most {MOST_VALUES} values"),
        ("[" + "{}" * (MOST_VALUES + 1), f"expected at most {MOST_VALUES} values"),
        ("9" * 5000, "here.toml:1: expected numbers of at most 1000 digits"),
        ('"' + '\\"' * 1_000_000, "not JSON: Unterminated string"),
    ],
)  # fmt: skip
def test_json_that_would_keep_the_parser_busy(text: str, problem: str) -> None:
    started = time.process_time()
    with pytest.raises(InputError, match=re.escape(problem)):
        parsed_json(text, HERE)
    assert time.process_time() - started < 5.0


def test_xml_of_too_many_tags_and_too_deep() -> None:
    with pytest.raises(UrdfError, match="expected at most 400000 tags"):
        parse_urdf(b"<robot name='r'>" + b"<a/>" * 400_000 + b"</robot>", Path("r.urdf"))
    with pytest.raises(UrdfError, match="not well-formed XML: Excessive depth"):
        parse_urdf(b"<robot name='r'>" + b"<a>" * 5000 + b"</a>" * 5000 + b"</robot>", Path("r.urdf"))


def test_an_absent_file_is_named_with_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "dh.csv").touch()
    with pytest.raises(ModelFileError, match=r"no such file; did you mean 'dh.csv'\?"):
        read_text(tmp_path / "dh.cvs", 100, ModelFileError)


def test_a_model_has_so_many_frames_sources_and_configurations(copy_model: Callable[..., Path]) -> None:
    entries = {
        "model.toml": ('[[source]]\nname = "dh:{}"\n', 65, "expected at most 64 tables [[source]]"),
        "frames.toml": ('[[frame]]\nname = "{}"\ndh = 0\n', 501, "expected at most 500 tables [[frame]]"),
        "configurations.toml": ('[[configuration]]\nname = "{}"\nunit = "rad"\nq = []\n', 5001, "expected at most 5000"),
    }
    model = copy_model("stanford")
    for name, (entry, count, problem) in entries.items():
        text = (model / name).read_text()
        (model / name).write_text(text + "\n" + "".join(entry.format(i) for i in range(count)))
        with pytest.raises(ModelFileError) as caught:
            load_model(model)
        assert problem in str(caught.value)
        (model / name).write_text(text)


def test_a_table_has_so_many_rows(tmp_path: Path) -> None:
    path = tmp_path / "dh.csv"
    path.write_text("joint,a,alpha,d,theta\n" + "".join(f"j{i},0,0,0,0\n" for i in range(1001)))
    with pytest.raises(ModelFileError, match=r"dh.csv:1002: expected at most 1000 rows"):
        read_dh_csv(path)


def test_many_pairs_of_source_and_frame_are_not_accepted(copy_model: Callable[..., Path]) -> None:
    model = copy_model("stanford")
    text = (model / "model.toml").read_text()
    sources = ", ".join(f'"dh:{i}"' for i in range(20_001))
    entry = f'[[accepted]]\nsource = [{sources}]\nframe = "tip"\nposition = 1\nreason = "r"\n'
    (model / "model.toml").write_text(f"{text}\n{entry}")
    with pytest.raises(ModelFileError, match="at most 20000 pairs of source and frame"):
        load_model(model)


def test_a_long_value_is_cut_in_the_message(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(f'name = "{"x" * 5000}"\nconvention = "{"y" * 5000}"\n' + f"{'z' * 150} = 1\n")
    with pytest.raises(ModelFileError) as caught:
        read_toml(path, ModelFile)
    assert len(str(caught.value)) < 600 + len(str(path))


# Modules that read a file by themselves, and why.
ALONE = {
    "run/checkpoint.py": "a checkpoint that the harness wrote itself, and trusts no more than a stranger's",
    "writing.py": "opens to write",
    "cli/fault_file.py": "writes the file of a fault, which nobody reads",
    "cli/output.py": "/dev/null in the place of an output that is closed",
    "reading.py": "the one place",
    "cli/view.py": "opens the browser",
    "rendering/scripts.py": "files of packages that are installed",
    "rendering/files.py": "opens to write",
    "workers/environments.py": "the list of environments that the harness wrote itself",
    "workers/install.py": "a lock",
    "workers/worker.py": "the pipe of a worker",
}
READERS = {"read_text", "read_bytes", "open", "fdopen", "fromfile", "loadtxt", "genfromtxt", "memmap"}
WHOLE = {"json.load", "tomllib.load", "pickle.load", "np.load", "etree.parse", "etree.iterparse", "ElementTree.parse"}


def readers(path: Path) -> list[str]:
    """Calls in a module that may read a file; what is imported from harness.reading is not among them."""
    tree = ast.parse(path.read_text())
    ours = {
        alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == "harness.reading"
        for alias in node.names
    }  # fmt: skip
    calls = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    names = [(f.attr, ast.unparse(f)) if isinstance(f, ast.Attribute) else (ast.unparse(f), ast.unparse(f)) for f in calls]
    return [whole for name, whole in names if (name in READERS or whole in WHOLE) and whole not in ours]


def test_no_other_module_reads_files() -> None:
    reading = {str(path.relative_to(ROOT)): calls for path in sorted(ROOT.rglob("*.py")) if (calls := readers(path))}
    assert set(reading) == set(ALONE), reading
