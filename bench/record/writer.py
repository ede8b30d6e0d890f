"""The file of one campaign while it is written: it can be read at any moment and survives the death of the writer."""

import json
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.events import Event, FitFinished, PointFinished, SpecimenIdentified
from bench.record import findings, fits, hdf5
from bench.record.declared import COUNTED, EVENT_TABLES
from bench.record.diary import Diary, beside
from bench.record.disk import Platter
from bench.record.errors import RecordError, reason
from bench.record.layout import (
    STATUS_WIDTH,
    SUMMARY_WIDTH,
    TIME_WIDTH,
    Skeleton,
    Status,
    build,
    now,
)
from bench.record.timeline import Timeline
from drivers.rig import Counts
from sim.errors import InvalidInput

_EXISTS = "the file exists and is never overwritten; name another"

ROOM = 1_000_000
"""Bytes that must be free before a file is begun: many times an empty record."""


def _try_folder(folder: Path) -> None:
    """Raise OSError unless a file of some size can be made in `folder`.

    HDF5 tells poorly why a file cannot be begun, and crashes the process when the disk fills up at that moment.
    """
    with tempfile.TemporaryFile(dir=folder, prefix=".room-") as room:
        room.write(bytes(ROOM))


class RecordWriter:
    """Creates the file and appends to it. Methods raise what h5py raises when the disk fails, mostly OSError.

    Raises InvalidInput when the file exists, cannot be created, or would hold something that cannot be stored, and
    RecordError when the disk fails while it is begun.
    """

    def __init__(self, path: Path, skeleton: Skeleton) -> None:
        skeleton.check()
        self._path = path
        for taken in (path, beside(path)):
            if taken.exists():
                raise InvalidInput("record", str(taken), _EXISTS)
        try:
            _try_folder(path.parent)
            self._file = hdf5.create(path)
        except FileExistsError:
            raise InvalidInput("record", str(path), _EXISTS) from None
        except OSError as error:
            raise InvalidInput(
                "record",
                str(path),
                f"the file cannot be created ({error.strerror or reason(error)}); name another folder",
            ) from error
        try:
            self._parts = build(self._file, skeleton)
            self._file.swmr_mode = True
            self._file.flush()
            self._diary = Diary(beside(path))
            self._platter = Platter(path)
            self._platter.sync()
        except (OSError, RuntimeError) as error:
            hdf5.let_go(self._file)
            path.unlink(missing_ok=True)
            raise RecordError(f"{path} could not be begun ({reason(error)}): see to the disk") from error
        self._tables = [self._parts.rows[name] for name in COUNTED if name != "samples"]
        self._timeline = Timeline(skeleton.sample_rate)
        self._complete: list[int] = []
        self._point_fields = tuple(skeleton.point_type.model_fields)

    @property
    def full_chunks(self) -> int:
        """How many chunks of samples wait."""
        return self._parts.samples.full_chunks

    def add_block(self, time: float, run: int, first: int, counts: Counts, drive: NDArray[np.float32]) -> None:
        """Append a block: counts of shape (n_channels, n), drive of shape (n,) [V]."""
        self._parts.rows["blocks"].add(len(self._parts.samples), run, first, time)
        self._parts.samples.add(counts, drive, self._timeline.seconds(time, run, first, len(drive)))

    def add_event(self, event: Event) -> None:
        """Append an event that is no block."""
        rows = self._parts.rows
        if (table := EVENT_TABLES.get(type(event))) is not None:
            for row in table.rows(event):
                rows[table.name].add(*row)
        if isinstance(event, FitFinished):
            fits.add(rows, event)
        if isinstance(event, SpecimenIdentified):
            findings.add(rows, event.time, event.identified)
        if not event.journalled:
            return
        kind, text, more = type(event).__name__, event.line, dict[str, Any]()
        if isinstance(event, PointFinished):
            text = f"row {len(rows['points'])} of points"
            rows["points"].add(*(getattr(event.point, name) for name in self._point_fields))
            more = {"point": json.loads(event.point.model_dump_json())}
        if isinstance(event, SpecimenIdentified):
            more = {"identified": event.identified.model_dump(mode="json")}
        rows["events"].add(event.time, kind, text)
        self._diary.add(event.time, kind, text, more)

    def commit(self, *, partial: bool) -> None:
        """Bring what waits onto the disk, within reach of readers; samples that fill no chunk only if `partial`."""
        samples, tables = self._parts.samples, self._tables
        samples.write(partial=partial)
        for rows in tables:
            rows.write()
        complete = [samples.written, *(rows.written for rows in tables)]
        if complete == self._complete:
            return
        # a failing disk or computer may keep the new length of a dataset without its rows, so what is whole is
        # counted afterwards, in a place that exists already
        self._diary.sync()
        self._flush()
        self._parts.complete[...] = complete
        self._flush()
        self._complete = complete

    def finish(self, status: Status, summary: str) -> None:
        """Write everything that waits and the status, and close the file."""
        self.commit(partial=True)
        hdf5.replace_text(self._parts.summary, summary, SUMMARY_WIDTH)
        hdf5.replace_text(self._parts.end_time, now(), TIME_WIDTH)
        hdf5.replace_text(self._parts.status, status, STATUS_WIDTH)
        self._parts.checksums.seal({grown.path: grown.checksum for grown in self._parts.grown})
        self._flush()
        self._file.close()
        if whole := len(self._parts.rows["fits"]):
            # without them all is still there; recovery makes them when another program holds the file now
            with suppress(OSError, RuntimeError), hdf5.open_again(self._path) as file:
                fits.add_views(hdf5.group(file, "entry"), whole)
        self._platter.sync()
        self._let_go()

    def abandon(self) -> None:
        """Let go of the file after an error; what was committed stays readable."""
        hdf5.let_go(self._file)
        self._let_go()

    def _flush(self) -> None:
        self._file.flush()
        self._platter.sync()

    def _let_go(self) -> None:
        self._parts.samples.close()
        self._platter.close()
        self._diary.close()
