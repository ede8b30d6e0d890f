"""Heading of a campaign file: the texts that describe its run, without samples, points and journal."""

from dataclasses import dataclass
from pathlib import Path

from bench.datafile import hdf5
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reason
from bench.datafile.opening import open_file

MEMBERS = ("status", "summary", "start_time", "metadata")
"""Members of /entry that are read for the heading."""


@dataclass(frozen=True)
class Heading:
    """Status, summary (the reason for the end), time of creation (ISO 8601) and metadata of a campaign. The status of a
    file that is being written, or whose writer was killed, is "running".
    """

    status: str
    summary: str
    start_time: str
    metadata: dict[str, str]


def read_heading(path: Path) -> Heading:
    """The heading of a campaign file, read without locking the file or disturbing its writer.

    Raises InvalidInput for a file of another kind, and DataFileError for a file whose heading cannot be read; damage to
    other parts is not detected.
    """
    with open_file(path, judging=True, only=MEMBERS) as file:
        try:
            entry = hdf5.group(file, "entry")
            metadata = hdf5.group(entry, "metadata")
            return Heading(
                hdf5.read_text(entry, "status"),
                hdf5.read_text(entry, "summary"),
                hdf5.read_text(entry, "start_time"),
                {name: hdf5.read_text(metadata, name) for name in hdf5.names(metadata)},
            )
        except UNREADABLE as error:
            raise DataFileError(
                f"{path} is damaged ({reason(error)}): `rockbench file recover` restores the readable part"
            ) from error
