"""Ownership of a queue: one program at a time, by a file lock that the system releases when that program dies."""

import os
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from sim.errors import InvalidInput

ITEM = "queue file"
REMEDY = "add the test there, close that one first, or name another file"


class Owner:
    """Owns the queue in `path` until `release`; `who` is named to every other program that asks for it.

    The lock is on a file beside the queue, which stays: the queue's own is another one after each change. The name is
    in a second file, since Windows lets nobody read a file that is locked. Raises InvalidInput that names the present
    owner, or the reason why nothing can be locked there.
    """

    def __init__(self, path: Path, who: str) -> None:
        from filelock import FileLock, Timeout

        # the file's mere existence is no lock: it would outlive a program that dies
        self._lock = FileLock(
            path.with_name(f"{path.name}.lock"), blocking=False, thread_local=False, fallback_to_soft=False
        )
        self._name = path.with_name(f"{path.name}.owner")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._lock.acquire()
        except Timeout:
            raise InvalidInput(ITEM, str(path), f"{self._other()} has it: {REMEDY}") from None
        except OSError as error:
            reason = f"{self._lock.lock_file} cannot be locked: {error.strerror or error}"
            raise InvalidInput(ITEM, str(path), reason) from None
        # a full disk is no reason to be refused: then the owner has no name
        with suppress(OSError):
            self._name.write_text(f"{who} (process {os.getpid()})", encoding="utf-8")

    def release(self) -> None:
        """Release the lock; more than once does nothing."""
        if self._lock.is_locked:
            with suppress(OSError):
                self._name.unlink(missing_ok=True)
            self._lock.release()

    def _other(self) -> str:
        try:
            return self._name.read_text(encoding="utf-8", errors="replace") or "another program"
        except OSError:
            return "another program"


@contextmanager
def owned(path: Path, who: str) -> Generator[None, None, None]:
    """Own the queue in `path` for a while. Raises InvalidInput as `Owner` does."""
    owner = Owner(path, who)
    try:
        yield
    finally:
        owner.release()
