"""fk-crosscheck: cross-validation of a robot's DH table against its URDF, with every forward-kinematics engine people use.

The names below are the Python API (docs/api.md). Each is imported when it is first asked for: a worker imports this package
in an environment that has NumPy and one engine, and `crosscheck --help` needs none of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from harness.version import __version__ as __version__

if TYPE_CHECKING:
    from harness.api import (
        Session,
        crosscheck,
        derive_dh,
        diff,
        identify,
        load_model,
        read_report,
        write_report,
    )
    from harness.convert.result import Derived
    from harness.description.dh import DHRow, DHTable
    from harness.description.model import RobotModel
    from harness.difference.identify import Identification
    from harness.difference.result import Difference
    from harness.engines.forward import forward_kinematics
    from harness.errors import (
        CrosscheckError,
        DescriptionUnavailable,
        EngineFailed,
        EngineUnavailable,
        InputError,
        UntrustedError,
    )
    from harness.report.document import Report
    from harness.run.options import Options
    from harness.workers.process import Limits

_HOME = {
    **dict.fromkeys(
        ("Session", "crosscheck", "derive_dh", "diff", "identify", "load_model", "read_report",
         "write_report"),
        "harness.api",
    ),
    "Derived": "harness.convert.result",
    **dict.fromkeys(("DHRow", "DHTable"), "harness.description.dh"),
    "RobotModel": "harness.description.model",
    "Identification": "harness.difference.identify",
    "Difference": "harness.difference.result",
    "forward_kinematics": "harness.engines.forward",
    **dict.fromkeys(
        ("CrosscheckError", "DescriptionUnavailable", "EngineFailed", "EngineUnavailable", "InputError", "UntrustedError"),
        "harness.errors",
    ),
    "Report": "harness.report.document",
    "Options": "harness.run.options",
    "Limits": "harness.workers.process",
}  # fmt: skip

__all__ = [
    "CrosscheckError",
    "DHRow",
    "DHTable",
    "Derived",
    "DescriptionUnavailable",
    "Difference",
    "EngineFailed",
    "EngineUnavailable",
    "Identification",
    "InputError",
    "Limits",
    "Options",
    "Report",
    "RobotModel",
    "Session",
    "UntrustedError",
    "crosscheck",
    "derive_dh",
    "diff",
    "forward_kinematics",
    "identify",
    "load_model",
    "read_report",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
