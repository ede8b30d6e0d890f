"""Closing of the console on Windows, which sends no signal for it: the run ends as after Ctrl-C.

Windows ends the process when the handler returns, and after 5 s at the latest. The handler therefore waits for the end
of the run, which needs about a second for the fast ramp and the data file.
"""

import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable
from typing import Any

CLOSED = (2, 5, 6)
"""Console events that end the run: closing of the window, logoff of the user, and shutdown of the computer."""
GRANTED = 4.5
"""Longest wait for the end of the process [s]."""

_kept: list[Any] = []
"""The registered handler, referenced here because Windows does not keep it alive."""


def handler(interrupt: Callable[[int], object], number: int) -> Callable[[int], bool]:
    """The console's event handler, called in a separate thread. If the console is closed, it calls `interrupt(number)`
    and waits for the end of the process; other events are left to Python.
    """

    def handle(event: int) -> bool:
        if event not in CLOSED:
            return False
        interrupt(number)
        threading.Event().wait(GRANTED)
        return True

    return handle


def watch_console() -> None:
    """Treat the closing of the console as SIGBREAK. Has no effect on other systems, which send SIGHUP."""
    if sys.platform != "win32":
        return
    import ctypes
    from ctypes import wintypes

    made = ctypes.WINFUNCTYPE(wintypes.BOOL, wintypes.DWORD)(handler(interrupt_main, signal.SIGBREAK))
    if ctypes.windll.kernel32.SetConsoleCtrlHandler(made, True):
        _kept.append(made)
