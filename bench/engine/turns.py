"""The turns of the loop: one block out and in, and every reason to end that may come with it."""

from typing import Never

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.signals import SIGNALS
from bench.engine.ending import Ended, Ending
from bench.engine.output import Output
from bench.engine.requests import Requests
from bench.engine.stream import Stream
from bench.events import LimitExceeded, State, Warned
from bench.guard.guard import Exchange, Guard
from bench.guard.violation import Violation
from sim.errors import Cause, CauseCode


class Turns:
    """Turns the loop until somebody or something ends it; an ending raises `Ended`, the output at zero by then."""

    def __init__(self, output: Output, guard: Guard, stream: Stream, requests: Requests) -> None:
        self.output = output
        self._guard, self._stream, self._requests = guard, stream, requests
        self.fall: FallWatch | None = None
        """Watches the specimen that stands on the table, if one is known to."""
        self._over: Violation | None = None
        self._runaway: Violation | None = None

    def begin(self, reason: str) -> None:
        """Arm the rig, with silence ahead."""
        self._over = self._runaway = None
        self.heed_requests()
        self.output.arm(reason)
        # a halt that came while the rig was being armed found no enable line to cut
        self.heed_requests()

    def exchange(self) -> Exchange:
        """One turn."""
        exchange = self.output.exchange()
        for near in exchange.warnings:
            self._stream.publish(Warned(f"{near.quantity} {near.value:.4g} {near.unit} comes near {near.limit:.4g}"))
        self._runaway = exchange.runaway
        if exchange.violation is not None and self._over is None:
            self._exceeded(exchange.violation)
        self.heed_requests()
        return exchange

    def signals(self) -> tuple[NDArray[np.float64], bool]:
        """One turn: the experiment's signals, shape (block, len(SIGNALS)), and whether the block has fallen."""
        # a channel besides may lose samples without costing a plan its cycles
        signals = self.exchange().signals[:, : len(SIGNALS)]
        return signals, self.fall is not None and self.fall.fallen(signals)

    def heed_requests(self) -> None:
        """End as somebody has asked, if somebody has."""
        asked, why, cause = self._requests.strongest, self._requests.reason, self._requests.cause
        state = self.output.state
        if asked == "halt":
            raise Ended(self.output.cut(Ending("halted", why, cause)))
        if asked == "abort" and state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", why, cause))
        if asked == "stop" and state not in (State.ABORTING, State.STOPPING):
            self._end(State.STOPPING, Ending("stopped", why, cause))

    def end_test(self, *, fast: bool) -> bool:
        """Ramp out at the end of a test; whether the block fell on the way. A limit exceeded by then ends the run."""
        fell = self.ramp_out(State.ABORTING if fast else State.STOPPING, "the test is over")
        if self._over is not None:
            raise Ended(Ending("aborted", str(self._over), _cause(self._over)))
        return fell

    def ramp_out(self, way: State, reason: str) -> bool:
        """Bring the output to zero along the ramp of `way` and stop the rig; whether the block fell on the way."""
        begin = self._guard.abort if way is State.ABORTING else self._guard.stop
        begin()
        if self.output.state is not way:
            self.output.machine.go(way, reason)
        fell = False
        while not self._guard.at_zero:
            fell |= self.signals()[1]
        if self._runaway is not None:
            reason = f"{self._runaway} although the drive has been ramped to zero"
            raise Ended(self.output.cut(Ending("halted", reason, _cause(self._runaway))))
        self.output.rest()
        return fell

    def _exceeded(self, over: Violation) -> None:
        """The first limit that is exceeded since arming ends the run; a fast ramp that has begun goes on."""
        self._over = over
        self._stream.publish(LimitExceeded(over.quantity, over.value, over.limit, over.unit))
        if self.output.state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", str(over), _cause(over)))

    def _end(self, way: State, ending: Ending) -> Never:
        if self.output.state is not State.IDLE:
            ending = ending.then(self.output.ending_of(lambda: self.ramp_out(way, ending.reason)))
        raise Ended(ending)


def _cause(over: Violation) -> Cause:
    return Cause(CauseCode.LIMIT, over.quantity)
