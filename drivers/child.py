"""Child processes that serve a run, and must outlive requests to end that are sent to the whole process group.

While the output is driven, the program answers such a request by a ramp to zero. If a child ended first, the program
would have lost an instrument and would cut the output at once. These children end when their standard input is closed.
"""

import signal
import subprocess
import sys

OWN_CONSOLE = subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0
"""Creation flag of the child: a closed console ends only the processes attached to it (Windows)."""


def ignore_requests() -> None:
    """Ignore requests to end, for child processes that end when their standard input is closed."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
