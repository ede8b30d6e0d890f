"""Copying of the intact, readable objects of a damaged file, truncated to complete rows."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.declared import TABLES, part_of
from bench.datafile.fields import Kind, fields_from
from bench.datafile.hdf5 import Dataset, Group
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reason
from bench.datafile.opening import intact_rows, is_within
from bench.datafile.rows import rows_of
from bench.datafile.samples import create_drive, read_channel, read_channels

BYTES_AT_ONCE = 2**22


@dataclass
class Copying:
    """Copy of a file of `size` bytes: up to `counted` rows of each part, without the objects at the paths in `leave`.

    `lost` receives a message for each unreadable path; growing datasets are copied up to the first unreadable row.
    """

    counted: Mapping[str, int]
    size: int
    leave: frozenset[str]
    lost: dict[str, str] = field(default_factory=dict[str, str])

    def copy(self, source: Group, target: Group) -> None:
        """Copy attributes and members into an empty group."""
        copy_attributes(source, target, self.lost)
        for name, member in hdf5.members(source, self.lost):
            path = f"{source.name.rstrip('/')}/{name}"
            if path in self.leave:
                continue
            if isinstance(member, str):
                hdf5.link(target, name, member)
            elif hdf5.is_dataset(member):
                self._copy_dataset(member, target, name)
            else:
                self.copy(hdf5.group(source, name), target.create_group(name, track_order=True))

    def _copy_dataset(self, stored: Dataset, target: Group, name: str) -> None:
        try:
            attributes = hdf5.attributes(stored)
            if "kind" in attributes:
                Kind(attributes["kind"])
            if hdf5.grows(stored):
                copied = self._copy_grown(stored, target, name)
            elif is_within(stored, self.size):
                copied = target.create_dataset(name, data=stored[()], dtype=stored.dtype)
            else:
                self.lost[stored.name] = f"{stored.name} extends beyond the end of the file: the file is truncated"
                return
        except UNREADABLE as error:
            # the values are meaningless without their attributes
            self.lost[stored.name] = f"{stored.name} cannot be read ({reason(error)})"
            return
        hdf5.describe(copied, **attributes)

    def _copy_grown(self, stored: Dataset, target: Group, name: str) -> Dataset:
        chunk = (stored.chunks or (1,))[0]
        copied = hdf5.grow(target, name, stored.dtype, chunk, compress=stored.compression is not None)
        rows = self.counted[part_of(stored.name, self.counted)]
        rows = min(rows, intact_rows(stored, self.size)) if rows else 0
        done, step = 0, max(1, BYTES_AT_ONCE // stored.dtype.itemsize)
        while done < rows:
            count = min(step, rows - done)
            try:
                values = stored[done : done + count]
            except (OSError, RuntimeError):
                # halve the step until the first unreadable row is found
                if count == 1:
                    break
                step = count // 2
                continue
            hdf5.append(copied, values)
            done += len(values)
        return copied


def copy_attributes(source: Group, target: Group, lost: dict[str, str]) -> None:
    """Copy the attributes of a group, unchanged, up to the first unreadable one."""
    try:
        for name in source.attrs:
            target.attrs[name] = source.attrs[name]
    except UNREADABLE as error:
        lost[f"{source.name} attributes"] = f"attributes of {source.name} cannot be read ({reason(error)})"


_ROWS_AT_ONCE = 2**18


def drop_channels(entry: hdf5.Group, lost: dict[str, str]) -> None:
    """Remove the counts of every channel whose conversion cannot be read, and add a message to `lost`."""
    instrument = hdf5.group(entry, "instrument")
    for name in hdf5.names(instrument):
        if hdf5.has(instrument, f"{name}/counts"):
            try:
                read_channel(instrument, name)
            except DataFileError as error:
                lost[f"/entry/instrument/{name}/counts"] = str(error)
                hdf5.delete(instrument, f"{name}/counts")


def renew_drive(entry: hdf5.Group) -> None:
    """If the dataset of the drive is lost, replace it by one with NaN at every sample."""
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


def renew_tables(
    entry: hdf5.Group, lost: Iterable[str], own: Iterable[str], lines: Iterable[Mapping[str, Any]]
) -> None:
    """Replace every table that has a dataset among the `lost` paths by an empty one; its rows may be recovered from the
    `lines` of the journal. `own` are the paths of the tables of the protocol's events; such a table is removed if no
    line declares its columns.
    """
    gone = tuple(lost)
    declared = {line["table"]: line["fields"] for line in lines if "table" in line and "fields" in line}
    for path in (*TABLES, *own):
        if any(each == f"/entry/{path}" or each.startswith(f"/entry/{path}/") for each in gone):
            folder, _, name = path.rpartition("/")
            parent = hdf5.group(entry, folder) if folder else entry
            if name in parent:
                hdf5.delete(parent, name)
            if fields := TABLES.get(path) or fields_from(declared.get(path)):
                rows_of(parent, name, fields)


def cut(entry: hdf5.Group, growing: Iterable[hdf5.Dataset], counted: Mapping[str, int]) -> dict[str, int]:
    """Truncate the `growing` datasets of each part to the length of the shortest, and make samples and blocks
    consistent.

    The last known block is omitted if later `counted` blocks were lost, because its end is unknown. Returns the number
    of rows of every part.
    """
    parts: dict[str, list[hdf5.Dataset]] = {name: [] for name in counted}
    for stored in growing:
        parts[part_of(stored.name, counted)].append(stored)
    rows = {name: min((each.shape[0] for each in stored), default=0) for name, stored in parts.items()}
    row, run, first = (
        hdf5.dataset(entry, f"instrument/blocks/{name}")[: rows["blocks"]] for name in ("row", "run", "first")
    )
    lost = rows["blocks"] < counted["blocks"]
    rows["blocks"], rows["samples"] = _placed(row, run, first, rows["samples"], lost=lost)
    for name, stored in parts.items():
        for each in stored:
            if each.shape[0] != rows[name]:
                each.resize((rows[name],))
    return rows


def _placed(
    row: NDArray[np.int64], run: NDArray[np.int64], first: NDArray[np.int64], samples: int, *, lost: bool
) -> tuple[int, int]:
    """Numbers of consistent blocks and samples at the beginning of the file.

    In consistent blocks, rows begin at 0 and ascend, run numbers never decrease, and within a run samples may be
    missing but not repeated.
    """
    if not len(row) or row[0] != 0 or run[0] < 1 or first[0] < 0:
        return 0, 0
    length, runs = np.diff(row), np.diff(run)
    fits = (length > 0) & (runs >= 0) & (first[1:] >= np.where(runs == 0, first[:-1] + length, 0))
    # either of two inconsistent blocks may be the wrong one
    last = len(row) - 1 if fits.all() else int(np.argmin(fits))
    if lost or not fits.all():
        samples = min(samples, int(row[last]))
    return int(np.searchsorted(row[: last + 1], samples)), samples
