"""`python -m harness`, and the command `crosscheck`: nothing heavy is imported before Ctrl-C can be answered."""

from __future__ import annotations

import sys


def main() -> None:
    """Entry point."""
    try:
        from harness.cli.main import main as command  # noqa: PLC0415
    except KeyboardInterrupt:
        sys.stderr.write("interrupted: reports written before are unchanged\n")
        sys.exit(130)
    command()


if __name__ == "__main__":
    main()
