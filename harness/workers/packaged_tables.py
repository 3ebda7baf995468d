"""The DH tables that the Robotics Toolbox packages, read in whichever environment has it."""

from __future__ import annotations

import json
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from harness.description.dh import DHRow, DHTable
from harness.engines.dh_roboticstoolbox_packaged import DHRoboticstoolboxPackaged
from harness.errors import EngineFailed, InputError, nearest
from harness.workers.environments import own_environment, where

TIMEOUT = 120.0
SCRIPT = Path(__file__).with_name("toolbox_tables.py")


@lru_cache(maxsize=1)
def packaged_tables() -> dict[str, DHTable]:
    """Every serial robot of `roboticstoolbox.models.DH`, by name.

    Raises EngineUnavailable with the install line, or EngineFailed.
    """
    adapter = DHRoboticstoolboxPackaged
    python = where(adapter).python
    command = [python, str(SCRIPT)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False, env=own_environment(python))
    except (OSError, subprocess.SubprocessError) as error:
        raise EngineFailed(adapter.source, f"its tables cannot be read: {error}") from error
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise EngineFailed(adapter.source, f"its tables cannot be read: {last}")
    return {name: _table(data) for name, data in json.loads(done.stdout.splitlines()[-1]).items()}


def packaged_table(name: str) -> DHTable:
    """One of them, whatever the case of its name. Raises InputError."""
    tables = packaged_tables()
    matches = [known for known in tables if known.lower() == name.lower()]
    if not matches:
        raise InputError(f"no robot {name!r} in roboticstoolbox.models.DH; {nearest(name, tables)}")
    return tables[matches[0]]


def _table(data: dict[str, Any]) -> DHTable:
    rows = tuple(
        DHRow(
            name=f"joint{i}", kind="prismatic" if row["slides"] else "revolute", a=row["a"], alpha=row["alpha"],
            d=row["offset"] if row["slides"] else row["d"], theta=row["theta"] if row["slides"] else row["offset"],
        )
        for i, row in enumerate(data["rows"], start=1)
    )  # fmt: skip
    return DHTable(rows, "modified" if data["modified"] else "standard", np.array(data["base"]), np.array(data["tool"]))
