"""Checks a derived DH table: the robot model made of it is cross-checked against the URDF that it came from."""

from __future__ import annotations

import tempfile
from pathlib import Path

from harness.convert.result import Derived
from harness.convert.write_model import write_model
from harness.description.model import load_model
from harness.report.document import Report
from harness.run.options import Options
from harness.verdict.crosscheck import crosscheck

SAMPLES = 200


def verify(derived: Derived, name: str, source: str, out: Path | None) -> Report:
    """Write the robot model, read it back and cross-check it, with a proof for its two files.

    derived: the table and the chain that it was found from.
    name: name of the robot model, and of its folder.
    source: engine that reads the URDF, e.g. `urdf:pinocchio`.
    out: folder of robot models that it is written to; None for a temporary one.

    Raises InputError if the folder cannot be written to, or a joint name cannot stand in dh.csv.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = write_model(derived, name, source, out or Path(temporary))
        return crosscheck(load_model(folder), Options(samples=SAMPLES, seed=0, sources=(source,)))
