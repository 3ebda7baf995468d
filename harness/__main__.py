"""`python -m harness`, and the command `crosscheck`: nothing heavy is imported before Ctrl-C can be answered."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

from harness.kernels import fix_kernels

INTERRUPTED = 130


def main() -> None:
    """Entry point."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else the caller wants it ignored
        signal.signal(signal.SIGINT, _interrupt)
    fix_kernels(os.environ)  # before NumPy is imported
    try:
        from harness.cli.main import main as command  # noqa: PLC0415

        command()
    except KeyboardInterrupt:  # before the command could answer it
        sys.stderr.write("interrupted: reports written before are unchanged\n")
        sys.exit(INTERRUPTED)
    finally:
        # As it ends, Python gives Ctrl-C back to the system, where one more would end the process by a signal.
        if signal.getsignal(signal.SIGINT) is _end:
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """The first Ctrl-C: clean up. Another one ends the process at once, and the warden then ends the workers."""
    signal.signal(signal.SIGINT, _end)
    raise KeyboardInterrupt


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
