"""The recorder, an event subscriber that writes a campaign to its data file in a separate thread, so that a slow disk
does not delay the drive.
"""

import queue
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.datafile.hdf5_reading import DataFileError, reason
from bench.datafile.held import in_use, is_held
from bench.datafile.layout import Skeleton, Status
from bench.datafile.samples import CHUNK_TIME
from bench.datafile.tables import Table
from bench.datafile.writer import DataFileWriter
from bench.events import Acquired, Event, PointFinished, Progress, StateChanged, ValuesReceived
from drivers.rig import Channel, Counts
from sim import waiting
from sim.errors import InvalidInput
from sim.parameters import Parameters

PERIOD = 0.5
"""Maximum time between two writes of pending data [s]; equal to the duration of a chunk of samples in real time."""

PAUSE = 0.05
"""Minimum time between two writes of events [s], so that a slow disk receives many events in one write."""

COLLECT = 0.02
"""Time during which blocks are collected before they are taken from the queue [s]; other events are taken at once."""

BATCH = 100
"""Number of complete chunks of samples that are written together when samples arrive faster than real time; more queued
items than this wake the thread.
"""

BACKLOG = 4096
"""Maximum number of events waiting for the disk: with blocks of 0.1 s, those of several minutes. A longer backlog ends
the run.
"""

PATIENCE = 60.0
"""Longest wait for the disk [s] while the bench is at rest: at the end of the campaign and in `sync`."""


@dataclass(frozen=True)
class _Block:
    time: float
    run: int
    first: int
    counts: Counts
    drive: NDArray[np.float32]


@dataclass(frozen=True)
class _Sync:
    done: threading.Event


@dataclass(frozen=True)
class _End:
    status: Status
    summary: str


class Recorder:
    """Recorder of a new HDF5 file, called with each event of the engine and closed at the end.

    In real time, samples are written within about a second, journalled events almost at once. The next call after a
    disk error raises DataFileError, once; later data are not recorded, and earlier data stay readable. A disk that is
    too slow causes the same error; a call waits for the disk for at most `hold_up` seconds, for runs in virtual time.
    `chunk_time` is the duration of a chunk of samples [s].

    `metadata` is stored as strings under /entry/metadata, `tables` (such as {"prediction": ...}) under /entry. `events`
    are the protocol's event types that have a table in the file; its other events are stored only as lines of the
    journal. Raises InvalidInput, without creating a file, if `path` exists or cannot be created, or if a name or table
    is invalid.
    """

    def __init__(
        self,
        path: Path,
        *,
        channels: Sequence[Channel],
        sample_rate: float,
        point_type: type[Parameters],
        metadata: Mapping[str, str],
        tables: Mapping[str, Table] | None = None,
        events: Sequence[type[Event]] = (),
        title: str = "rocking-bench campaign",
        hold_up: float = 0.0,
        chunk_time: float = CHUNK_TIME,
    ) -> None:
        self.path = path
        self._point_type = point_type
        self._n_channels = len(channels)
        self._numbers = {channel.name: number for number, channel in enumerate(channels)}
        self._writer = DataFileWriter(
            path, Skeleton(title, tuple(channels), sample_rate, point_type, metadata, tables or {}, events, chunk_time)
        )
        self._queue: queue.Queue[_Block | Event | _Sync] = queue.Queue(BACKLOG)
        self._wanted = threading.Event()
        self._end: _End | None = None
        self._hold_up = hold_up
        self._failure: DataFileError | None = None
        self._behind: DataFileError | None = None
        self._failure_reported = False
        self._closed = False
        self._committed, self._pressing, self._partial = time.monotonic(), False, False
        # a daemon thread, so that a program that ends with an error does not wait for the recorder; the file remains
        # readable
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def __call__(self, event: Event) -> None:
        """Queue an event. Raises DataFileError if it cannot be recorded or an earlier event could not be written."""
        if self._closed:
            raise DataFileError(f"{self.path} is closed: {type(event).__name__} at {event.time:.3f} s was not recorded")
        self._raise_failure()
        if self._failure is not None or self._behind is not None:
            return
        if isinstance(event, Acquired):
            self._enqueue(self._checked(event))
        elif isinstance(event, PointFinished) and not isinstance(event.point, self._point_type):
            raise DataFileError(
                f"point of type {type(event.point).__name__} was not recorded: {self.path} is for points of type"
                f" {self._point_type.__name__}"
            )
        elif not isinstance(event, Progress):
            self._enqueue(event)

    def stores(self, event: type[Event]) -> bool:
        """Whether events of this type are stored with their columns, if any, and not only as lines of the journal."""
        return self._writer.has_table(event)

    def sync(self) -> None:
        """Wait until all queued events are in the file. Raises DataFileError, once, if they could not be written."""
        if not self._closed:
            marker = _Sync(threading.Event())
            if not (self._put(marker, PATIENCE) and waiting.wait(marker.done, PATIENCE)):
                self._stop_recording(f"has not responded for {PATIENCE:g} s")
        self._raise_failure()

    def close(self, status: Status | str, summary: str = "") -> None:
        """Write pending data, status and end time, and close the file; closing again has no effect.

        Raises InvalidInput for a status that does not end a campaign, and DataFileError if the end could not be
        written. An unresponsive disk does not prevent the program from ending.
        """
        ends = [str(end) for end in Status if end not in (Status.RUNNING, Status.INTERRUPTED)]
        if status not in ends:
            raise InvalidInput("status of the record", str(status), "one of " + ", ".join(ends))
        if self._closed:
            return
        self._closed = True
        self._end = _End(Status(status), summary)
        # wakes the thread if it is waiting; if it is writing, it checks for the end afterwards
        self._put(_Sync(threading.Event()), 0.0)
        if not waiting.join(self._thread, PATIENCE):
            self._stop_recording(f"has not responded for {PATIENCE:g} s")
        self._raise_failure()

    def _enqueue(self, item: _Block | Event) -> None:
        if not self._put(item, self._hold_up):
            self._stop_recording(f"is {BACKLOG} events behind")
            self._raise_failure()

    def _put(self, item: _Block | Event | _Sync, patience: float) -> bool:
        """Queue an item, waiting up to `patience` seconds for space; False if the queue remained full."""
        queued = waiting.put(self._queue, item, patience)
        if not isinstance(item, _Block) or self._queue.qsize() > BATCH:
            self._wanted.set()
        return queued

    def _stop_recording(self, how: str) -> None:
        """Note that the disk is too slow: pending data are still written if it recovers, new data are ignored."""
        why = f"recording to {self.path} has stopped because its disk {how}: earlier data are readable; check the disk"
        self._behind = self._behind or DataFileError(why)

    def _checked(self, event: Acquired) -> _Block:
        """Copy of the block, because a driver may reuse its buffer, with counts of shape (n_channels, n). Raises
        DataFileError for arrays of other shapes.
        """
        counts, n = event.block.counts, len(event.block)
        if counts.shape != (n, self._n_channels) or event.drive.shape != (n,):
            raise DataFileError(
                f"block at sample {event.block.first} has inputs of shape {counts.shape} and a drive of shape "
                f"{event.drive.shape}; expected ({n}, {self._n_channels}) and ({n},)"
            )
        copy = np.array(counts.T, order="C")
        return _Block(event.time, event.run, event.block.first, copy, event.drive.astype(np.float32))

    def _raise_failure(self) -> None:
        """Raise the failure, if any, only once: later events, while the bench is brought to rest, must not raise it
        again.
        """
        failure = self._failure or self._behind
        if failure is not None and not self._failure_reported:
            self._failure_reported = True
            raise failure

    def _work(self) -> None:
        """Thread function: record until the end; after a failure, only drain the queue."""
        while self._end is None or not self._queue.empty():
            item = self._next()
            self._attempt(partial(self._take, item))
            if isinstance(item, _Sync):
                item.done.set()
        self._attempt(partial(self._writer.finish, self._end.status, self._end.summary))

    def _next(self) -> _Block | Event | _Sync | None:
        """The next item of the queue; None if none arrives within `PERIOD`, or within `PAUSE` while events must be
        written.

        Blocks are collected for a moment before they are taken, since waking this thread for each of them would delay
        the loop, which in virtual time can be a hundred times faster than real time.
        """
        with suppress(queue.Empty):
            return self._queue.get_nowait()
        if not self._pressing:
            self._wanted.wait(COLLECT)
            self._wanted.clear()
        with suppress(queue.Empty):
            return self._queue.get(timeout=PAUSE if self._pressing else PERIOD)
        return None

    def _attempt(self, work: Callable[[], None]) -> None:
        if self._failure is not None:
            return
        try:
            work()
        except Exception as error:
            # any failure must end the run, because an unrecorded campaign is worthless
            message = in_use(error) if is_held(error) else reason(error)
            failure = DataFileError(
                f"{self.path} cannot be written any further ({message}): check the disk, then start a new run"
            )
            failure.__cause__ = error
            self._failure = failure
            # releasing the file may fail for the same reason
            with suppress(Exception):
                self._writer.abandon()

    def _take(self, item: _Block | Event | _Sync | None) -> None:
        match item:
            case _Block():
                self._writer.add_block(item.time, item.run, item.first, item.counts, item.drive)
            case ValuesReceived():
                for raw in item.raw:
                    self._writer.add_raw(item.run, self._numbers[raw.sensor], raw)
            case Event():
                self._writer.add_event(item)
                self._pressing |= item.journalled
                self._partial |= isinstance(item, StateChanged)
            case _Sync():
                self._commit(partial=True)
            case None:
                # no events for a while: write the rows of the incomplete chunk too
                self._commit(partial=self._partial or not self._pressing)
        waited, chunks = time.monotonic() - self._committed, self._writer.full_chunks
        at_once = self._pressing and waited >= PAUSE and self._queue.empty()
        if at_once or chunks >= BATCH or (chunks and waited >= 0.75 * PERIOD) or waited >= PERIOD:
            self._commit(partial=self._partial or not (chunks or at_once))

    def _commit(self, *, partial: bool) -> None:
        self._writer.commit(partial=partial)
        self._committed, self._pressing, self._partial = time.monotonic(), False, False
