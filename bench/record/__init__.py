"""The record: one HDF5 file per campaign. `bench.record.open(path)` reads one."""

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bench.record.reader import Record


def open(path: str | PathLike[str]) -> "Record":
    """The file of a campaign: its runs, channels, points and the rest, read when asked for. Use it in `with`.

    Raises InvalidInput when there is no such file or it is not one of ours, RecordError when it cannot be read.
    """
    from bench.record.reader import open_record  # HDF5 is loaded by those who read

    return open_record(Path(path))
