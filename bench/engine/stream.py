"""The only way out of the engine: events, to whoever subscribed."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan

from bench.events import Event, Subscriber
from drivers.clock import Clock


class Stream:
    """Stamps events with the bench's time since the session began and passes them to the subscribers in order."""

    def __init__(self, clock: Clock, subscribers: Sequence[Subscriber]) -> None:
        self._clock = clock
        self._origin = clock.now()
        self._subscribers = tuple(subscribers)

    def join(self, subscriber: Subscriber) -> None:
        """From now on `subscriber` hears everything too, each time after all that were there before."""
        self._subscribers += (subscriber,)

    def now(self) -> float:
        """Seconds of the bench's clock since the session began."""
        return self._clock.now() - self._origin

    def publish(self, event: Event) -> None:
        """Pass `event` to every subscriber, with the present time unless it has a time of its own."""
        if isnan(event.time):
            event = replace(event, time=self.now())
        for subscriber in self._subscribers:
            subscriber(event)
