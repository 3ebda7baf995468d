"""Edits of nested data, tables of TOML and documents of JSON, and their texts."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from tests.fuzz.values import (
    Deep,
    elements,
    factors,
    gentle_numbers,
    harsh_numbers,
    names,
    number_texts,
    odd_names,
    values,
)

PLACES = 2**16  # a place is drawn out of so many, and taken modulo those there are
MOST_COPIES = 6000

# What is done at which places. Gentle edits leave most documents ones that are read.
GENTLE = (*["factor"] * 6, "number", *["rename"] * 4, "word", "child", "child", "less", "more", "twin")
HARSH = ("number", "text", "value", "value", "name", "key", "insert", "remove", "exchange", "wrap", "copy", "many", "word")

# Words that have a meaning of their own: another of the same kind takes their place, and as names they are left alone.
FAMILIES = (
    ("revolute", "prismatic", "fixed", "revolute", "prismatic", "fixed", "continuous", "floating", "planar", "Revolute"),
    ("standard", "modified"),
    ("deg", "rad"),
    ("holds", "wrong"),
    ("identical", "declared", "rigid"),
    ("sampled", "certified"),
    ("dh:numpy", "dh:pinocchio", "urdf:pinocchio", "urdf:nosuch"),
    ("base", "tool", "0", "1", "2", "6"),
    ("ran", "not run", "failed"),
    ("agrees", "disagrees", "keeps state", "not run", "failed", "agrees as accepted"),
    ("passes", "fails", "incomplete"),
    ("error", "warning", "note"),
    ("m", "rad"),
)
HEADER = ("joint", "type", "a", "alpha", "d", "theta")  # of dh.csv
WORDS = {*(word for family in FAMILIES for word in family), *HEADER}
LABELS = ("dh", "label")  # keys whose numbers are names of DH frames
TAG, ATTRIBUTES, CHILDREN = "<>", "=", "[]"  # of an XML element as nested data, see urdfs.py


@dataclass(frozen=True)
class Edit:
    """One edit of nested data: what is done, where, a second place, and a value."""

    action: str
    where: int
    other: int
    value: Any


def _edits(actions: tuple[str, ...], **fitting: Any) -> Any:
    """Edits. fitting: which values fit what is done."""
    place = st.integers(0, PLACES)
    return st.sampled_from(actions).flatmap(
        lambda action: st.builds(Edit, st.just(action), place, place, fitting.get(action, st.none()))
    )


_gentle = _edits(GENTLE, factor=factors, number=gentle_numbers, rename=odd_names, child=elements)
_numbers = harsh_numbers | number_texts
_harsh = _edits(HARSH, number=_numbers, text=names, name=names, key=names, value=values, insert=values, wrap=names)
gentle_edits = st.lists(_gentle, min_size=1, max_size=3)
harsh_edits = st.lists(_harsh, min_size=1, max_size=2)
edit_lists = st.one_of(*[gentle_edits] * 5, harsh_edits)


def edited(data: Any, changes: list[Edit]) -> Any:
    """A copy of nested data with each edit made."""
    data = copy.deepcopy(data)
    for edit in changes:
        places = [place for place in _places(data) if _fits(edit.action, *place)]
        if places:
            container, key = places[edit.where % len(places)]
            if edit.action == "rename":
                data = renamed(data, container[key], edit.value)
            else:
                _make(edit, container, key, places[edit.other % len(places)])
    return data


def renamed(data: Any, old: str, new: Any) -> Any:
    """Nested data with one text replaced wherever it stands, keys included."""
    if isinstance(data, dict):
        return {new if k == old else k: renamed(v, old, new) for k, v in data.items()}
    if isinstance(data, list):
        return [renamed(v, old, new) for v in data]
    return new if isinstance(data, str) and data == old else data


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Every place: its container, and the key or index there."""
    stack = [data]
    while stack:
        container = stack.pop()
        keys = list(container) if isinstance(container, dict) else range(len(container)) if isinstance(container, list) else ()
        for key in keys:
            yield container, key
            stack.append(container[key])


def _fits(action: str, container: Any, key: Any) -> bool:
    """Whether a place is one where such an edit is made."""
    test = _FITTING.get(action)
    return test is None or test(container, key)


def _is_number(container: Any, key: Any) -> bool:
    return isinstance(container[key], int | float) and not isinstance(container[key], bool)


def _is_word(container: Any, key: Any) -> bool:
    held = container[key]
    return isinstance(held, bool) or (isinstance(held, str) and held in WORDS and key != TAG)


def _is_text(container: Any, key: Any) -> bool:
    return isinstance(container[key], str)


def _in_list(container: Any, key: Any) -> bool:
    return isinstance(container, list)


_FITTING: dict[str, Callable[[Any, Any], bool]] = {
    "number": _is_number,
    "factor": lambda container, key: _is_number(container, key) and key not in LABELS,
    "text": _is_text,
    "name": _is_text,
    "rename": lambda container, key: _is_text(container, key) and container[key] not in WORDS and key != TAG,
    "word": _is_word,
    "child": lambda container, key: _in_list(container, key) and isinstance(container[key], dict) and TAG in container[key],
    "less": lambda container, key: _in_list(container, key) and isinstance(container[key], dict | list),
    "twin": lambda container, key: _in_list(container, key) and isinstance(container[key], dict | list),
    "more": lambda container, key: _in_list(container, key) and isinstance(container[key], dict | list),
    "key": lambda container, key: isinstance(container, dict),
    "insert": lambda container, key: isinstance(container, dict),
    "copy": _in_list,
    "many": _in_list,
}


def _make(edit: Edit, container: Any, key: Any, other: tuple[Any, Any]) -> None:
    action, value = edit.action, copy.deepcopy(edit.value)
    if action == "exchange":
        held, index = other
        container[key], held[index] = copy.deepcopy(held[index]), copy.deepcopy(container[key])
    elif action in ("remove", "less"):
        del container[key]
    elif action == "factor":
        container[key] = type(container[key])(container[key] * value)
    elif action in ("copy", "more", "many"):
        count = 1 if action != "many" else int(10 ** (edit.other / PLACES * 3.7))
        container[key:key] = [copy.deepcopy(container[key]) for _ in range(min(count, MOST_COPIES))]
    elif action == "twin":
        how = ("less", "remove", "factor", "word")[edit.other % 4]
        container[key:key] = [edited(container[key], [Edit(how, edit.other // 4, edit.where, 1.5)])]
    elif action == "child":
        container[key:key] = [value]
    elif action == "word":
        container[key] = _another(container[key], edit.other)
    elif action == "wrap":
        container[key] = [container[key]] if edit.other % 2 else {str(value)[:50]: container[key]}
    elif action == "key":
        container[str(value)] = container.pop(key)
    elif action == "insert":
        container[str(value)[:300] if edit.other % 2 else f"{key}x"] = value
    else:
        container[key] = value


def _another(word: Any, which: int) -> Any:
    """Another word of the same kind."""
    family = next((family for family in FAMILIES if word in family), (word,))
    return not word if isinstance(word, bool) else family[which % len(family)]


def toml_text(data: Any) -> str:
    """Nested data as TOML: a line for each key, everything below it inline; what is no table, as it is."""
    if not isinstance(data, dict):
        return _toml(data)
    return "".join(f"{_quoted(str(key))} = {_toml(value)}\n" for key, value in data.items() if value is not None)


def _quoted(text: str) -> str:
    return json.dumps(text.encode("utf-8", "replace").decode(), ensure_ascii=False).replace("\x7f", "\\u007f")


def _toml(value: Any) -> str:
    if isinstance(value, Deep):
        return value.text("a = ")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(str(k))} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return _digits(value) if isinstance(value, int | float) else _quoted(str(value))


def json_text(data: Any) -> str:
    """Nested data as JSON; numbers as Python has them, NaN and lone surrogates among them."""
    if isinstance(data, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))}: {json_text(v)}" for k, v in data.items()) + "}"
    if isinstance(data, list):
        return "[" + ", ".join(map(json_text, data)) + "]"
    if isinstance(data, Deep):
        return data.text('"a": ')
    return _digits(data) if isinstance(data, int) and not isinstance(data, bool) else json.dumps(data)


def _digits(number: float) -> str:
    """A number in digits, however many."""
    if isinstance(number, int) and abs(number) >= 10**4000:
        return f"{'-' if number < 0 else ''}1{'0' * 4000}"
    return repr(number)


def csv_text(rows: Any) -> str:
    """A list of rows as CSV."""
    lines = rows if isinstance(rows, list) else [rows]
    return "".join(",".join(map(_cell, row)) if isinstance(row, list) else str(row) for row in _ended(lines))


def _ended(rows: list[Any]) -> Iterator[Any]:
    for row in rows:
        yield row
        yield "\n"


def _cell(value: Any) -> str:
    text = _digits(value) if isinstance(value, int | float) else str(value)
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',"\n\r') else text
