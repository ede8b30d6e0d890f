"""Writer of a campaign file, which can be read while it is being written and after a crash of the writer."""

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.declared import counters, event_table
from bench.datafile.findings_tables import add_findings, add_fit, add_fit_views
from bench.datafile.hdf5_reading import DataFileError, reason
from bench.datafile.held import FileSync, wait_until_free
from bench.datafile.layout import (
    STATUS_WIDTH,
    SUMMARY_WIDTH,
    TIME_WIDTH,
    Skeleton,
    Status,
    build,
    now,
)
from bench.datafile.samples import Timeline
from bench.events import Event, PointFinished
from bench.findings import FitFinished, SpecimenIdentified
from bench.unfinished import replace, unfinished
from drivers.rig import Counts, RawValues
from sim.errors import InvalidInput


def journal_path(path: Path) -> Path:
    """Path of the journal of the data file `path`: the same name, ending in .events.jsonl."""
    return path.with_suffix(".events.jsonl")


class JournalWriter:
    """Writer of a new journal. The constructor raises FileExistsError if it exists, and every method raises OSError if
    the disk fails.
    """

    def __init__(self, path: Path) -> None:
        self._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        self._written = False

    def add(self, time: float, kind: str, text: str, more: Mapping[str, Any]) -> None:
        """Append one event at `time` [s], with the additional keys of `more`."""
        line = json.dumps({"time": time, "kind": kind, "text": text, **more}, ensure_ascii=False) + "\n"
        # one unbuffered call per line, so that a killed program leaves complete lines
        os.write(self._handle, line.encode())
        self._written = True

    def sync(self) -> None:
        """Flush the additions to the disk."""
        if self._written:
            os.fsync(self._handle)
            self._written = False

    def close(self) -> None:
        """Close the file; may be called repeatedly."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1


def read_journal(path: Path) -> Iterator[dict[str, Any]]:
    """Yields the parsed lines of a journal, up to the first truncated or damaged one; none if there is no journal."""
    if not path.is_file():
        return
    # not `splitlines`, because a text may contain other line separators
    for line in path.read_text(encoding="utf-8", errors="replace").split("\n"):
        try:
            read = json.loads(line)
        except (json.JSONDecodeError, RecursionError):
            return
        if not (isinstance(read, dict) and {"time", "kind", "text"} <= read.keys()):
            return
        yield read


_EXISTS = "the file exists and is never overwritten; choose another name"

ROOM = 1_000_000
"""Free space required before a file is created [bytes]: many times the size of an empty file."""


def _check_folder(folder: Path) -> None:
    """Raise OSError unless a file of `ROOM` bytes can be created in `folder`.

    HDF5 does not report the cause of a failure clearly, and crashes the process if the disk becomes full during
    creation.
    """
    with tempfile.TemporaryFile(dir=folder, prefix=".room-") as room:
        room.write(bytes(ROOM))


def _rename_new(temporary: Path, path: Path) -> None:
    """Rename a complete file. Raises InvalidInput if `path` exists."""
    try:
        try:
            # unlike a rename, a link never replaces a file that another program has created meanwhile
            os.link(temporary, path)
        except FileExistsError:
            raise
        except OSError:
            # not every file system has links: only an empty file of this process is replaced
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
            replace(temporary, path)
    except FileExistsError:
        raise InvalidInput("record", str(path), _EXISTS) from None


class DataFileWriter:
    """Writer of a new file and its journal.

    If the disk fails, the methods raise h5py's exceptions, mostly OSError, or DataFileError. The constructor raises
    InvalidInput if one of the files exists or cannot be created, or if the skeleton has contents that cannot be stored,
    and DataFileError if the disk fails during creation.
    """

    def __init__(self, path: Path, skeleton: Skeleton) -> None:
        skeleton.check()
        self._path = path
        for taken in (path, journal_path(path)):
            if taken.exists():
                raise InvalidInput("record", str(taken), _EXISTS)
        # a program that looks for files in the folder finds a complete one, even if this process is killed here
        with unfinished(path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")) as temporary:
            try:
                _check_folder(path.parent)
                self._file = hdf5.create(temporary)
            except OSError as error:
                raise InvalidInput(
                    "record",
                    str(path),
                    f"the file cannot be created ({error.strerror or reason(error)}); choose another folder",
                ) from error
            try:
                parts = build(self._file, skeleton)
                self._file.close()
                _rename_new(temporary, path)
            except (OSError, RuntimeError) as error:
                hdf5.release(self._file)
                raise DataFileError(f"{path} could not be created ({reason(error)}): check the disk") from error
        try:
            self._file = hdf5.open_to_write(path)
            self._parts = parts.reopened(self._file)
            self._file.flush()
            self._journal = JournalWriter(journal_path(path))
            self._file_sync = FileSync(path)
            self._file_sync.sync()
        except (OSError, RuntimeError) as error:
            hdf5.release(self._file)
            path.unlink(missing_ok=True)
            raise DataFileError(f"{path} could not be created ({reason(error)}): check the disk") from error
        self._counters = counters(skeleton.own)
        self._own = dict(skeleton.own)
        self._timeline = Timeline(skeleton.sample_rate)
        self._complete: list[int] = []
        self._point_fields = tuple(skeleton.point_type.model_fields)

    def has_table(self, event: type[Event]) -> bool:
        """Whether the file has a table for this type of event, or the type needs none; False for an invalid
        declaration.
        """
        try:
            return (table := event_table(event)) is None or table.name in self._parts.rows
        except InvalidInput:
            return False

    @property
    def full_chunks(self) -> int:
        """Number of complete chunks among the pending samples."""
        return self._parts.samples.full_chunks

    def add_block(self, time: float, run: int, first: int, counts: Counts, drive: NDArray[np.float32]) -> None:
        """Append a block: counts of shape (n_channels, n), drive of shape (n,) [V]."""
        self._parts.rows["blocks"].add(len(self._parts.samples), run, first, time)
        self._parts.samples.add(counts, drive, self._timeline.seconds(time, run, first, len(drive)))

    def add_raw(self, run: int, sensor: int, raw: RawValues) -> None:
        """Append raw values of the sensor whose channel has the number `sensor`."""
        of_all = (np.full(len(raw), number, np.int64) for number in (run, sensor))
        self._parts.rows["raw_values"].extend(*of_all, raw.index, raw.time, raw.code, raw.arrival)

    def add_event(self, event: Event) -> None:
        """Append an event other than a block; an event whose table the file lacks is stored in the journal only."""
        rows = self._parts.rows
        more = dict[str, Any]()
        stored = self.has_table(type(event))
        if stored and (table := event_table(type(event))) is not None:
            if table.path in self._own:
                # so that a recovery can create the table from the journal, without the protocol
                more |= {"table": table.path, "fields": [asdict(each) for each in self._own.pop(table.path)]}
            for row in table.rows(event):
                rows[table.name].add(*row)
                if table.single:
                    more["table"] = table.path
                    # JSON has only finite numbers
                    more["columns"] = {
                        field.name: None if value != value else value
                        for field, value in zip(table.fields, row, strict=True)
                    }
        if isinstance(event, FitFinished):
            add_fit(rows, event)
        if isinstance(event, SpecimenIdentified):
            add_findings(rows, event.time, event.identified)
        if stored and not event.journalled:
            return
        kind, text = type(event).__name__, event.line
        if isinstance(event, PointFinished):
            text = f"row {len(rows['points'])} of points"
            rows["points"].add(*(getattr(event.point, name) for name in self._point_fields))
            more["point"] = json.loads(event.point.model_dump_json())
        if isinstance(event, SpecimenIdentified):
            more["identified"] = event.identified.model_dump(mode="json")
        rows["events"].add(event.time, kind, text)
        self._journal.add(event.time, kind, text, more)

    def commit(self, *, partial: bool) -> None:
        """Write pending rows to the disk, visible to readers; incomplete compressed chunks only if `partial`."""
        samples, tables = self._parts.samples, self._parts.rows
        self._file_sync.check()
        wait_until_free(self._file_sync.touch)
        samples.write(partial=partial)
        for rows in tables.values():
            rows.write(partial=partial)
        written = {"samples": samples.written, **{name: rows.written for name, rows in tables.items()}}
        complete = [written.get(name, 0) for name in self._counters]
        if complete == self._complete:
            return
        # if the disk or computer fails, a dataset's new length may be stored without its rows; the count of complete
        # rows is therefore written afterwards, in place
        self._journal.sync()
        self._flush()
        hdf5.overwrite(self._parts.complete, complete)
        self._flush()
        self._complete = complete

    def finish(self, status: Status, summary: str) -> None:
        """Write all pending data and the status, and close the file."""
        self.commit(partial=True)
        hdf5.replace_text(self._parts.summary, summary, SUMMARY_WIDTH)
        hdf5.replace_text(self._parts.end_time, now(), TIME_WIDTH)
        hdf5.replace_text(self._parts.status, status, STATUS_WIDTH)
        self._parts.checksums.seal({grown.path: grown.checksum for grown in self._parts.grown})
        self._flush()
        wait_until_free(self._file_sync.touch)
        self._file.close()
        if whole := len(self._parts.rows["fits"]):
            # the data are complete without the views; if another program has locked the file, a recovery can add them
            # later
            with suppress(OSError, RuntimeError), hdf5.open_to_extend(self._path) as file:
                add_fit_views(hdf5.group(file, "entry"), whole)
        self._file_sync.sync()
        self._let_go()

    def abandon(self) -> None:
        """Release the file after an error. Committed data stay readable."""
        hdf5.release(self._file)
        self._file_sync.restore()
        self._let_go()

    def _flush(self) -> None:
        self._file.flush()
        self._file_sync.sync()

    def _let_go(self) -> None:
        self._parts.samples.close()
        self._file_sync.close()
        self._journal.close()
