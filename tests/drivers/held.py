"""What this process holds of the machine: to see whether all of it is given back."""

import threading
import time
from pathlib import Path

_PATIENCE = 10.0
"""How long the end of what was held may take [s]."""


def held() -> dict[str, int]:
    """Threads, and on Linux open files (ports and sockets are files) and child processes.

    Threads of an emulated laboratory in this process are the laboratory's: it is made before a rig and outlives it.
    """
    counts = {"threads": sum(not thread.name.startswith("emulated") for thread in threading.enumerate())}
    own = Path("/proc/self")
    if own.is_dir():
        counts["files"] = sum(1 for _ in (own / "fd").iterdir())
        counts["processes"] = sum(len(_text(path).split()) for path in own.glob("task/*/children"))
    return counts


def held_at_last(allowed: dict[str, int]) -> dict[str, int]:
    """What is held, as soon as it is no more than allowed or patience is at its end."""
    deadline = time.monotonic() + _PATIENCE
    now = held()
    while any(count > allowed[kind] for kind, count in now.items()) and time.monotonic() < deadline:
        time.sleep(0.01)
        now = held()
    return now


def _text(path: Path) -> str:
    """The text of a file about a thread; empty when the thread has just ended."""
    try:
        return path.read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""
