"""The one place that reads files which a user names: what they are, how large, in which encoding, how deeply nested.

A description may come from a stranger. So nothing here waits for a pipe, reads a device, or takes more memory than its limit
allows, and every refusal is one line. `parsed_toml` and `parsed_json` count before they parse: a parser calls itself for each
level of nesting, and some take quadratic time for long keys.
"""

from __future__ import annotations

import codecs
import hashlib
import itertools
import json
import os
import re
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from harness.errors import InputError, nearest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MODEL_BYTES = 4_000_000  # a file of a robot model
URDF_BYTES = 32_000_000
REPORT_BYTES = 64_000_000
DEEPEST = 32  # levels of nesting, and parts of a dotted key
LONGEST_KEY = 200  # letters
MOST_ENTRIES = 100_000  # keys and values of one TOML file
MOST_VALUES = 2_000_000  # values of one JSON file
MOST_TAGS = 400_000  # of one XML file
BESIDE = 1000  # files of a folder that a misspelt name is compared with
_PIECE = 1_000_000

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)

# How other files begin, and what to do with them.
_OTHERS = (
    (b"PK\x03\x04", "a ZIP archive, as .xlsx and .ods are", "save it as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old office document, as .xls is", "save it as CSV"),
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"%PDF", "a PDF", "copy the numbers out of it"),
    (codecs.BOM_UTF32_LE, "UTF-32 text", "save it as UTF-8"),
    (codecs.BOM_UTF32_BE, "UTF-32 text", "save it as UTF-8"),
)


def read_bytes(path: Path, limit: int, error: type[InputError] = InputError) -> bytes:
    """The contents of a regular file.

    path: the file; a link to one is followed.
    limit: how many bytes it may have. It is held while reading: a file may grow, and those of /proc do not say their size.
    error: the class of the refusals.

    Raises `error` if it is absent, no regular file, unreadable or too large.
    """
    return b"".join(_pieces(path, limit, error))


def digest(path: Path, limit: int) -> tuple[int, str]:
    """Size and SHA-256 of a regular file, of which no more than a piece is kept. Raises InputError as `read_bytes` does."""
    sha, size = hashlib.sha256(), 0
    for piece in _pieces(path, limit, InputError):
        sha.update(piece)
        size += len(piece)
    return size, sha.hexdigest()


def _pieces(path: Path, limit: int, error: type[InputError]) -> Iterator[bytes]:
    """What `read_bytes` reads, piece by piece."""
    if "\0" in str(path):
        raise error(f"no file has such a name: {str(path)!r}")
    try:
        _require_file(os.stat(path), path, limit, error)  # before it is opened: to open a device may set it going
        # A pipe put in its place meanwhile does not make this wait.
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb") as file:
            _require_file(os.fstat(file.fileno()), path, limit, error)
            rest = limit + 1
            while rest > 0 and (piece := file.read(min(rest, _PIECE))):
                yield piece
                rest -= len(piece)
    except FileNotFoundError:
        raise _absent(path, error) from None
    except OSError as failure:
        raise error(f"cannot be read: {failure.strerror}", where=path) from None
    if rest == 0:
        raise error(f"expected at most {limit} bytes, got more", where=path)


def read_text(path: Path, limit: int, error: type[InputError] = InputError) -> str:
    """The text of a file that `read_bytes` reads: UTF-8 with or without a byte order mark, or UTF-16 with one.

    Raises `error` as `read_bytes` does, and for other encodings, with byte, line and the likely cause.
    """
    return decoded(read_bytes(path, limit, error), path, error)


def decoded(data: bytes, path: Path, error: type[InputError] = InputError) -> str:
    """Bytes as text, as `read_text` does. path: for messages."""
    for start, what, hint in _OTHERS:
        if data.startswith(start):
            raise error(f"expected text, got {what}", where=path, hint=hint)
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    name, encoding = ("UTF-16", "utf-16") if utf16 else ("UTF-8", "utf-8-sig")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as failure:
        at = failure.start + (3 if not utf16 and data.startswith(codecs.BOM_UTF8) else 0)
        byte = f"byte {at}" + (f", 0x{data[at]:02x}" if at < len(data) else "")
        where = data[:at].decode(encoding, errors="replace").count("\n") + 1
        hint = "is it cut off?" if utf16 else "save it as UTF-8; it looks like Latin-1 or Windows-1252"
        if not utf16 and b"\0" in data[:1000]:
            hint = "save it as UTF-8; it is binary, or UTF-16 without a byte order mark"
        raise error(f"expected {name} text: {failure.reason} ({byte})", where=path, line=where, hint=hint) from None
    if (at := text.find("\0")) >= 0:
        hint = "save it as UTF-8; it is binary, or UTF-16 without a byte order mark"
        raise error(f"expected text, got a null character (character {at})", where=path, line=_line(text, at), hint=hint)
    return text


def is_file(path: Path) -> bool:
    """Whether a regular file is there; never for what cannot be asked, such as a name of 300 letters."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def _require_file(found: os.stat_result, path: Path, limit: int, error: type[InputError]) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for test, name in _KINDS if test(found.st_mode)), "something else")
        raise error(f"expected a file, got {kind}", where=path)
    if found.st_size > limit:
        raise error(f"expected at most {limit} bytes, got {found.st_size}", where=path)


def _absent(path: Path, error: type[InputError]) -> InputError:
    if path.is_symlink():
        return error(f"a link to a file that does not exist: {os.readlink(path)}", where=path)
    return error("no such file", where=path, hint=nearest(path.name, _beside(path)))


def _beside(path: Path) -> list[str]:
    """Names in the folder of a file, a thousand at most."""
    try:
        with os.scandir(path.parent) as entries:
            return [entry.name for entry in itertools.islice(entries, BESIDE)]
    except OSError:
        return []


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def parsed_toml(text: str, path: Path, error: type[InputError] = InputError) -> dict[str, Any]:
    """The tables of a TOML text. path: for messages.

    Raises `error` if it is none, nested deeper than DEEPEST, has a key longer than LONGEST_KEY or more than MOST_ENTRIES entries.
    """
    _measure_toml(text, path, error)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as failure:
        raise error(f"not TOML: {failure}", where=path) from None
    except ValueError:  # a number of more digits than Python reads
        raise _too_many_digits(text, path, error) from None
    _require_short_keys(data, path, error)
    return data


_TOML_TOKEN = re.compile(r"""\"{3}|'{3}|["'#\[\]{}=,.\n]""")
_TOML_ENDS = {  # three quotes may follow one or two that belong to the text
    '"': re.compile(r'\\.|"|\n'),
    '"""': re.compile(r'\\.|"{3,5}', re.DOTALL),
    "'": re.compile("'|\n"),
    "'''": re.compile("'{3,5}"),
}


def _measure_toml(text: str, path: Path, error: type[InputError]) -> None:
    """Refuse what would keep the parser busy: one pass over brackets, dots, strings and comments."""
    at, depth, dots, entries = 0, 0, 0, 0
    while (token := _TOML_TOKEN.search(text, at)) is not None:
        at, sign = token.end(), token[0]
        if sign in _TOML_ENDS:
            at = _end_of_string(text, at, sign)
            continue
        if sign == "#":
            at = text.find("\n", at)
            if at < 0:
                return
            continue
        dots = dots + 1 if sign == "." else 0
        depth = max(0, depth + (sign in "[{") - (sign in "]}"))
        entries += sign in "=,"
        if max(depth, dots) > DEEPEST:
            what = "brackets in each other" if depth > DEEPEST else "parts in a dotted key"
            raise error(f"expected at most {DEEPEST} {what}", where=path, line=_line(text, at))
        if entries > MOST_ENTRIES:
            raise error(f"expected at most {MOST_ENTRIES} keys and values", where=path)


def _end_of_string(text: str, at: int, quote: str) -> int:
    """Where a string that began before `at` ends: past its closing quotes, or the line, or the text."""
    while (found := _TOML_ENDS[quote].search(text, at)) is not None:
        at = found.end()
        if not found[0].startswith("\\"):
            return at
    return len(text)


def _require_short_keys(table: Any, path: Path, error: type[InputError]) -> None:
    if isinstance(table, dict):
        for key, value in table.items():
            if len(key) > LONGEST_KEY:
                raise error(f"expected keys of at most {LONGEST_KEY} letters, got one of {len(key)}: {key}", where=path)
            _require_short_keys(value, path, error)
    elif isinstance(table, list):
        for value in table:
            _require_short_keys(value, path, error)


def _too_many_digits(text: str, path: Path, error: type[InputError]) -> InputError:
    long = re.search(r"\d(?:_?\d){1000}", text)
    line = None if long is None else _line(text, long.start())
    return error("expected numbers of at most 1000 digits, got more", where=path, line=line)


_NO_BRACKETS = bytes(byte for byte in range(256) if byte not in b"[]{}")


def parsed_json(text: str, path: Path, error: type[InputError] = InputError) -> Any:
    """The value of a JSON text. path: for messages.

    Raises `error` if it is none, nested deeper than DEEPEST, or has more than MOST_VALUES values.
    """
    unescaped = text.replace("\\\\", "").replace('\\"', "")
    bare = re.sub('"[^"]*(?:"|$)', "", unescaped)
    brackets = bare.encode(errors="replace").translate(None, _NO_BRACKETS)
    if bare.count(",") > MOST_VALUES or len(brackets) > 2 * MOST_VALUES:
        raise error(f"expected at most {MOST_VALUES} values", where=path)
    depth = 0
    for sign in brackets:
        depth += 1 if sign in b"[{" else -1
        if depth > DEEPEST:
            raise error(f"expected at most {DEEPEST} brackets in each other", where=path)
    try:
        return json.loads(text)
    except json.JSONDecodeError as failure:
        raise error(f"not JSON: {failure}", where=path) from None
    except ValueError:
        raise _too_many_digits(text, path, error) from None


def require_few_tags(data: bytes, path: Path, error: type[InputError] = InputError) -> None:
    """Refuse XML of more than MOST_TAGS tags: a parsed one takes a hundred times its bytes. path: for messages."""
    if data.count(b"<") > MOST_TAGS:
        raise error(f"expected at most {MOST_TAGS} tags", where=path, hint="cut the file down to the arm")
