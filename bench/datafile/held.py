"""Flushing of the data file to the disk, and protection of the file from locks by other programs while it is being
written.

On Windows locks are mandatory: while a reader with the usual locks of HDF5 has the file open, every write fails with
errno 13, and HDF5 cannot repeat a flush that has failed. Therefore the writer excludes such readers: it locks one byte
far beyond the end of the file, and every lock of the whole file would include this byte. Readers without locks, such as
this program, are not affected.
"""

import errno
import os
import re
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bench.datafile.hdf5_reading import DataFileError

HELD = 10.0
"""Longest time [s] for which another program, such as a virus scanner, may lock the file; samples are kept in memory
meanwhile.
"""
PAUSE = 0.02
"""Pause between two attempts to write [s]."""
GUARD = 2**62
"""Position of the byte that the writer locks."""

_ERRNO = re.compile(rf"errno = {errno.EACCES}\b|\[Errno {errno.EACCES}\]")


def keep_lockers_out(handle: int) -> None:
    """Lock the byte at `GUARD` of an open file until the handle is closed; no effect where locks are advisory.

    Raises OSError if another program has locked the file.
    """
    if sys.platform != "win32":
        return
    import ctypes
    import msvcrt
    from ctypes import wintypes

    class Overlapped(ctypes.Structure):
        _fields_ = (
            ("internal", ctypes.c_void_p),
            ("internal_high", ctypes.c_void_p),
            ("offset", wintypes.DWORD),
            ("offset_high", wintypes.DWORD),
            ("event", wintypes.HANDLE),
        )

    exclusive_at_once = 0x3
    where = Overlapped(None, None, GUARD & 0xFFFFFFFF, GUARD >> 32, None)
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    file = wintypes.HANDLE(msvcrt.get_osfhandle(handle))
    if not kernel.LockFileEx(file, exclusive_at_once, 0, 1, 0, ctypes.byref(where)):
        raise ctypes.WinError(ctypes.get_last_error())


def wait_until_free(touch: Callable[[], None], held: float | None = None) -> None:
    """Wait until `touch`, a write without effect, succeeds. Called before HDF5 writes, because HDF5 cannot repeat a
    write.

    Raises DataFileError after `held` [s], by default `HELD`; an error of `touch` with another cause is raised at once.
    """
    patience = HELD if held is None else held
    end = time.monotonic() + patience
    while True:
        try:
            return touch()
        except OSError as error:
            if not is_held(error):
                raise
            if time.monotonic() >= end:
                raise DataFileError(f"{in_use(error)}; it remained locked for {patience:g} s") from error
        time.sleep(PAUSE)


def is_held(error: BaseException) -> bool:
    """Whether an error of HDF5 or of the system indicates that another program has locked the file."""
    return getattr(error, "errno", None) == errno.EACCES or _ERRNO.search(str(error)) is not None


def in_use(error: BaseException) -> str:
    """Message for an error that `is_held` recognises."""
    number = getattr(error, "errno", None) or errno.EACCES
    return f"another program has locked it (errno {number}): close the program that displays or scans it"


class FileSync:
    """Separate handle for flushing a file from the system's cache to the disk, since HDF5 does not give access to its
    own handle on some systems. It also detects changes to the file by other programs.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._handle = os.open(path, os.O_RDWR)
        self._size = 0
        wait_until_free(lambda: keep_lockers_out(self._handle))
        # on some network shares a file's identity changes with every query
        self._identified = os.path.samestat(os.fstat(self._handle), path.stat())
        sync_folder(path.parent)

    def sync(self) -> None:
        """Flush the file to the disk. Raises OSError if the disk fails, and DataFileError like `check`."""
        os.fsync(self._handle)
        self.check()
        self._size = os.fstat(self._handle).st_size

    def touch(self) -> None:
        """Write the first byte again. Raises PermissionError while another program's lock forbids writing."""
        os.lseek(self._handle, 0, os.SEEK_SET)
        first = os.read(self._handle, 1)
        os.lseek(self._handle, 0, os.SEEK_SET)
        os.write(self._handle, first)

    def check(self) -> None:
        """Raise DataFileError if another program has truncated, renamed, replaced or deleted the file.

        Must be called before HDF5 looks for data in the file, because HDF5 would search for hours for truncated data.
        """
        if (size := os.fstat(self._handle).st_size) < self._size:
            raise DataFileError(f"another program has truncated it from {self._size} to {size} bytes")
        try:
            there = self._path.stat()
        except FileNotFoundError:
            raise DataFileError(f"another program has {self._gone()}") from None
        if self._identified and not os.path.samestat(os.fstat(self._handle), there):
            raise DataFileError("another program has replaced it")

    def restore(self) -> None:
        """Write the file again, with the data flushed so far, if it was deleted and no other file has its name."""
        with suppress(OSError):
            if os.fstat(self._handle).st_nlink or self._path.exists():
                return
            with self._path.open("xb") as copy, os.fdopen(os.dup(self._handle), "rb") as kept:
                kept.seek(0)
                shutil.copyfileobj(kept, copy)
                os.fsync(copy.fileno())

    def close(self) -> None:
        """Close the file; may be called repeatedly."""
        with suppress(OSError):
            os.close(self._handle)
        self._handle = -1

    def _gone(self) -> str:
        if not os.fstat(self._handle).st_nlink:
            return "deleted it"
        with suppress(OSError):
            # on Linux the current name of an open file can be queried
            return f"renamed it to {Path(os.readlink(f'/proc/self/fd/{self._handle}')).name}"
        return "renamed or deleted it"


def sync_folder(folder: Path) -> None:
    """Flush the directory entry of a new file to the disk, if the system requires it."""
    # Windows cannot open folders, and flushes their entries without a request
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
