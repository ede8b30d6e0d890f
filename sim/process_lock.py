"""Locks between processes, held by the operating system, with the name of the holder.

The lock is released when its process ends for any reason; the existence of a file cannot serve as a lock, because
the file would outlive a crashed program. The holder's name is in a second file, because a locked file cannot be read on
Windows.
"""

import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

ATTEMPTS, PAUSE = 10, 0.02
"""Number of attempts to read the holder's name, and pause between them [s]: the holder writes its name just after
locking the file.
"""


class LockHeld(Exception):
    """Error: another program holds the lock. The name of that program is in the file `name`."""

    def __init__(self, name: Path) -> None:
        super().__init__(name)
        self._name = name

    @property
    def holder(self) -> str:
        """Name of the holder; "another program" if it is not known."""
        for _ in range(ATTEMPTS):
            with suppress(OSError):
                if text := self._name.read_text(encoding="utf-8", errors="replace")[:200]:
                    return text
            time.sleep(PAUSE)
        return "another program"


class ProcessLock:
    """Lock on the file `PATH.lock`, from its construction to `release`, which any thread may call.

    `holder` is stored in `PATH.owner`; on a full disk the name is missing, and the lock still works. With `shared`, the
    processes of all users of this machine may take the lock. Raises LockHeld, and OSError if the file cannot be locked.
    """

    def __init__(self, path: Path, holder: str = "", *, shared: bool = False) -> None:
        self.path = path.with_name(f"{path.name}.lock")
        self._name = path.with_name(f"{path.name}.owner")
        options: dict[str, Any] = {"mode": 0o666} if shared else {}
        self._lock = FileLock(self.path, blocking=False, thread_local=False, fallback_to_soft=False, **options)
        try:
            self._lock.acquire()
        except Timeout:
            raise LockHeld(self._name) from None
        if holder:
            with suppress(OSError):
                # the file of a holder that crashed may belong to another user
                self._name.unlink(missing_ok=True)
                self._name.write_text(holder, encoding="utf-8")

    def release(self, *, remove: bool = False) -> None:
        """Release the lock; may be called repeatedly. With `remove`, the lock file is removed."""
        if not self._lock.is_locked:
            return
        with suppress(OSError):
            self._name.unlink(missing_ok=True)
        if remove:
            # while the lock is held, so that the file is not that of a later holder; on Windows this fails, because the
            # file is open, and filelock removes the file after the release
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
        self._lock.release()
