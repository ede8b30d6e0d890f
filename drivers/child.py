"""Child processes that serve a run, and must outlive the requests to end that reach the whole process group.

While the output is driven, the program answers such a request by a ramp to zero. A child that ended first would be the
loss of an instrument, which cuts the output at once. These children end with their standard input.
"""

import signal
import subprocess
import sys

OWN_CONSOLE = subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0
"""Creation flag of the child: a closed console ends only the processes attached to it (Windows)."""


def ignore_requests() -> None:
    """Ignore requests to end, which reach the whole process group; for children that end with their standard input."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
