"""A file whose reading stalls in HDF5, for processes that import nothing else."""

from pathlib import Path

import h5py


def stalled(path: Path) -> object:
    """Open a FIFO, for which HDF5 waits in the system until it is written, as for a file of a share that stalls."""
    return h5py.File(path, "r").filename
