"""The session's side of the link: sends what the engine says, hears the client, and notices when it is gone."""

import signal
import threading
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue

from bench.analysis.signals import further_of
from bench.engine.requests import Requests
from bench.events import Acquired, Event, State, StateChanged, Warned
from bench.link.inputs import SafetyWatch
from bench.link.messages import (
    BEAT,
    PATIENCE,
    Answer,
    Ask,
    Beat,
    Ended,
    FromSession,
    Leave,
    Opened,
    Question,
    Refused,
    Surveyed,
    Told,
)
from bench.link.outbox import Outbox
from bench.link.reduction import Reduction
from drivers.clock import now
from drivers.rig import Rig

_LOOK = 0.1
"""How often a wait for the operator's answer looks for another reason to end [s]."""


class Host:
    """Two threads beside the engine's: one sends, one hears. Neither is ever waited for by the engine.

    `lost(why)` is called in the hearing thread when the client has gone or is silent; more than once if it comes back.
    """

    def __init__(self, connection: Connection, requests: Requests, lost: Callable[[str], None]) -> None:
        self._connection, self._requests, self._lost = connection, requests, lost
        self.outbox = Outbox()
        self.inputs = SafetyWatch(self.outbox)
        self.answers = SimpleQueue[Answer]()
        self.connected = True
        self._sent = threading.Event()
        self._state, self._reason, self._time = State.IDLE, "", 0.0
        self._noted = now()
        for work in (self._send, self._hear):
            threading.Thread(target=work, name=work.__name__.strip("_"), daemon=True).start()

    def note(self, event: Event) -> None:
        """Keep what every beat tells, however much of the rest is lost on the way."""
        self._noted = now()
        self._time = max(self._time, event.time)
        if isinstance(event, StateChanged):
            self._state, self._reason = event.after, event.reason

    def close(self, last: FromSession, timeout: float) -> None:
        """Send what waits and then `last`; a client that does not read is left after `timeout` seconds."""
        self.outbox.put(last, always=True)
        self._sent.wait(timeout)

    def _send(self) -> None:
        over, beaten = False, 0.0
        # a client that is gone is found by the hearing thread too, which tells
        with suppress(OSError):
            while not over:
                for message in self.outbox.take(BEAT / 2):
                    self._connection.send(message)
                    over = over or isinstance(message, Surveyed | Ended | Refused)
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
            self._lose("the client is gone")

    def _lose(self, why: str) -> None:
        self.connected = False
        self._lost(why)

    def _heed(self, message: object) -> None:
        match message:
            case Ask("halt" | "abort" | "stop" as end):
                {"halt": self._requests.halt, "abort": self._requests.abort, "stop": self._requests.stop}[end]()
                if self._requests.rig_closed:
                    # the planning of a run looks at no request: the handler of this signal breaks it off
                    interrupt_main(signal.SIGTERM)
            case Answer():
                self.answers.put(message)
            case Leave():
                self._lose("the client was closed")
            case _:
                pass


class AtTheClient:
    """The person at the client answers the questions."""

    name = "operator at the window"

    def __init__(self, host: Host, requests: Requests) -> None:
        self._host, self._requests = host, requests
        self._number = 0

    def confirm(self, request: str) -> bool:
        """Wait for the answer to this question; any request to end and a client that is gone are a no."""
        self._number += 1
        self._host.outbox.put(Question(self._number, request), always=True)
        while self._requests.strongest is None and self._host.connected:
            with suppress(Empty):
                answer = self._host.answers.get(timeout=_LOOK)
                if answer.number == self._number:
                    return answer.agreed
            # the engine's thread waits here, and somebody has their hands on the bench
            self._host.inputs.look()
        return False


class Teller:
    """The subscriber that puts the engine's events into the outbox."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._reduction: Reduction | None = None

    def opened(self, rig: Rig) -> None:
        """Traces are made from now on."""
        self._reduction = Reduction(rig.sample_rate)
        names = tuple(channel.name for channel in rig.channels)
        self._host.outbox.put(Opened(names, rig.sample_rate, rig.description, further_of(rig.channels)), always=True)
        self._host.inputs.watch(rig)

    def __call__(self, event: Event) -> None:
        self._host.note(event)
        if isinstance(event, Acquired):
            if self._reduction is not None:
                self._trace(self._reduction, event)
            self._host.inputs.look_driven(event.time)
        else:
            self._host.outbox.put(Told(event))
            if isinstance(event, StateChanged):
                self._host.inputs.look(event.time, at_once=True)

    def _trace(self, reduction: Reduction, event: Acquired) -> None:
        try:
            self._host.outbox.put(reduction(event))
        except Exception as error:
            # what is shown never ends what is measured
            self._reduction = None
            self._host.outbox.put(Told(Warned(f"no traces are shown from here on: {error}", time=event.time)))
