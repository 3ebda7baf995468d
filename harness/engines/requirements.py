"""Whether an environment has what an adapter needs, and the line that installs it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from packaging.requirements import Requirement

from harness.engines.base import Engine
from harness.errors import EngineUnavailable


def install_line(adapter: type[Engine]) -> str:
    """The command that gives this engine an environment of its own; it works beside any other engine."""
    return f"crosscheck engines install {shlex.quote(adapter.source)}"


def unmet(adapter: type[Engine], installed: Mapping[str, str]) -> str:
    """The first requirement that `installed` (distribution: version) does not meet, as a clause; empty if it meets all."""
    for text in adapter.requirements:
        need = Requirement(text)
        have = installed.get(need.name)
        if have is None:
            return f"{need.name} is not installed"
        if not need.specifier.contains(have, prereleases=True):
            return f"needs {text}, found {need.name} {have}"
    return ""


def build(adapter: type[Engine], description: Any) -> Engine:
    """The engine on a description, in this process. Raises EngineUnavailable (not here) or EngineFailed (refuses it)."""
    check(adapter)
    return adapter(description)


def check(adapter: type[Engine]) -> None:
    """Raise EngineUnavailable unless this environment has what the adapter needs."""
    if adapter.debian:
        reason = f"needs the system's Python with {' and '.join(adapter.debian)}"
        raise EngineUnavailable(adapter.source, reason, install_line(adapter))
    if why := unmet(adapter, adapter.versions()):
        raise EngineUnavailable(adapter.source, why, install_line(adapter))
