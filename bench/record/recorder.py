"""The subscriber that writes a campaign to its file, in its own thread so that a slow disk never delays the drive."""

import queue
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.events import Acquired, Event, PointFinished, Progress, StateChanged
from bench.record.errors import RecordError, reason
from bench.record.layout import Skeleton, Status
from bench.record.tables import Table
from bench.record.writer import RecordWriter
from drivers.rig import Channel, Counts
from sim.errors import InvalidInput
from sim.parameters import Parameters

PERIOD = 0.5
"""Longest time between two writes while anything waits [s]; a chunk of samples lasts as long at real time."""

PAUSE = 0.05
"""Shortest time between two writes of events, so that a slow disk takes many at once [s]."""

BATCH = 100
"""Chunks that are written at once when samples come faster than real time."""

BACKLOG = 4096
"""Events that may wait for the disk: minutes at real time. A disk that is farther behind ends the run."""

PATIENCE = 60.0
"""Longest wait for the disk when nothing moves [s]: at the end, and in `sync`."""


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
    """Writes one new HDF5 file; call it with each event of the engine, and `close` it at the end.

    Samples are on the disk within a second, journalled events almost at once. An error of the disk is raised as
    RecordError by the next call, once; what comes after it is not recorded, and what was written before stays
    readable. So is a disk that does not keep up: no call waits for it, but for `hold_up` seconds, which only a run in
    virtual time has.

    `metadata` is stored as texts under /entry/metadata, `tables` (such as {"prediction": ...}) under /entry.
    Raises InvalidInput, and creates nothing, when `path` exists or cannot be created, or a name or table is unfit.
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
        title: str = "rocking-bench campaign",
        hold_up: float = 0.0,
    ) -> None:
        self.path = path
        self._point_type = point_type
        self._n_channels = len(channels)
        self._writer = RecordWriter(
            path, Skeleton(title, tuple(channels), sample_rate, point_type, metadata, tables or {})
        )
        self._queue: queue.Queue[_Block | Event | _Sync] = queue.Queue(BACKLOG)
        self._end: _End | None = None
        self._hold_up = hold_up
        self._failure: RecordError | None = None
        self._behind: RecordError | None = None
        self._told = False
        self._closed = False
        self._committed, self._pressing, self._partial = time.monotonic(), False, False
        # a daemon: a program that dies of an error does not wait for its recorder, and the file is readable anyway
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def __call__(self, event: Event) -> None:
        """Take an event. Raises RecordError when it cannot be recorded or an earlier one could not be written."""
        if self._closed:
            raise RecordError(f"{self.path} is closed: {type(event).__name__} at {event.time:.3f} s was not recorded")
        self._raise_failure()
        if self._failure is not None or self._behind is not None:
            return
        if isinstance(event, Acquired):
            self._offer(self._checked(event))
        elif isinstance(event, PointFinished) and not isinstance(event.point, self._point_type):
            raise RecordError(
                f"point of type {type(event.point).__name__} was not recorded: {self.path} is for"
                f" {self._point_type.__name__}"
            )
        elif not isinstance(event, Progress):
            self._offer(event)

    def sync(self) -> None:
        """Return when everything so far is in the file. Raises RecordError, once, when it could not be written."""
        if not self._closed:
            marker = _Sync(threading.Event())
            if not (self._put(marker, PATIENCE) and marker.done.wait(PATIENCE)):
                self._fall_behind(f"has not answered for {PATIENCE:g} s")
        self._raise_failure()

    def close(self, status: Status | str, summary: str = "") -> None:
        """Write what waits, how it ended and when, and close the file; closing again does nothing.

        Raises InvalidInput for an unknown status, RecordError when the end of the record could not be written. A disk
        that does not answer is left to itself: the program can end.
        """
        ends = [str(end) for end in Status if end not in (Status.RUNNING, Status.INTERRUPTED)]
        if status not in ends:
            raise InvalidInput("status of the record", str(status), "one of " + ", ".join(ends))
        if self._closed:
            return
        self._closed = True
        self._end = _End(Status(status), summary)
        # wakes a thread that waits; one that has something to do looks at the end by itself
        self._put(_Sync(threading.Event()), 0.0)
        self._thread.join(PATIENCE)
        if self._thread.is_alive():
            self._fall_behind(f"has not answered for {PATIENCE:g} s")
        self._raise_failure()

    def _offer(self, item: _Block | Event) -> None:
        if not self._put(item, self._hold_up):
            self._fall_behind(f"is {BACKLOG} events behind")
            self._raise_failure()

    def _put(self, item: _Block | Event | _Sync, patience: float) -> bool:
        """Queue an item if there is room within `patience` seconds."""
        try:
            self._queue.put(item, block=patience > 0.0, timeout=patience)
        except queue.Full:
            return False
        return True

    def _fall_behind(self, how: str) -> None:
        """What waits is still written should the disk come back, but nothing more is taken."""
        told = f"{self.path} is not recorded further, its disk {how}: what was written before is readable; see to it"
        self._behind = self._behind or RecordError(told)

    def _checked(self, event: Acquired) -> _Block:
        """The block's own copy of the arrays, transposed: a driver may use its buffer again."""
        counts, n = event.block.counts, len(event.block)
        if counts.shape != (n, self._n_channels) or event.drive.shape != (n,):
            raise RecordError(
                f"block at sample {event.block.first} has inputs {counts.shape} and drive {event.drive.shape};"
                f" expected ({n}, {self._n_channels}) and ({n},)"
            )
        copy = np.array(counts.T, order="C")
        return _Block(event.time, event.run, event.block.first, copy, event.drive.astype(np.float32))

    def _raise_failure(self) -> None:
        """Tell of a failure once: the steps that bring the bench down are events too, and must not be stopped by it."""
        failure = self._failure or self._behind
        if failure is not None and not self._told:
            self._told = True
            raise failure

    def _work(self) -> None:
        """The thread: take what comes until the end; after a failure, only drain."""
        while self._end is None or not self._queue.empty():
            try:
                item = self._queue.get(timeout=PAUSE if self._pressing else PERIOD)
            except queue.Empty:
                item = None
            self._attempt(partial(self._take, item))
            if isinstance(item, _Sync):
                item.done.set()
        self._attempt(partial(self._writer.finish, self._end.status, self._end.summary))

    def _attempt(self, work: Callable[[], None]) -> None:
        if self._failure is not None:
            return
        try:
            work()
        except Exception as error:
            # whatever it was, the run must hear of it: an unrecorded campaign is worth nothing
            self._writer.abandon()
            failure = RecordError(
                f"{self.path} cannot be written further ({reason(error)}): see to the disk, start a new record"
            )
            failure.__cause__ = error
            self._failure = failure

    def _take(self, item: _Block | Event | _Sync | None) -> None:
        match item:
            case _Block():
                self._writer.add_block(item.time, item.run, item.first, item.counts, item.drive)
            case Event():
                self._writer.add_event(item)
                self._pressing |= item.journalled
                self._partial |= isinstance(item, StateChanged)
            case _Sync():
                self._commit(partial=True)
            case None:
                # nothing has come for a while: what waits for its chunk to fill may wait for long
                self._commit(partial=self._partial or not self._pressing)
        waited, chunks = time.monotonic() - self._committed, self._writer.full_chunks
        at_once = self._pressing and waited >= PAUSE and self._queue.empty()
        if at_once or chunks >= BATCH or (chunks and waited >= 0.75 * PERIOD) or waited >= PERIOD:
            self._commit(partial=self._partial or not (chunks or at_once))

    def _commit(self, *, partial: bool) -> None:
        self._writer.commit(partial=partial)
        self._committed, self._pressing, self._partial = time.monotonic(), False, False
