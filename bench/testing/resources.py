"""Resources held by this process, for tests that check that all of them are released."""

import threading
import time
from pathlib import Path

_PATIENCE = 10.0
"""Longest wait for threads, files and processes to end [s]."""


def held() -> dict[str, int]:
    """Numbers of threads and, on Linux, of open files (including ports and sockets) and child processes.

    Excludes the threads of an emulated laboratory in this process, because the laboratory outlives the rigs.
    """
    counts = {"threads": sum(not thread.name.startswith("emulated") for thread in threading.enumerate())}
    own = Path("/proc/self")
    if own.is_dir():
        counts["files"] = sum(1 for _ in (own / "fd").iterdir())
        counts["processes"] = sum(len(_text(path).split()) for path in own.glob("task/*/children"))
    return counts


def held_at_last(allowed: dict[str, int]) -> dict[str, int]:
    """Return the numbers of resources as soon as none exceeds its `allowed` number, or after a time-out."""
    deadline = time.monotonic() + _PATIENCE
    now = held()
    while any(count > allowed[kind] for kind, count in now.items()) and time.monotonic() < deadline:
        time.sleep(0.01)
        now = held()
    return now


def _text(path: Path) -> str:
    """Contents of a thread's file in /proc; empty if the thread has just ended."""
    try:
        return path.read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""
