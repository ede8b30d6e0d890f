"""Who changes a queue: one program at a time, told by a lock that the system lets go of when that program dies."""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from sim.errors import InvalidInput

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

FAR = 1 << 20
"""Windows keeps others from reading the byte that is locked: it is not one of those that say who has the lock."""
REMEDY = "add the test there, close that one first, or name another file"


class Owner:
    """Owns the queue in `path` from now on until `release`; `who` is told to anybody else who asks for it.

    The lock is on a file beside the queue, which stays, emptied: the queue's own is another one after each change.
    Raises InvalidInput that says who owns the queue already.
    """

    def __init__(self, path: Path, who: str) -> None:
        beside = path.with_name(f"{path.name}.lock")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._handle: int | None = os.open(beside, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InvalidInput("queue file", str(path), f"{beside} cannot be written: {error.strerror}") from None
        try:
            _lock(self._handle)
        except OSError:
            other = os.read(self._handle, 200).decode(errors="replace") or "another program"
            os.close(self._handle)
            raise InvalidInput("queue file", str(path), f"{other} has it: {REMEDY}") from None
        self._say(f"{who} (process {os.getpid()})")

    def release(self) -> None:
        """Let go; more than once does nothing."""
        if self._handle is not None:
            self._say("")
            with suppress(OSError):
                _unlock(self._handle)
            os.close(self._handle)
            self._handle = None

    def _say(self, who: str) -> None:
        # a full disk is no reason to be refused: then the owner has no name
        with suppress(OSError):
            assert self._handle is not None
            os.ftruncate(self._handle, 0)
            os.lseek(self._handle, 0, os.SEEK_SET)
            os.write(self._handle, who.encode())


@contextmanager
def owned(path: Path, who: str) -> Generator[None, None, None]:
    """Own the queue in `path` for a while. Raises InvalidInput as `Owner` does."""
    owner = Owner(path, who)
    try:
        yield
    finally:
        owner.release()


if sys.platform == "win32":

    def _lock(handle: int) -> None:
        os.lseek(handle, FAR, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, 0, os.SEEK_SET)

    def _unlock(handle: int) -> None:
        os.lseek(handle, FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_UNLCK, 1)

else:

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _unlock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_UN)
