"""Output of a bench: arming, block-by-block exchange, ramp to zero, and cutting the enable line."""

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from bench.engine.drive_source import DriveSource
from bench.engine.interface import Ended, Ending, EventStream, Requests
from bench.engine.stalls import Stalls, in_words
from bench.events import Acquired, SensorsAligned, State, StateChanged, ValuesReceived, Warned
from bench.guard.guard import Exchange, Guard
from drivers.clock import now
from drivers.errors import SafetyInputOpened
from drivers.rig import Rig, RigError
from sim.errors import UNKNOWN, Cause, CauseCode, RockbenchError

TRANSITIONS: dict[State, frozenset[State]] = {
    State.IDLE: frozenset({State.ARMED, State.WAITING, State.HALTED, State.CLOSED}),
    State.WAITING: frozenset({State.IDLE, State.HALTED, State.CLOSED}),
    State.ARMED: frozenset({State.RUNNING, State.STOPPING, State.ABORTING, State.HALTED}),
    State.RUNNING: frozenset({State.STOPPING, State.ABORTING, State.HALTED}),
    State.STOPPING: frozenset({State.IDLE, State.ABORTING, State.HALTED}),
    State.ABORTING: frozenset({State.IDLE, State.HALTED}),
    State.HALTED: frozenset({State.CLOSED}),
    State.CLOSED: frozenset(),
}


class StateMachine:
    """State of the bench; calls `announce(before, after, reason, cause)` at each transition."""

    def __init__(self, announce: Callable[[State, State, str, Cause], None]) -> None:
        self._announce = announce
        self._state = State.IDLE

    @property
    def state(self) -> State:
        """State of the bench."""
        return self._state

    def go(self, after: State, reason: str, cause: Cause = UNKNOWN) -> None:
        """Change the state. Raises RuntimeError for an illegal transition, which is a programming error."""
        before = self._state
        if after not in TRANSITIONS[before]:
            raise RuntimeError(f"the bench cannot go from {before} to {after} ({reason})")
        self._state = after
        self._announce(before, after, reason, cause)


class Alignments:
    """Publication of the values of free-running sensors and, once per run, of their alignment to the sample clock."""

    def __init__(self, rig: Rig, stream: EventStream) -> None:
        self._rig, self._stream = rig, stream
        self._run: int | None = None

    def begin(self, run: int) -> None:
        """Note the number of the run that begins."""
        self._run = run

    def publish_values(self, run: int) -> None:
        """Publish the values of the sensors as received, if any."""
        if raw := self._rig.raw_values():
            self._stream.publish(ValuesReceived(run, raw))

    def publish(self) -> None:
        """Publish the alignments of the run once, if any. A failure of the rig to report them causes only a warning."""
        run, self._run = self._run, None
        if run is None:
            return
        self.publish_values(run)
        try:
            alignments = self._rig.alignments
        except RockbenchError as error:
            self._stream.publish(Warned(f"the alignment of the sensors' clocks in run {run} is unknown: {error}"))
            return
        if alignments:
            self._stream.publish(SensorsAligned(run, alignments))


RESERVE = 2**25
"""Memory reserve [bytes], released when memory runs out so that the output can still be ramped to zero."""
NO_MEMORY = "the computer has run out of memory: close other programs, then start again"

_DRIVEN = (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING)
"""States in which the rig is armed."""


class Output:
    """Output of the bench: sends the drive from `source` through the guard, `block` samples per iteration, and tracks
    the bench's state.
    """

    def __init__(self, rig: Rig, guard: Guard, stream: EventStream, requests: Requests, block: int) -> None:
        self._rig, self._guard, self._stream, self._requests = rig, guard, stream, requests
        self._alignments = Alignments(rig, stream)
        self.machine = StateMachine(self._announce)
        self.source = DriveSource(rig.sample_rate, rig.drive_range)
        self.block = block
        self.drive = np.zeros(0)
        """Drive [V] played while the last block was acquired, shape (block,)."""
        self.read = 0
        """Number of samples read since the rig was armed."""
        self._run = 0
        self.stalls: Stalls | None = None
        """Detector of stalls, periods in which the program did not run; None in virtual time."""
        self.stalled = 0.0
        """Longest time during the last exchange in which the program did not run [s]."""
        self._exchanged = now()
        # not written to: reserved addresses already count towards a memory limit, and writing 32 MB takes time
        self._reserve: NDArray[np.uint8] | None = np.empty(RESERVE, dtype=np.uint8)

    @property
    def state(self) -> State:
        """State of the bench."""
        return self.machine.state

    @property
    def driven(self) -> bool:
        """Whether the rig is armed."""
        return self.state in _DRIVEN

    @property
    def begins(self) -> int:
        """Index of the first sample that a new command affects: the first one after those queued in the rig."""
        return self.read + self._rig.lead

    def arm(self, reason: str) -> None:
        """Arm the rig with samples of 0 V queued."""
        self.source.reset()
        self.read = 0
        self._run += 1
        self._exchanged = now()
        self.machine.go(State.ARMED, reason)
        if self._requests.forbids_arming:
            # the loop cuts the enable line
            return
        self._guard.arm()
        self._alignments.begin(self._run)

    def exchange(self) -> Exchange:
        """Send and read one block; an open safety input halts the bench."""
        try:
            exchange = self._guard.exchange(self.source.next(self.block))
        except RigError as error:
            if stalled := self._stall():
                error.args = (f"{error}; before that, {in_words(stalled)}", *error.args[1:])
            raise
        self.stalled = self._stall()
        self.read = exchange.block.first + len(exchange.block)
        self.drive = exchange.drive
        self._stream.publish(
            Acquired(
                self._run,
                exchange.block,
                exchange.drive,
                exchange.signals,
                exchange.magnitudes,
                time=self._stream.now(),
            )
        )
        self._alignments.publish_values(self._run)
        if self.stalled:
            self._stream.publish(Warned(in_words(self.stalled), realtime=True))
        if exchange.opened:
            opened = ", ".join(exchange.opened)
            raise Ended(self.cut(Ending("halted", f"{opened} opened", Cause(CauseCode.SAFETY_INPUT, opened))))
        return exchange

    def _stall(self) -> float:
        """Longest time since the previous exchange in which the program did not run [s]; 0 if there was none."""
        before, self._exchanged = self._exchanged, now()
        return 0.0 if self.stalls is None else self.stalls.since(before)

    def rest(self) -> None:
        """Stop the rig, whose output is at zero."""
        self._guard.disarm()
        self.machine.go(State.IDLE, "the output is at zero")
        self._alignments.publish()

    def cut(self, ending: Ending) -> Ending:
        """Cut the enable line now. Returns the ending, with errors of the cut appended."""
        try:
            self._guard.halt()
        except RigError as error:
            ending = ending.then(Ending.failed(error))
        if self.state not in (State.HALTED, State.CLOSED):
            try:
                self.machine.go(State.HALTED, ending.reason, ending.cause)
            except RockbenchError as error:
                ending = ending.then(Ending.failed(error))
        # report the original cause, not a consequential error
        with suppress(RockbenchError):
            self._alignments.publish()
        return ending

    def ending_of(self, work: Callable[[], object]) -> Ending | None:
        """Carry out `work`. Returns the corresponding ending if it fails, else None."""
        try:
            work()
        except Ended as ended:
            return ended.ending
        except SafetyInputOpened as error:
            return self.cut(Ending("halted", str(error), error.cause))
        except RigError as error:
            if self._requests.strongest == "halt" and self.driven:
                # the requesting thread cut the enable line during the iteration
                return self.cut(Ending("halted", self._requests.reason, self._requests.cause))
            return self.cut(Ending.failed(error))
        except RockbenchError as error:
            return Ending.failed(error)
        except MemoryError:
            # free memory for the ramp
            self._reserve = None
            return Ending("failed", NO_MEMORY, Cause(CauseCode.MEMORY))
        return None

    def rescue(self, error: BaseException, lasts: Sequence[Callable[[], object]]) -> None:
        """Cut the output before `error` is raised, then call each of `lasts`. Further errors are added to `error` as
        notes.
        """
        ending = Ending("failed", f"{type(error).__name__} in the plan or a subscriber")
        for last in (lambda: self.cut(ending), *lasts):
            try:
                last()
            except Exception as another:
                error.add_note(f"then {type(another).__name__}: {another}")

    def _announce(self, before: State, after: State, reason: str, cause: Cause) -> None:
        code = "" if cause == UNKNOWN else cause.code
        self._stream.publish(StateChanged(before, after, reason, code, cause.subject))
