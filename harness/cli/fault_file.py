"""The file that a fault of the harness leaves: what whoever mends it needs to know."""

from __future__ import annotations

import platform
import shlex
import sys
import tempfile
import traceback
from importlib import metadata

from harness.version import __version__

LIBRARIES = ("click", "lxml", "numpy", "pin", "plotly", "pydantic", "rich")


def save_traceback(error: BaseException) -> str:
    """Write the traceback, the versions and the command line into a new file that only the user can read. Returns its path.

    Raises OSError if no folder for temporary files can be written to.
    """
    versions = [f"fk-crosscheck {__version__}", f"Python {sys.version}", platform.platform()]
    for name in LIBRARIES:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            versions.append(f"{name} is not installed")
    lines = [f"command: {shlex.join(sys.argv)}", *versions, "", *traceback.format_exception(error)]
    fd, path = tempfile.mkstemp(prefix="crosscheck-fault-", suffix=".txt", text=True)  # O_EXCL, O_NOFOLLOW, mode 0600
    with open(fd, "w", encoding="utf-8", errors="backslashreplace") as file:
        file.write("\n".join(line.rstrip("\n") for line in lines) + "\n")
    return path
