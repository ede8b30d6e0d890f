"""Sessions under way on this computer: each is announced in a folder of this user, for windows that attach to it.

An announcement is a file that only this user can read, with the address and key of the session. It is locked while the
session runs; an unlocked announcement is from a process that ended abruptly, and is removed.
"""

import json
import os
import stat
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Listener
from pathlib import Path

from bench.unfinished import remove_at_interrupt
from sim.process_lock import LockHeld, ProcessLock

FOLDER = "ROCKBENCH_SESSIONS"
"""Environment variable that names the folder of the announcements; "off" disables them."""


@dataclass(frozen=True)
class RunningSession:
    """A session to which a client can attach, and its run.

    process : identifier of the process.
    address, key : address and key of the session's listener.
    owner : "window" or "terminal".
    real : True for the backend "hardware".
    began : time of the start [s since 1970].
    """

    process: int
    address: str
    key: str
    protocol: str
    operator: str
    owner: str
    out: str
    real: bool
    began: float

    @property
    def title(self) -> str:
        """Short description of the run: protocol, operator and folder."""
        by = f" by {self.operator}" if self.operator else ""
        return f"{self.protocol}{by}, {self.out}"


def open_listener(key: bytes | None = None) -> Listener:
    """Listener at an address of its own, for clients that have the `key`, if given."""
    listener = Listener(authkey=key)
    if sys.platform != "win32":
        remove_at_interrupt(Path(str(listener.address)).parent)
    return listener


def sessions_folder() -> Path | None:
    """Folder of the announcements, created if missing; None if announcements are disabled, or if the folder cannot be
    created or is accessible to other users.
    """
    given = os.environ.get(FOLDER)
    if given == "off":
        return None
    user = os.getuid() if sys.platform != "win32" else os.environ.get("USERNAME", "")
    folder = Path(given or Path(tempfile.gettempdir(), f"rockbench-{user}"))
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    # on Windows, the folder for temporary files is the user's own
    private = sys.platform == "win32" or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    return folder if stat.S_ISDIR(found.st_mode) and private else None


def running_sessions() -> list[RunningSession]:
    """Sessions under way, the newest first, those of real benches before all others."""
    folder, found = sessions_folder(), list[RunningSession]()
    for path in () if folder is None else folder.glob("*.json"):
        try:
            lock = lock_of(path)
        except LockHeld:
            with suppress(OSError, ValueError, TypeError):
                found.append(RunningSession(**json.loads(path.read_text(encoding="utf-8"))))
        except OSError:
            continue
        else:
            remove(path, lock)
    return sorted(found, key=lambda each: (each.real, each.began), reverse=True)


def lock_of(path: Path) -> ProcessLock:
    """Lock the announcement `path`. Raises LockHeld while its session runs, and OSError if it cannot be locked."""
    return ProcessLock(path.with_suffix(""))


def remove(path: Path, lock: ProcessLock | None) -> None:
    """Remove an announcement and its lock."""
    with suppress(OSError):
        path.unlink(missing_ok=True)
    if lock is not None:
        lock.release(remove=True)
