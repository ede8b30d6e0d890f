"""Locks of other programs on the data file while it is being written.

On Windows locks are mandatory: while a reader with the usual locks of HDF5 has the file open, every write fails with
errno 13, and HDF5 cannot repeat a flush that has failed. Therefore the writer excludes such readers: it locks one byte
far beyond the end of the file, which every lock of the whole file overlaps. Readers without locks, such as this
program, are not affected.
"""

import errno
import re
import sys
import time
from collections.abc import Callable

from bench.datafile.hdf5_reading import DataFileError

HELD = 10.0
"""Time for which another program, such as a virus scanner, may hold the file [s]; samples meanwhile wait in memory."""
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
                raise DataFileError(f"{in_use(error)} and has held it for {patience:g} s") from error
        time.sleep(PAUSE)


def is_held(error: BaseException) -> bool:
    """Whether an error of HDF5 or of the system states that another program holds the file."""
    return getattr(error, "errno", None) == errno.EACCES or _ERRNO.search(str(error)) is not None


def in_use(error: BaseException) -> str:
    """Message for an error that `is_held` recognises."""
    number = getattr(error, "errno", None) or errno.EACCES
    return f"another program has locked it (errno {number}): close the program that displays or scans it"
