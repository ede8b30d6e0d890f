"""Functions for the reading process, which imports little for them: a file that stalls in HDF5, and errors."""

from pathlib import Path

import h5py

from sim.errors import InvalidInput


def stalled(path: Path) -> object:
    """Open a FIFO, for which HDF5 waits in the system until it is written, as for a file of a share that stalls."""
    return h5py.File(path, "r").filename


def refused(*_given: object) -> None:
    raise InvalidInput("colour", "red", "blue")


def mistaken(*_given: object) -> None:
    raise ZeroDivisionError("ours")
