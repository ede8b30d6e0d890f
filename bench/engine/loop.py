"""Acquisition loop, in which every step of a plan runs."""

from typing import Never

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.signals import SIGNALS
from bench.engine.interface import Ended, Ending, EventStream, Requests
from bench.engine.output import Output
from bench.engine.stalls import in_words
from bench.events import LimitExceeded, State, Warned
from bench.guard.guard import Exchange, Guard
from bench.guard.limits import Violation, amount
from drivers.errors import EnableLineCut
from drivers.rig import Counts, RigError
from sim.errors import UNKNOWN, Cause, CauseCode

_STATUS = {"halt": "halted", "abort": "aborted", "stop": "stopped"}
"""Status of a run that a request ends while the rig is being armed."""


class Loop:
    """Acquisition loop, which exchanges blocks until a request or an exceeded limit ends the run. `Ended` is then
    raised, with the output at zero.
    """

    def __init__(self, output: Output, guard: Guard, stream: EventStream, requests: Requests) -> None:
        self.output = output
        self._guard, self._stream, self._requests = guard, stream, requests
        self.latest: Counts | None = None
        """Counts of the last block."""
        self.fall: FallWatch | None = None
        """Detector of the fall of the mounted block; None if no specimen is mounted."""
        self._over: Violation | None = None
        self._runaway: Violation | None = None

    def begin(self, reason: str) -> None:
        """Arm the rig with samples of 0 V queued. A request while it is being armed ends the run with the enable line
        cut, because the drive is zero and somebody may be at the table.
        """
        self._over = self._runaway = None
        self.check_requests()
        failed: RigError | None = None
        try:
            with self._requests.arming():
                if not self._requests.forbids_arming:
                    self.output.arm(reason)
        except RigError as error:
            if not self._requests.forbids_arming:
                raise
            # a rig whose enable line was cut refuses to be armed; any other error is told too
            failed = None if str(error) == EnableLineCut.text else error
        asked = self._requests.strongest
        if asked is not None and self._requests.forbids_arming and self.output.driven:
            ending = Ending(_STATUS[asked], self._requests.reason, self._requests.cause)
            raise Ended(self.output.cut(ending if failed is None else ending.then(Ending.failed(failed))))
        self.check_requests()

    def exchange(self) -> Exchange:
        """Run one iteration: exchange a block, publish its warnings, check its limits and the requests."""
        exchange = self.output.exchange()
        for near in exchange.warnings:
            self._stream.publish(
                Warned(f"{near.quantity} {amount(near.value, near.unit)} approaches its limit {near.limit:.4g}")
            )
        self._runaway = exchange.runaway
        if exchange.violation is not None and exchange.violation.cuts:
            self._cut(exchange.violation)
        if exchange.violation is not None and self._over is None:
            self._exceeded(exchange.violation)
        self.check_requests()
        return exchange

    def signals(self) -> tuple[NDArray[np.float64], bool]:
        """Run one iteration. Returns signals, shape (block, len(SIGNALS)), and whether the rocking block has fallen."""
        # only the standard signals: missing samples of an additional channel must not invalidate the plan's cycles
        exchange = self.exchange()
        self.latest = exchange.block.counts
        signals = exchange.signals[:, : len(SIGNALS)]
        return signals, self.fall is not None and self.fall.fallen(signals)

    def check_requests(self) -> None:
        """End the run if a request is pending."""
        asked, why, cause = self._requests.strongest, self._requests.reason, self._requests.cause
        state = self.output.state
        if asked == "halt":
            raise Ended(self.output.cut(Ending("halted", why, cause)))
        if asked == "abort" and state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", why, cause))
        if asked == "stop" and state not in (State.ABORTING, State.STOPPING):
            self._end(State.STOPPING, Ending("stopped", why, cause))

    def end_test(self, *, fast: bool) -> bool:
        """Ramp out at the end of a test. Returns whether the block fell; an exceeded limit ends the run."""
        fell = self.ramp_out(State.ABORTING if fast else State.STOPPING, "end of the test")
        if self._over is not None:
            raise Ended(Ending("aborted", str(self._over), _cause(self._over)))
        return fell

    def ramp_out(self, way: State, reason: str, cause: Cause = UNKNOWN) -> bool:
        """Ramp the output to zero, fast if `way` is ABORTING, otherwise smoothly, and stop the rig. Returns whether the
        block fell. Halts the bench if the table still exceeds a limit at the end.
        """
        begin = self._guard.abort if way is State.ABORTING else self._guard.stop
        begin()
        if self.output.state is not way:
            self.output.machine.go(way, reason, cause)
        fell = False
        while not self._guard.at_zero:
            fell |= self.signals()[1]
        if self._runaway is not None:
            reason = f"{self._runaway} after the drive was ramped to zero"
            raise Ended(self.output.cut(Ending("halted", reason, _cause(self._runaway))))
        self.output.rest()
        return fell

    def _exceeded(self, over: Violation) -> None:
        """End the run at the first limit exceeded since arming; a fast ramp in progress continues."""
        self._over = over
        self._stream.publish(LimitExceeded(over.quantity, over.value, over.limit, over.unit, over.timing))
        if self.output.state is not State.ABORTING:
            stalled = self.output.stalled if over.timing else 0.0
            reason = f"{over}; {in_words(stalled)}" if stalled else str(over)
            self._end(State.ABORTING, Ending("aborted", reason, _cause(over)))

    def _cut(self, over: Violation) -> Never:
        """Cut the enable line now, even during a ramp, without waiting for the samples queued in the device."""
        self._over = over
        self._stream.publish(LimitExceeded(over.quantity, over.value, over.limit, over.unit, over.timing))
        raise Ended(self.output.cut(Ending("halted", f"{over}: the enable line was cut", _cause(over))))

    def _end(self, way: State, ending: Ending) -> Never:
        if self.output.state is not State.IDLE:
            ending = ending.then(self.output.ending_of(lambda: self.ramp_out(way, ending.reason, ending.cause)))
        raise Ended(ending)


def _cause(over: Violation) -> Cause:
    return Cause(CauseCode.LIMIT, over.quantity)
