"""What stands between a file and a power failure."""

import os
from contextlib import suppress
from pathlib import Path


class Platter:
    """Brings what has been written to a file onto the disk itself, out of the system's cache.

    The handle is its own: HDF5 keeps its one to itself on some systems.
    """

    def __init__(self, path: Path) -> None:
        self._handle = os.open(path, os.O_RDWR)
        sync_folder(path.parent)

    def sync(self) -> None:
        """Return when all is on the disk. Raises OSError when the disk fails."""
        os.fsync(self._handle)

    def close(self) -> None:
        """Let go of the file. Allowed any number of times."""
        with suppress(OSError):
            os.close(self._handle)
        self._handle = -1


def sync_folder(folder: Path) -> None:
    """Bring the name of a new file onto the disk, where the system needs telling."""
    # Windows opens no folders, and writes their entries by itself
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
