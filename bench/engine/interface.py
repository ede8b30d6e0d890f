"""Interface between engine and session: operator and requests as inputs, events and an ending as outputs."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from math import isnan
from types import FrameType
from typing import Protocol

from bench.events import Event, PointFinished, Subscriber, Warned
from bench.unfinished import break_off
from drivers.clock import Clock
from drivers.errors import RigError
from sim.errors import UNKNOWN, Cause, CauseCode, Interruption, RockbenchError
from sim.parameters import Parameters

SEVERITY = ("completed", "stopped", "aborted", "halted", "failed")
"""All statuses, in ascending order of severity."""


@dataclass(frozen=True)
class Ending:
    """Ending of a session: `status` (completed, stopped, aborted, halted or failed), reason and cause."""

    status: str
    reason: str
    cause: Cause = field(default=UNKNOWN, compare=False)

    @classmethod
    def failed(cls, error: RockbenchError) -> "Ending":
        """Ending with status "failed", caused by an error."""
        return cls("failed", str(error), error.cause)

    def then(self, later: "Ending | None") -> "Ending":
        """Combine this ending with a `later` one: the worse of the two statuses, both reasons, and this ending's
        cause.
        """
        if later is None:
            return self
        status = max(self.status, later.status, key=SEVERITY.index)
        return Ending(status, f"{self.reason}; then {later.reason}", self.cause)


class Ended(Interruption):
    """Exception that ends the plan early, with the ending of the run."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending.reason)
        self.ending = ending


class Operator(Protocol):
    """Carries out the operator actions between tests."""

    @property
    def name(self) -> str:
        """Name recorded in the data file."""
        ...

    def confirm(self, request: str) -> bool:
        """Return True once `request` has been carried out, or False if it is declined, which ends the run.

        May block for a long time.
        """
        ...


@dataclass(frozen=True)
class Unattended:
    """Operator that confirms every request at once, for tests and for a simulated bench, which carries out the actions
    itself.
    """

    name: str = "unattended run"

    def confirm(self, request: str) -> bool:  # noqa: ARG002 - every request has the same answer
        return True


_Made = tuple[str, Cause]


class Requests:
    """Requests to end a run, from any thread or signal handler: stop, abort and halt, in order of severity.

    A request is never withdrawn. Plain flags are used because they need no lock, which could deadlock in a signal
    handler.
    """

    def __init__(self) -> None:
        self._stop: _Made | None = None
        self._abort: _Made | None = None
        self._halt: _Made | None = None
        self._cut: Callable[[], None] | None = None
        self._arming = False
        self.cuts_while_arming = True
        """Whether a stop or an abort during the arming cuts the enable line; False in replays of older files, where
        they began a ramp after the arming.
        """
        self.interrupted = False
        """Whether an operating-system signal caused the request: the session then exits as soon as the rig is at rest.
        """
        self.breaking: Callable[[], BaseException] | None = None
        """Constructor of the exception that a signal handler raises in the main thread after making its request; None
        while the loop polls for requests.
        """
        self.rig_closed = False
        """Whether no rig is open, so that the process may exit at once."""

    @contextmanager
    def breakable(self, error: Callable[[], BaseException]) -> Generator[None]:
        """Context manager in which signal handlers raise `error()`, for long computations that do not poll for
        requests.
        """
        before, self.breaking = self.breaking, error
        try:
            yield
        finally:
            self.breaking = before

    def break_off(self, frame: FrameType | None) -> None:
        """For a signal handler called in `frame`: raise the exception of `breakable`, where that is safe, and keep the
        objects of the computation (`bench.unfinished.break_off`); outside `breakable`, return.
        """
        if self.breaking is not None:
            break_off(frame, self.breaking)

    @contextmanager
    def without_rig(self) -> Generator[None]:
        """Context manager for code without an open rig: a signal raises KeyboardInterrupt."""
        self.rig_closed = True
        with self.breakable(KeyboardInterrupt):
            yield
        # not reset after an error, because the session then ends without opening a rig
        self.rig_closed = False

    def cut_by(self, cut: Callable[[], None]) -> None:
        """Register `cut`, which `halt` calls in the requesting thread."""
        self._cut = cut

    @contextmanager
    def arming(self) -> Generator[None]:
        """Context manager for the arming of the rig, which may take many seconds: every request cuts the enable line at
        once, so that the amplifier is not enabled after it. The drive is zero.
        """
        self._arming = True
        try:
            yield
        finally:
            self._arming = False

    def stop(self, why: str = "stop requested", code: CauseCode = CauseCode.REQUEST) -> None:
        """Request a smooth ramp to zero; the measurement remains valid. The first `why` is recorded as the reason."""
        self._stop = self._stop or (why, Cause(code, "stop"))
        if self._arming and self.cuts_while_arming:
            self._cut_now()

    def abort(self, why: str = "abort requested", code: CauseCode = CauseCode.REQUEST) -> None:
        """Request a fast ramp to zero; the run becomes invalid."""
        self._abort = self._abort or (why, Cause(code, "abort"))
        if self._arming and self.cuts_while_arming:
            self._cut_now()

    def halt(self, why: str = "halt requested", code: CauseCode = CauseCode.REQUEST) -> None:
        """Cut the enable line now, in this thread; the loop then finds the rig halted and ends."""
        self._halt = self._halt or (why, Cause(code, "halt"))
        self._cut_now()

    @property
    def forbids_arming(self) -> bool:
        """Whether a request has been made that ends the arming of the rig."""
        return self._halt is not None or (self.cuts_while_arming and self.strongest is not None)

    def _cut_now(self) -> None:
        if self._cut is not None:
            # the loop cuts the line again and reports a failure
            with suppress(RigError):
                self._cut()

    @property
    def strongest(self) -> str | None:
        """Strongest request so far: "halt", "abort", "stop" or None."""
        if self._halt:
            return "halt"
        if self._abort:
            return "abort"
        return "stop" if self._stop else None

    @property
    def reason(self) -> str:
        """Reason for the strongest request; empty if there is none."""
        made = self._halt or self._abort or self._stop
        return made[0] if made else ""

    @property
    def cause(self) -> Cause:
        """Cause of the strongest request, as a code."""
        made = self._halt or self._abort or self._stop
        return made[1] if made else UNKNOWN


class EventStream:
    """Stream that stamps events with the bench time since the start of the session [s] and passes them to the
    subscribers in order.

    `stores` returns whether the data file stores the columns of a type of event; the first event of a type that it does
    not store causes a warning.
    """

    def __init__(
        self,
        clock: Clock,
        subscribers: Sequence[Subscriber],
        stores: Callable[[type[Event]], bool] = lambda _: True,
    ) -> None:
        self._clock = clock
        self._origin = clock.now()
        self._subscribers = tuple(subscribers)
        self._stores, self._published = stores, set[type[Event]]()
        self.points: list[Parameters] = []
        """Results of the finished points, in order."""

    def join(self, subscriber: Subscriber) -> None:
        """Add a subscriber; subscribers are called in the order in which they were added."""
        self._subscribers += (subscriber,)

    def now(self) -> float:
        """Bench time since the session began [s]."""
        return self._clock.now() - self._origin

    def publish(self, event: Event) -> None:
        """Pass `event` to every subscriber; stamp it first if it has no time."""
        if isnan(event.time):
            event = replace(event, time=self.now())
        if (kind := type(event)) not in self._published:
            self._published.add(kind)
            if not self._stores(kind):
                remedy = f"list it in `events` of its protocol, as '{kind.__module__}:{kind.__qualname__}'"
                self.publish(Warned(f"{kind.__name__} is recorded in the journal only, without its table: {remedy}"))
        for subscriber in self._subscribers:
            subscriber(event)
        if isinstance(event, PointFinished):
            self.points.append(event.point)
