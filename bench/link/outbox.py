"""What waits to be sent: bounded, so that a client that does not read costs memory neither without end nor time."""

import threading
from collections import deque

from bench.events import TwinEstimate
from bench.link.messages import FromSession, Told, Traces

EVENTS, TRACES = 5000, 64
"""How many messages, and how many blocks of traces, may wait: a block is worth a tenth of a second."""


class Outbox:
    """Filled by the engine's thread without waiting, emptied by the sender's.

    Of traces and of what the twin says the oldest go first where there is no room: the present is what a person wants
    to see. Of other events the newest are left out, and counted: the file has them all.
    """

    def __init__(self, events: int = EVENTS, traces: int = TRACES) -> None:
        self._events, self._traces = deque[FromSession](), deque[Traces]()
        self._twin = deque[FromSession](maxlen=traces)
        self._most_events, self._most_traces = events, traces
        self._changed = threading.Condition()
        self.lost_events = 0
        self.lost_traces = 0

    def put(self, message: FromSession, *, always: bool = False) -> None:
        """Take a message; one that must pass `always` is taken however many wait."""
        with self._changed:
            if isinstance(message, Traces):
                self._traces.append(message)
                if len(self._traces) > self._most_traces:
                    self._traces.popleft()
                    self.lost_traces += 1
            elif isinstance(message, Told) and isinstance(message.event, TwinEstimate):
                self._twin.append(message)
            elif always or len(self._events) < self._most_events:
                self._events.append(message)
            else:
                self.lost_events += 1
            self._changed.notify()

    def take(self, timeout: float) -> list[FromSession]:
        """All that waits, events first; empty when nothing has come within `timeout` seconds."""
        with self._changed:
            if not (self._events or self._twin or self._traces):
                self._changed.wait(timeout)
            taken = [*self._events, *self._twin, *self._traces]
            self._events.clear()
            self._twin.clear()
            self._traces.clear()
        return taken
