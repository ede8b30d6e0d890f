"""What a copied file must have although it was lost: tables, and a drive. A row without all of its columns is none."""

from collections.abc import Iterable

import numpy as np

from bench.record import hdf5
from bench.record.declared import TABLES
from bench.record.errors import RecordError
from bench.record.rows import Rows
from bench.record.samples import create_drive, read_channel, read_channels

_ROWS_AT_ONCE = 2**18


def drop_channels(entry: hdf5.Group, lost: dict[str, str]) -> None:
    """Take out the channels of which nobody can say what their counts are; why goes to `lost`."""
    instrument = hdf5.group(entry, "instrument")
    for name in hdf5.names(instrument):
        if hdf5.has(instrument, f"{name}/counts"):
            try:
                read_channel(instrument, name)
            except RecordError as error:
                lost[f"/entry/instrument/{name}/counts"] = str(error)
                hdf5.delete(instrument, f"{name}/counts")


def renew_drive(entry: hdf5.Group) -> None:
    """Where the drive was lost there is one that says nothing: NaN at every sample."""
    instrument = hdf5.group(entry, "instrument")
    if hdf5.has(instrument, "drive/voltage"):
        return
    counts = [hdf5.dataset(instrument, f"{each.name}/counts") for each in read_channels(instrument)]
    if hdf5.has(instrument, "drive"):
        hdf5.delete(instrument, "drive")
    made = create_drive(instrument, (counts[0].chunks or (1,))[0])
    rows = min(each.shape[0] for each in counts)
    for start in range(0, rows, _ROWS_AT_ONCE):
        hdf5.append(made, np.full(min(_ROWS_AT_ONCE, rows - start), np.nan, dtype=np.float32))


def renew_tables(entry: hdf5.Group, lost: Iterable[str]) -> None:
    """Make every table empty of which a path is `lost`; the journal may fill it again."""
    gone = tuple(lost)
    for path, fields in TABLES.items():
        if any(each == f"/entry/{path}" or each.startswith(f"/entry/{path}/") for each in gone):
            folder, _, name = path.rpartition("/")
            parent = hdf5.group(entry, folder) if folder else entry
            if name in parent:
                hdf5.delete(parent, name)
            Rows(parent, name, fields)
