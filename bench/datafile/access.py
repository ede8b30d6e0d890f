# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""Settings with which HDF5 opens files: format, locks and retries."""

import ctypes
import os
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, cast

import h5py
import h5py.h5f
import h5py.h5p

h5f, h5p = cast(Any, h5py.h5f), cast(Any, h5py.h5p)

# The oldest format in which a file can be read while it is being written; fixed, so that older tools can read the files
# of newer writers.
VERSIONS = ("v110", "v110")

RETRIES = 28
"""Number of attempts to read metadata of a file that is being written; the pauses between them double from 1 ns and
last 0.3 s in total.

With HDF5's default of 100 attempts, reading data that another program has truncated would practically never end, and
would block the whole process, including the drive.
"""


def locking(system: str = sys.platform) -> Literal["best-effort"] | bool:
    """The locking mode of every file, for h5py.

    On Windows locks are mandatory: a reader of a file that is being written would make its writer fail at the next
    flush or at the end, with errno 13. No locks are used there; single-writer mode and creation without replacement
    protect the file. Elsewhere locks are advisory, and network shares may have none.
    """
    return False if system == "win32" else "best-effort"


def open_living(path: Path) -> Any:
    """Open a file that is being written, in single-writer mode, for reading."""
    return _opened(path, h5f.ACC_RDONLY | h5f.ACC_SWMR_READ)


def open_to_write(path: Path) -> Any:
    """Open a new file, which its creator has closed, in single-writer mode to append to its datasets.

    A file switched to this mode while it is open would use HDF5's default number of attempts.
    """
    return _opened(path, h5f.ACC_RDWR | h5f.ACC_SWMR_WRITE)


def _opened(path: Path, mode: int) -> Any:
    made = h5p.create(h5p.FILE_ACCESS)
    made.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
    made.set_alignment(1, 1)
    made.set_file_locking(bool(locking()), ignore_when_disabled=True)
    if (limit := _retry_limit()) is not None:
        limit(made.id, RETRIES)
    return h5py.File(h5f.open(os.fsencode(path), mode, fapl=made))


@lru_cache(maxsize=1)
def _retry_limit() -> Any:
    """The function of the HDF5 library that limits retries, which h5py does not expose; None if it is not found."""
    for library in (cast(str, h5p.__file__), str(Path(h5py.__file__).parent / "hdf5.dll")):
        try:
            found = ctypes.CDLL(library).H5Pset_metadata_read_attempts
        except (OSError, AttributeError):
            continue
        found.argtypes, found.restype = [ctypes.c_int64, ctypes.c_uint], ctypes.c_int
        return found
    return None
