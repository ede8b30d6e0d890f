"""Queues between the engine's thread and the clients of a session, one per client. Clients may join at any time."""

import threading
from collections import deque
from collections.abc import Hashable, Iterable
from itertools import chain

import numpy as np

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, SIGNALS, U1
from bench.app.ipc.messages import (
    BIN,
    FromSession,
    Opened,
    Preparing,
    Published,
    Question,
    SafetyInputs,
    Traces,
    extremes_from,
)
from bench.events import Acquired, Event, PointFinished, StepStarted
from bench.live_values import Estimate, LiveValue, RunningGain, TwinEstimate
from drivers.clock import now


class Reduction:
    """Reduces the sample blocks of a rig to traces."""

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._width = max(round(BIN * sample_rate), 1)
        self._run, self._origin = 0, 0.0

    def __call__(self, event: Acquired) -> Traces:
        """The traces of a block."""
        signals = event.signals
        if event.run != self._run:
            # samples are equally spaced, unlike the times at which blocks are read
            self._run, self._origin = event.run, event.time - (event.block.first + len(signals)) / self._rate
        chosen = np.column_stack(
            (
                event.drive,
                signals[:, [ACCELERATION, DISPLACEMENT, U1]],
                signals[:, U1] + signals[:, DRIFT],
                signals[:, DRIFT],
                signals[:, len(SIGNALS) :],
            )
        )
        # equally spaced bins that end with the block: spectra and velocities are computed from their distance
        rows = len(signals)
        bins = max(round(rows / self._width), 1)
        low, high = extremes_from(chosen, np.arange(bins) * rows // bins)
        begin = self._origin + event.block.first / self._rate
        step = rows / (bins * self._rate)
        return Traces(event.run, begin, step, low, high, now(), self._origin, event.magnitudes())


EVENTS, TRACES = 5000, 64
"""Capacity of a queue in messages, and in blocks of traces (0.1 s each by default)."""


class SendQueue:
    """Queue between the engine's thread, which never waits, and the sending thread. When full, it discards the oldest
    traces and twin estimates and the newest other events, and counts the losses of traces and other events. The data
    file is complete regardless.
    """

    def __init__(self, events: int = EVENTS, traces: int = TRACES, first: Iterable[FromSession] = ()) -> None:
        """`first` are messages other than traces and twin estimates, with which the queue begins even if full."""
        self._events, self._traces = deque[FromSession](first), deque[Traces]()
        self._twin = deque[FromSession](maxlen=traces)
        self._most_events, self._most_traces = events, traces
        self._changed = threading.Condition()
        self.lost_events = 0
        self.lost_traces = 0

    def put(self, message: FromSession, *, always: bool = False) -> None:
        """Append a message; with `always`, even if the queue is full."""
        with self._changed:
            if isinstance(message, Traces):
                self._traces.append(message)
                if len(self._traces) > self._most_traces:
                    self._traces.popleft()
                    self.lost_traces += 1
            elif isinstance(message, Published) and isinstance(message.event, TwinEstimate):
                self._twin.append(message)
            elif always or len(self._events) < self._most_events:
                self._events.append(message)
            else:
                self.lost_events += 1
            self._changed.notify()

    def take(self, timeout: float) -> list[FromSession]:
        """All queued messages, events first; empty if none arrives within `timeout` seconds."""
        with self._changed:
            if not (self._events or self._twin or self._traces):
                self._changed.wait(timeout)
            taken = [*self._events, *self._twin, *self._traces]
            self._events.clear()
            self._twin.clear()
            self._traces.clear()
        return taken


RUNNING = (Estimate, RunningGain)
"""Events about the current point or step, which are superseded when it ends."""


class Broadcast:
    """Distributes the messages of a session to all its clients. A client that joins late first receives the messages
    that describe the run so far: the rig, up to `EVENTS` journal events, and the latest of each kind of running value.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._queues: list[SendQueue] = []
        self._opened: Opened | None = None
        self._journal = deque[FromSession](maxlen=EVENTS)
        self._last: dict[Hashable, FromSession] = {}

    @property
    def has_clients(self) -> bool:
        """Whether the session has a client."""
        return bool(self._queues)

    def put(self, message: FromSession, *, always: bool = False) -> None:
        """Append a message to the queue of every client; with `always`, even to a full queue."""
        with self._lock:
            self._store(message)
            for queue in self._queues:
                queue.put(message, always=always)

    def join(self, *first: FromSession) -> SendQueue:
        """Queue of a new client, which begins with the messages `first` and those that describe the run so far."""
        with self._lock:
            opened = () if self._opened is None else (self._opened,)
            # the messages are not copied, because the engine's thread may be waiting for this lock
            queue = SendQueue(first=chain(first, opened, self._journal, self._last.values()))
            self._queues.append(queue)
        return queue

    def leave(self, queue: SendQueue) -> None:
        """Drop the queue of a client that has left."""
        with self._lock:
            self._queues = [each for each in self._queues if each is not queue]

    def discard_question(self) -> None:
        """Discard the answered question: clients that join later do not receive it."""
        with self._lock:
            self._last.pop(Question, None)

    def _store(self, message: FromSession) -> None:
        match message:
            case Opened():
                self._opened = message
                self._last.pop(Preparing, None)
            case Published(event) if type(event).journalled:
                self._journal.append(message)
                if isinstance(event, StepStarted | PointFinished):
                    for kind in RUNNING:
                        self._last.pop(kind, None)
            case Published(event) if not isinstance(event, TwinEstimate):
                self._last[_key(event)] = message
            case Preparing() | SafetyInputs() | Question():
                self._last[type(message)] = message
            case _:
                pass


def _key(event: Event) -> Hashable:
    return (LiveValue, event.label) if isinstance(event, LiveValue) else type(event)
