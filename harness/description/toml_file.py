"""Reads a TOML file into a typed table, and turns every refusal into one line: file, key, expected, found, nearest spelling."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from harness.description.values import shown
from harness.errors import ModelFileError, nearest
from harness.reading import MODEL_BYTES, parsed_toml, read_text

Table = TypeVar("Table", bound=BaseModel)


# How many a file may have of what every run goes through.
MOST = {"frame": 500, "source": 64, "accepted": 1000, "configuration": 5000}


def read_toml(path: Path, table: type[Table]) -> Table:
    """Parse `path` and validate it as `table`. Raises ModelFileError."""
    data = parsed_toml(read_text(path, MODEL_BYTES, ModelFileError), path, ModelFileError)
    for key, most in MOST.items():
        if isinstance(entries := data.get(key), list) and len(entries) > most:
            raise ModelFileError(f"expected at most {most} tables [[{key}]], got {len(entries)}", where=path, key=key)
    return validate(data, table, path)


def validate(data: Mapping[str, Any], table: type[Table], path: Path) -> Table:
    """`data` as a `table`. Raises ModelFileError for the first thing wrong, counting the others."""
    try:
        return table.model_validate(data)
    except ValidationError as failure:
        errors = failure.errors(include_url=False)
        # Unknown keys first: a misspelt key is the cause of the 'missing' one that comes with it.
        errors.sort(key=lambda e: e["type"] != "extra_forbidden")
        first, more = errors[0], len(errors) - 1
        problem = _problem(dict(first), table)
        if more:
            problem += f" (and {more} more in this file)"
        raise ModelFileError(problem, where=path, key=_dotted(first["loc"])) from None


def _problem(error: Mapping[str, Any], table: type[BaseModel]) -> str:
    loc, kind = error["loc"], error["type"]
    if kind == "extra_forbidden":
        return f"unknown key; {nearest(str(loc[-1]), _keys_at(table, loc[:-1]))}"
    if kind == "missing":
        return "required key is missing"
    message = str(error["msg"]).removeprefix("Value error, ")
    message = message[0].lower() + message[1:]
    value = error.get("input")
    if isinstance(value, (str, int, float)) and shown(value) not in message:
        message += f", got {shown(value)}"
    return message


def _keys_at(table: type[BaseModel], loc: tuple[Any, ...]) -> list[str]:
    """The keys allowed where `loc` points, found by walking the types."""
    node: Any = table
    for step in loc:
        if not (isinstance(node, type) and issubclass(node, BaseModel)):
            return []
        if isinstance(step, str):
            by_key = {field.alias or name: field.annotation for name, field in node.model_fields.items()}
            node = _model_in(by_key.get(step, node))
    if isinstance(node, type) and issubclass(node, BaseModel):
        return [field.alias or name for name, field in node.model_fields.items()]
    return []


def _model_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        table = _model_in(inner)
        if isinstance(table, type) and issubclass(table, BaseModel):
            return table
    return annotation


def _dotted(loc: tuple[Any, ...]) -> str:
    text = ""
    for step in loc:
        text += f"[{step}]" if isinstance(step, int) else (f".{step}" if text else str(step))
    return text
