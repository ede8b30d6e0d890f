"""Child processes that serve a run and must survive termination requests sent to the whole process group.

While the output is driven, the program responds to such a request by ramping the output to zero. If a child ended
first, the program would lose an instrument and cut the output at once. These children therefore end only when their
standard input is closed.
"""

import signal
import subprocess
import sys
from contextlib import suppress

from sim import waiting

OWN_CONSOLE = subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0
"""Process creation flag on Windows; a child without the program's console survives the closing of that console."""

ENDING = 2.0
"""Longest wait for a child to end [s], after which it is killed."""


class ChildProcess:
    """A process that runs `module` with `arguments`; `input` and `output` are pipes to its standard streams."""

    def __init__(self, module: str, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            creationflags=OWN_CONSOLE,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.input, self.output = self._process.stdin, self._process.stdout

    def write(self, sent: bytes) -> None:
        """Send bytes to the process. Raises OSError if it has ended."""
        self.input.write(sent)
        self.input.flush()

    def end(self) -> None:
        """Close the input and wait until the process has ended, or kill it after `ENDING`; may be called repeatedly."""
        with suppress(OSError):
            self.input.close()
        waiting.end(self._process, ENDING)


def ignore_requests() -> None:
    """Ignore termination requests in a child process that ends when its standard input is closed."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
