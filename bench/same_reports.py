"""Whether two folders of reports say the same: every JSON outside its `environment` block, text fields listed apart.

    python bench/same_reports.py BEFORE AFTER

Numbers, verdicts and exit codes must be equal to the last digit; then the exit code is 0. Texts that differ are listed and
are no failure by themselves: they are read by people, and a change of words is meant or not. `version` counts as text.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

VARIES = "environment"
VERDICTS = (
    "verdict",
    "exit_code",
    "status",
    "found",
    "frame",
    "worst_frame",
    "first_disagreeing_frame",
    "noise",
    "level",
    "code",
)


def differences(before: Any, after: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """(key, before, after) of every leaf that is not equal; a key that one side lacks has the text `missing` there."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in sorted({*before, *after}):
            yield from differences(before.get(name, "missing"), after.get(name, "missing"), f"{key}.{name}" if key else name)
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for i, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(one, other, f"{key}[{i}]")
    elif before != after:
        yield key, before, after


def is_text(key: str, before: Any, after: Any) -> bool:
    """Whether a difference is one of words alone."""
    return (
        isinstance(before, str)
        and isinstance(after, str)
        and key.rsplit(".", 1)[-1] not in VERDICTS
        and "missing" not in (before, after)
    )


def documents(folder: Path) -> dict[str, Any]:
    """The reports of a folder by file name, without what varies between two equal runs."""
    found = {}
    for path in sorted(folder.glob("*.json")):
        document = json.loads(path.read_text(encoding="utf-8"))
        if document.get("format") == "fk-crosscheck report":
            document.pop(VARIES)
            found[path.name] = document
    return found


def main(before: str, after: str) -> int:
    """Compare and print. Returns the exit code."""
    old, new = documents(Path(before)), documents(Path(after))
    if not old or old.keys() != new.keys():
        print(f"not the same reports: {sorted(old)} and {sorted(new)}")
        return 1
    code = 0
    for name in old:
        found = list(differences(old[name], new[name]))
        serious = [d for d in found if not is_text(*d)]
        texts = len(found) - len(serious)
        print(f"{name}: {len(serious)} numbers or verdicts differ, {texts} texts differ")
        for key, one, other in [*serious, *(d for d in found if is_text(*d))]:
            print(f"  {key}: {str(one)[:200]} -> {str(other)[:200]}")
        code = code or int(bool(serious))
    return code


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python bench/same_reports.py BEFORE AFTER")
    sys.exit(main(*sys.argv[1:]))
