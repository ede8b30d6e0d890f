"""The session's side of the connection: sends events and traces, handles the client's requests, detects its loss."""

import signal
import threading
from _thread import interrupt_main
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue

from bench.analysis.signals import further_of
from bench.app.ipc.messages import (
    BEAT,
    PATIENCE,
    Answer,
    Ask,
    Beat,
    Ended,
    FromSession,
    Leave,
    Opened,
    PlanChecked,
    Preparing,
    Published,
    Question,
    Reduction,
    Refused,
    SafetyInputs,
    Traces,
)
from bench.engine.interface import Requests
from bench.events import Acquired, Event, State, StateChanged, TwinEstimate, Warned
from drivers.clock import now
from drivers.rig import Rig, RigError

EVENTS, TRACES = 5000, 64
"""Capacity for messages and for blocks of traces of 0.1 s each."""


class SendQueue:
    """Queue between the engine's thread, which never waits, and the sender's. When full, it discards the oldest traces
    and twin estimates, and the newest of other events, and counts the losses. The data file is complete nevertheless.
    """

    def __init__(self, events: int = EVENTS, traces: int = TRACES) -> None:
        self._events, self._traces = deque[FromSession](), deque[Traces]()
        self._twin = deque[FromSession](maxlen=traces)
        self._most_events, self._most_traces = events, traces
        self._changed = threading.Condition()
        self.lost_events = 0
        self.lost_traces = 0

    def put(self, message: FromSession, *, always: bool = False) -> None:
        """Append a message; with `always` even if the queue is full."""
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
        """All messages, events first; empty if none arrives within `timeout` seconds."""
        with self._changed:
            if not (self._events or self._twin or self._traces):
                self._changed.wait(timeout)
            taken = [*self._events, *self._twin, *self._traces]
            self._events.clear()
            self._twin.clear()
            self._traces.clear()
        return taken


PERIOD = 0.5
"""Shortest interval between readings [s]; the guard reads the inputs in every block independently."""


class SafetyWatch:
    """Reads the rig's safety inputs for the display; to be called in the engine's thread only."""

    def __init__(self, outbox: SendQueue) -> None:
        self._outbox = outbox
        self._rig: Rig | None = None
        self._looked = -PERIOD
        self._time = 0.0

    def watch(self, rig: Rig) -> None:
        """Read the inputs of this rig."""
        self._rig = rig
        self.look(0.0, at_once=True)

    def look(self, time: float | None = None, *, at_once: bool = False) -> None:
        """Send the inputs at bench time `time` [s], at most once per `PERIOD`. Errors of the rig are ignored, since
        they are reported elsewhere.
        """
        with suppress(RigError):
            self.look_driven(time, at_once=at_once)

    def look_driven(self, time: float | None = None, *, at_once: bool = False) -> None:
        """Like `look`, while the rig is armed: raises RigError when the inputs cannot be read. The rig has then cut its
        output, and only this error states the reason.
        """
        self._time = self._time if time is None else time
        if self._rig is None or (now() - self._looked < PERIOD and not at_once):
            return
        self._looked = now()
        self._outbox.put(SafetyInputs(self._time, dict(self._rig.interlocks())))


_LOOK = 0.1
"""Polling interval for other reasons to end while waiting for the operator's answer [s]."""


class SessionServer:
    """Serves the client by a sending and a receiving thread; the engine waits for neither. `lost(why)` is called in the
    receiving thread when the client has disconnected or is silent, and again after each reconnection.
    """

    def __init__(self, connection: Connection, requests: Requests, lost: Callable[[str], None]) -> None:
        self._connection, self._requests, self._lost = connection, requests, lost
        self.outbox = SendQueue()
        self.inputs = SafetyWatch(self.outbox)
        self.answers = SimpleQueue[Answer]()
        self.connected = True
        self._sent = threading.Event()
        self._state, self._reason, self._time = State.IDLE, "", 0.0
        self._noted = now()
        for work in (self._send, self._hear):
            threading.Thread(target=work, name=work.__name__.strip("_"), daemon=True).start()

    def note(self, event: Event) -> None:
        """Store the state for the next beat, which reports it even if events are lost."""
        self._noted = now()
        self._time = max(self._time, event.time)
        if isinstance(event, StateChanged):
            self._state, self._reason = event.after, event.reason

    def close(self, last: FromSession, timeout: float) -> None:
        """Send the queue and then `last`; gives up after `timeout` seconds."""
        self.outbox.put(last, always=True)
        self._sent.wait(timeout)

    def _send(self) -> None:
        over, beaten = False, 0.0
        # the receiving thread detects a lost client too, and reports it
        with suppress(OSError):
            while not over:
                for message in self.outbox.take(BEAT / 2):
                    self._connection.send(message)
                    over = over or isinstance(message, PlanChecked | Ended | Refused)
                if now() - beaten >= BEAT and not over:
                    beaten = now()
                    self._connection.send(self._beat())
        self._sent.set()

    def _beat(self) -> FromSession:
        outbox = self.outbox
        quiet = now() - self._noted
        return Beat(self._state, self._reason, self._time, outbox.lost_events, outbox.lost_traces, quiet)

    def _hear(self) -> None:
        try:
            while True:
                if self._connection.poll(PATIENCE):
                    self.connected = True
                    self._heed(self._connection.recv())
                else:
                    self._lose(f"the client has been silent for {PATIENCE:g} s")
        except (EOFError, OSError):
            self._lose("the client has disconnected")

    def _lose(self, why: str) -> None:
        self.connected = False
        self._lost(why)

    def _heed(self, message: object) -> None:
        match message:
            case Ask("halt" | "abort" | "stop" as end):
                {"halt": self._requests.halt, "abort": self._requests.abort, "stop": self._requests.stop}[end]()
                if self._requests.rig_closed:
                    # planning does not poll requests: the handler of this signal interrupts it
                    interrupt_main(signal.SIGTERM)
            case Answer():
                self.answers.put(message)
            case Leave():
                self._lose("the client was closed")
            case _:
                pass


class RemoteOperator:
    """The operator at the client, who answers the questions."""

    name = "operator at the window"

    def __init__(self, host: SessionServer, requests: Requests) -> None:
        self._host, self._requests = host, requests
        self._number = 0

    def confirm(self, request: str) -> bool:
        """Wait for the answer to a question; a request to end or a lost client counts as no."""
        self._number += 1
        self._host.outbox.put(Question(self._number, request), always=True)
        while self._requests.strongest is None and self._host.connected:
            with suppress(Empty):
                answer = self._host.answers.get(timeout=_LOOK)
                if answer.number == self._number:
                    return answer.agreed
            # the engine's thread waits while a person works at the bench
            self._host.inputs.look()
        return False


class Publisher:
    """The subscriber that puts the engine's events into the send queue."""

    def __init__(self, host: SessionServer) -> None:
        self._host = host
        self._reduction: Reduction | None = None
        self._phase, self._prepared = "", 0.0

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """A `bench.progress.Progress`: sends a new phase at once, its parts at most once per `PERIOD`."""
        if phase != self._phase or now() - self._prepared >= PERIOD:
            self._phase, self._prepared = phase, now()
            self._host.outbox.put(Preparing(phase, done, total))

    def opened(self, rig: Rig, duration: float | None) -> None:
        """Start to send traces; the plan expects the run to take `duration` [s]."""
        self._reduction = Reduction(rig.sample_rate)
        names = tuple(channel.name for channel in rig.channels)
        opened = Opened(names, rig.sample_rate, rig.description, further_of(rig.channels), duration)
        self._host.outbox.put(opened, always=True)
        self._host.inputs.watch(rig)

    def __call__(self, event: Event) -> None:
        self._host.note(event)
        if isinstance(event, Acquired):
            if self._reduction is not None:
                self._trace(self._reduction, event)
            self._host.inputs.look_driven(event.time)
        else:
            self._host.outbox.put(Published(event))
            if isinstance(event, StateChanged):
                self._host.inputs.look(event.time, at_once=True)

    def _trace(self, reduction: Reduction, event: Acquired) -> None:
        try:
            self._host.outbox.put(reduction(event))
        except Exception as error:
            # an error of the display must not end a measurement
            self._reduction = None
            self._host.outbox.put(Published(Warned(f"traces are no longer shown: {error}", time=event.time)))
