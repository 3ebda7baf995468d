"""Ends every worker when the harness is gone, whatever ended it: run as a script, leader of the workers' process group.

The harness holds the other end of this process's stdin. When that closes, by an orderly end or by kill -9, the whole group
is killed, this process with it.
"""

from __future__ import annotations

import os
import signal
import sys

if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    sys.stdin.buffer.read()
    os.killpg(0, signal.SIGKILL)
