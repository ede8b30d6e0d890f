"""The output of a bench: armed, given and read block by block, and brought down, in order or at once."""

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from bench.engine.ending import Ended, Ending
from bench.engine.machine import Machine
from bench.engine.placements import Placements
from bench.engine.requests import Requests
from bench.engine.source import Source
from bench.engine.stream import Stream
from bench.events import Acquired, State, StateChanged
from bench.guard.guard import Exchange, Guard
from drivers.rig import Rig, RigError
from sim.errors import Cause, CauseCode, RockbenchError

_DRIVEN = (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING)
"""States in which the rig is armed."""


class Output:
    """Holds the state of the bench, and passes the drive of its `source` through the guard, `block` samples a turn."""

    def __init__(self, rig: Rig, guard: Guard, stream: Stream, requests: Requests, block: int) -> None:
        self._rig, self._guard, self._stream, self._requests = rig, guard, stream, requests
        self._placements = Placements(rig, stream)
        self.machine = Machine(self._announce)
        self.source = Source(rig.sample_rate, rig.drive_range)
        self.block = block
        self.drive = np.zeros(0)
        """Drive [V] that was played while the last block was taken, shape (block,)."""
        self.read = 0
        """Samples read since the rig was armed."""
        self._run = 0

    @property
    def state(self) -> State:
        """What the bench is doing."""
        return self.machine.state

    @property
    def driven(self) -> bool:
        """Whether the rig is armed."""
        return self.state in _DRIVEN

    @property
    def begins(self) -> int:
        """Index of the sample at which what is asked now begins: after those that already wait in the rig."""
        return self.read + self._rig.lead

    def arm(self, reason: str) -> None:
        """Arm the rig, with silence ahead."""
        self.source.reset()
        self.read = 0
        self._run += 1
        self.machine.go(State.ARMED, reason)
        self._guard.arm()
        self._placements.begin(self._run)

    def exchange(self) -> Exchange:
        """Drive and read one block; an open safety input ends everything."""
        exchange = self._guard.exchange(self.source.next(self.block))
        self.read = exchange.block.first + len(exchange.block)
        self.drive = exchange.drive
        self._stream.publish(Acquired(self._run, exchange.block, exchange.drive, exchange.signals))
        if exchange.opened:
            opened = ", ".join(exchange.opened)
            raise Ended(self.cut(Ending("halted", f"{opened} opened", Cause(CauseCode.SAFETY_INPUT, opened))))
        return exchange

    def rest(self) -> None:
        """The output is at zero: stop the rig."""
        self._guard.disarm()
        self.machine.go(State.IDLE, "the output is at zero")
        self._placements.tell()

    def cut(self, ending: Ending) -> Ending:
        """Cut the enable line now. Returns the ending, with what went wrong while cutting."""
        try:
            self._guard.halt()
        except RigError as error:
            ending = ending.then(Ending.failed(error))
        if self.state not in (State.HALTED, State.CLOSED):
            try:
                self.machine.go(State.HALTED, ending.reason)
            except RockbenchError as error:
                ending = ending.then(Ending.failed(error))
        # report the original cause, not a follow-up error
        with suppress(RockbenchError):
            self._placements.tell()
        return ending

    def ending_of(self, work: Callable[[], object]) -> Ending | None:
        """Why `work` could not be done to its end, or None."""
        try:
            work()
        except Ended as ended:
            return ended.ending
        except RigError as error:
            if self._requests.strongest == "halt" and self.driven:
                # the rig was cut under the loop by the thread that asked
                return self.cut(Ending("halted", self._requests.reason, self._requests.cause))
            return self.cut(Ending.failed(error))
        except RockbenchError as error:
            return Ending.failed(error)
        return None

    def rescue(self, error: BaseException, lasts: Sequence[Callable[[], object]]) -> None:
        """Cut the output for an error that is about to be raised, then do `lasts`; note on it what else goes wrong."""
        ending = Ending("failed", f"{type(error).__name__} in the plan or a subscriber")
        for last in (lambda: self.cut(ending), *lasts):
            try:
                last()
            except Exception as another:
                error.add_note(f"then {type(another).__name__}: {another}")

    def _announce(self, before: State, after: State, reason: str) -> None:
        self._stream.publish(StateChanged(before, after, reason))
