"""The session's side of the connection: sends events and traces, handles requests and detects a lost client."""

import signal
import threading
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from queue import Empty, SimpleQueue
from time import sleep
from typing import Any

from bench.analysis.signals import further_of
from bench.app.ipc.broadcast import Broadcast, Reduction, SendQueue
from bench.app.ipc.messages import (
    BEAT,
    PATIENCE,
    SILENCE,
    VIRTUAL_PATIENCE,
    Answer,
    Ask,
    Attached,
    Beat,
    Control,
    Ended,
    FromSession,
    Leave,
    Note,
    Opened,
    PlanChecked,
    Preparing,
    Published,
    Question,
    ReadOnly,
    Refused,
    SafetyInputs,
    receive,
)
from bench.app.session import SessionResult
from bench.engine.interface import Requests
from bench.events import Acquired, Event, OperatorNote, State, StateChanged, ValuesReceived, Warned
from bench.preflight.margins import bounds, margins
from bench.protocol import Prepared
from drivers.clock import now
from drivers.rig import Rig, RigError
from sim import waiting

FAREWELL = 2.0
"""Longest wait at the end of the session for a client that does not read its messages [s]."""

PERIOD = 0.5
"""Shortest interval [s] between readings of the safety inputs for the display, and between progress reports of a phase.
The guard reads the inputs in every block.
"""


class SafetyWatch:
    """Reads the rig's safety inputs for the display; to be called in the engine's thread only."""

    def __init__(self, broadcast: Broadcast) -> None:
        self._broadcast = broadcast
        self._rig: Rig | None = None
        self._looked = -PERIOD
        self._time = 0.0

    def watch(self, rig: Rig) -> None:
        """Set the rig whose inputs are read."""
        self._rig = rig
        self.look(0.0, at_once=True)

    def look(self, time: float | None = None, *, at_once: bool = False) -> None:
        """Send the inputs at bench time `time` [s], at most once per `PERIOD` unless `at_once`. Errors of the rig are
        ignored, since they are reported elsewhere.
        """
        with suppress(RigError):
            self.update_driven(time, at_once=at_once)

    def update_driven(self, time: float | None = None, *, at_once: bool = False) -> None:
        """Send the inputs of an armed rig as `look` does, but raise RigError if they cannot be read: the rig has then
        cut its output, and only this error states the reason.
        """
        self._time = self._time if time is None else time
        if self._rig is None or (now() - self._looked < PERIOD and not at_once):
            return
        self._looked = now()
        self._broadcast.put(SafetyInputs(self._time, dict(self._rig.interlocks())))


_LOOK = 0.1
"""Interval [s] at which requests to end and the loss of the client are checked while waiting for the operator's
answer or for a silent client.
"""


class SessionServer:
    """Serves the clients of a session, each with a sending and a receiving thread. The engine waits for none of them,
    except for the owner in a `virtual` run.

    owner : connection to the client that started the session; None for a session that a terminal started.
    lost : called with the reason, in a receiving thread, when the owner has disconnected or is silent; may be called
        repeatedly.
    pending : called in a receiving thread; returns whether the main thread is not polling for requests at present and
        must therefore be interrupted.
    virtual : whether the run is in virtual time, which may stand still.

    Clients that `attach` may abort or halt the run and, while the owner is lost, stop it and answer questions.
    """

    def __init__(
        self,
        owner: Connection | None,
        requests: Requests,
        lost: Callable[[str], None],
        pending: Callable[[], bool] = lambda: False,
        *,
        virtual: bool = False,
    ) -> None:
        self._requests, self._lost, self._pending = requests, lost, pending
        self._virtual, self._patience = virtual, VIRTUAL_PATIENCE if virtual else PATIENCE
        self.broadcast = Broadcast()
        self.inputs = SafetyWatch(self.broadcast)
        self.answers = SimpleQueue[Answer]()
        self._notes = SimpleQueue[Note]()
        self.publish: Callable[[Event], None] | None = None
        """Publishes an event of the run, in the engine's thread; None before the data file exists."""
        self.connected = True
        """Whether the owner is present."""
        self._attached: list[SendQueue] = []
        self._attending: set[SendQueue] = set()
        self._sending: list[threading.Event] = []
        self._state, self._reason, self._time = State.IDLE, "", 0.0
        self._noted = self._heard = now()
        if owner is not None:
            self._serve(owner, self.broadcast.join(), lambda: self._receive(owner))

    @property
    def attended(self) -> bool:
        """Whether a client may answer questions."""
        return self.connected or bool(self._attending)

    def attach(self, connection: Connection, introduction: Attached) -> None:
        """Serve another client."""
        queue = self.broadcast.join(introduction, Control(not self.connected))
        self._attached.append(queue)
        self._attending.add(queue)
        self._serve(connection, queue, lambda: self._receive_attached(connection, queue))

    def note(self, event: Event) -> None:
        """Store the state for the next heartbeat, which reports it even if the event is lost."""
        self._noted = now()
        self._time = max(self._time, event.time)
        if isinstance(event, StateChanged):
            self._state, self._reason = event.after, event.reason

    def wait_for_owner(self) -> None:
        """In virtual time, wait while the owner is silent but not lost; to be called in the engine's thread."""
        while self._virtual and self.connected and self._requests.strongest is None and now() - self._heard > SILENCE:
            sleep(_LOOK)

    def publish_notes(self) -> None:
        """Publish the notes of the operator; to be called in the engine's thread."""
        while self.publish is not None and not self._notes.empty():
            note = self._notes.get()
            self.publish(OperatorNote(note.text, note.by))

    def close(self, last: FromSession, timeout: float) -> None:
        """Send the queued messages and then `last`; gives up after `timeout` seconds."""
        self.broadcast.put(last, always=True)
        end = now() + timeout
        for sent in tuple(self._sending):
            waiting.wait(sent, max(end - now(), 0.0))

    def _serve(self, connection: Connection, queue: SendQueue, receive: Callable[[], None]) -> None:
        sent = threading.Event()
        self._sending.append(sent)
        for name, work in (("send", lambda: self._send(connection, queue, sent)), ("receive", receive)):
            threading.Thread(target=work, name=name, daemon=True).start()

    def _send(self, connection: Connection, queue: SendQueue, sent: threading.Event) -> None:
        over, beaten = False, 0.0
        # the receiving thread also detects a lost client, and reports it
        with suppress(OSError):
            while not over:
                for message in queue.take(BEAT / 2):
                    connection.send(message)
                    over = over or isinstance(message, PlanChecked | Ended | Refused)
                if now() - beaten >= BEAT and not over:
                    beaten = now()
                    connection.send(self._beat(queue))
        self.broadcast.leave(queue)
        sent.set()

    def _beat(self, queue: SendQueue) -> FromSession:
        quiet = now() - self._noted
        return Beat(self._state, self._reason, self._time, queue.lost_events, queue.lost_traces, quiet)

    def _receive(self, owner: Connection) -> None:
        try:
            while True:
                if owner.poll(self._patience):
                    message = receive(owner)
                    self._heard = now()
                    self._find(present=True)
                    self._handle(message)
                else:
                    self._lose_client(f"the client has been silent for {self._patience:g} s")
        except (EOFError, OSError):
            self._lose_client("the client has disconnected")

    def _receive_attached(self, connection: Connection, queue: SendQueue) -> None:
        read_only = False
        try:
            with suppress(EOFError, OSError):
                while True:
                    if not connection.poll(PATIENCE):
                        # a silent client may be a frozen window, which answers no question
                        self._attending.discard(queue)
                        continue
                    message = receive(connection)
                    if isinstance(message, Leave):
                        break
                    read_only = read_only or isinstance(message, ReadOnly)
                    if read_only:
                        self._attending.discard(queue)
                        continue
                    self._attending.add(queue)
                    # while the owner is present, no other client controls the run, but every one may abort or halt it
                    stops = isinstance(message, Ask) and message.end in ("abort", "halt")
                    if not self.connected or isinstance(message, Note) or stops:
                        self._handle(message)
        finally:
            self._attached.remove(queue)
            self._attending.discard(queue)
            self.broadcast.leave(queue)
            with suppress(OSError):
                connection.close()

    def _lose_client(self, why: str) -> None:
        self._find(present=False)
        self._lost(why)

    def _find(self, *, present: bool) -> None:
        """Transfer the control of the run to the attached clients, or back to the owner."""
        if present != self.connected:
            self.connected = present
            for queue in tuple(self._attached):
                queue.put(Control(not present), always=True)

    def _handle(self, message: object) -> None:
        match message:
            case Ask("halt" | "abort" | "stop" as end):
                {"halt": self._requests.halt, "abort": self._requests.abort, "stop": self._requests.stop}[end]()
                if self._requests.rig_closed or self._pending():
                    # planning does not poll for requests: the handler of this signal interrupts it
                    interrupt_main(signal.SIGTERM)
            case Answer():
                self.answers.put(message)
            case Note():
                self._notes.put(message)
            case Leave():
                self._lose_client("the client was closed")
            case _:
                pass


class RemoteOperator:
    """The operator at the client, who answers the questions."""

    name = "operator at the window"

    def __init__(self, host: SessionServer, requests: Requests) -> None:
        self._host, self._requests = host, requests
        self._number = 0

    def confirm(self, request: str) -> bool:
        """Wait for the answer to a question; a request to end or the loss of the client counts as no."""
        self._number += 1
        self._host.broadcast.put(Question(self._number, request), always=True)
        try:
            while self._requests.strongest is None and self._host.attended:
                with suppress(Empty):
                    answer = self._host.answers.get(timeout=_LOOK)
                    if answer.number == self._number:
                        return answer.agreed
                # the engine's thread, the only one that may read the inputs, waits here while a person works at the
                # bench
                self._host.inputs.look()
                self._host.publish_notes()
            return False
        finally:
            self._host.broadcast.discard_question()


class Publisher:
    """Subscriber that sends the engine's events to the clients of the session."""

    def __init__(self, host: SessionServer) -> None:
        self._host = host
        self._reduction: Reduction | None = None
        self._phase, self._prepared = "", 0.0

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """A `bench.progress.Progress`: sends a new phase at once, and its completed parts at most once per `PERIOD`."""
        if phase != self._phase or now() - self._prepared >= PERIOD:
            self._phase, self._prepared = phase, now()
            self._host.broadcast.put(Preparing(phase, done, total))

    def opened(self, rig: Rig, publish: Callable[[Event], None], prepared: Prepared[Any] | None = None) -> None:
        """Start sending traces of the run that was `prepared` (None if its plan is not known). `publish` publishes an
        event of the run.
        """
        self._host.publish = publish
        self._reduction = Reduction(rig.sample_rate)
        names = tuple(channel.name for channel in rig.channels)
        opened = Opened(names, rig.sample_rate, rig.description, further_of(rig.channels))
        if prepared is not None:
            forecast = prepared.forecast
            found = margins(forecast.demands, bounds(prepared.configuration))
            opened = replace(opened, duration=forecast.duration, prediction=prepared.prediction, margins=found)
        self._host.broadcast.put(opened, always=True)
        self._host.inputs.watch(rig)

    def __call__(self, event: Event) -> None:
        self._host.note(event)
        self._host.publish_notes()
        if isinstance(event, Acquired):
            if self._reduction is not None and self._host.broadcast.has_clients:
                self._trace(self._reduction, event)
            self._host.inputs.update_driven(event.time)
            self._host.wait_for_owner()
        elif not isinstance(event, ValuesReceived):
            self._host.broadcast.put(Published(event))
            if isinstance(event, StateChanged):
                self._host.inputs.look(event.time, at_once=True)

    def _trace(self, reduction: Reduction, event: Acquired) -> None:
        try:
            self._host.broadcast.put(reduction(event))
        except Exception as error:
            # an error of the display must not end a measurement
            self._reduction = None
            self._host.broadcast.put(Published(Warned(f"traces are no longer shown: {error}", time=event.time)))


def ended_message(result: SessionResult, out: Path) -> Ended:
    """The last message of a run whose results are in the folder `out`."""
    return Ended(result.status, result.reason, result.summary, result.table, out, result.passed, result.cause)
