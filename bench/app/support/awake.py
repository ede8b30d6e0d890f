"""Inhibition of the computer's sleep during a run in real time: sleep would leave the drive at its last value.

A program cannot inhibit the suspension of USB devices; `rockbench doctor` checks the computer's settings for it.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress

from sim import waiting

CONTINUOUS, SYSTEM_REQUIRED = 0x80000000, 0x00000001
"""Flags of SetThreadExecutionState: the state remains in effect until changed; the system must not sleep."""
ENDING = 1.0
"""Longest wait for the inhibiting program to end [s]."""

INHIBITION = ("--what=sleep:idle", "--who=rockbench", "--why=a run is under way", "--mode=block")
"""Options of systemd-inhibit, which runs the command after them."""
COMMANDS = {
    "linux": (
        *("systemd-inhibit", *INHIBITION),
        *(sys.executable, "-P", "-c", "import sys; sys.stdin.read()"),
    ),
    "darwin": ("caffeinate", "-i", "-w", str(os.getpid())),
}
"""Commands that keep the computer awake until their standard input is closed (Linux) or this process ends (macOS)."""


@contextmanager
def awake(system: str = sys.platform) -> Generator[bool]:
    """Context manager that keeps the computer from going to sleep; yields whether that was requested.

    The system may refuse it later, as systemd-logind does to sessions without that right; `rockbench doctor` tries it.
    """
    if system == "win32":
        with _thread_required(_windows_state()) as required:
            yield required
        return
    command = COMMANDS.get(system)
    process = None
    if command is not None:
        with suppress(OSError):
            # in a separate session, so that Ctrl-C does not reach the inhibiting program
            process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
    try:
        yield process is not None
    finally:
        if process is not None:
            with suppress(OSError):
                assert process.stdin is not None
                process.stdin.close()
            if system == "darwin":
                process.terminate()
            waiting.end(process, ENDING)


@contextmanager
def _thread_required(set_state: Callable[[int], int]) -> Generator[bool]:
    """Context manager that keeps Windows awake by `set_state`, which returns 0 if it fails; yields whether it
    succeeded.
    """
    required = set_state(CONTINUOUS | SYSTEM_REQUIRED) != 0
    try:
        yield required
    finally:
        set_state(CONTINUOUS)


def _windows_state() -> Callable[[int], int]:
    if sys.platform != "win32":
        return lambda _: 0
    import ctypes

    return ctypes.windll.kernel32.SetThreadExecutionState
