"""The data file: one HDF5 file per campaign. `bench.datafile.open(path)` reads one."""

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bench.datafile.reader import DataFile


def open(path: str | PathLike[str]) -> "DataFile":
    """Open the file of a campaign; its runs, channels, points and other contents are read on access.

    Use it in a `with` statement. Raises InvalidInput if the file does not exist or is of another kind, and
    DataFileError if it cannot be read.
    """
    from bench.datafile.reader import open_datafile  # h5py is imported only when a file is read

    return open_datafile(Path(path))
