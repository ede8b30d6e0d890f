"""Runs a plan on a rig, through the guard, block by block."""

from collections.abc import Callable
from contextlib import suppress
from typing import Never

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.fall import FallWatch
from bench.analysis.signals import SignalMap
from bench.control.legs import sweeps
from bench.control.oscillator import Oscillator
from bench.engine.ending import Ended, Ending
from bench.engine.machine import Machine
from bench.engine.operator import Operator
from bench.engine.placements import Placements
from bench.engine.requests import Requests
from bench.engine.steps import (
    Arm,
    Calibrate,
    Done,
    Dwell,
    Fallen,
    Follow,
    Handle,
    Heard,
    Listen,
    Measured,
    Outcome,
    Plan,
    RampOut,
    Say,
    Step,
    Trim,
)
from bench.engine.stream import Stream
from bench.events import Acquired, LimitExceeded, OperatorAnswered, OperatorAsked, State, StateChanged, Warned
from bench.guard.guard import Exchange, Guard
from bench.guard.violation import Violation
from drivers.rig import Counts, Rig, RigError
from sim.errors import RockbenchError
from sim.specimen import Specimen

_DRIVEN = (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING)
"""States in which the rig is armed."""


class Engine:
    """Owns the loop: drive from the oscillator, through the guard, signals back to the plan.

    `block` is the number of samples of one turn. Whatever happens, `run` leaves the output at zero. A halt that is
    asked for cuts the enable line in the thread that asks, also while the loop waits for a block.
    """

    def __init__(
        self,
        rig: Rig,
        guard: Guard,
        signals: SignalMap,
        stream: Stream,
        requests: Requests,
        operator: Operator,
        block: int,
    ) -> None:
        self._rig, self._guard, self._signals, self._stream = rig, guard, signals, stream
        self._requests, self._operator, self._block = requests, operator, block
        self._machine = Machine(self._announce)
        self._placements = Placements(rig, stream)
        self._oscillator = Oscillator(rig.sample_rate)
        self._specimen: Specimen | None = None
        self._fall: FallWatch | None = None
        self._cycles: CycleAnalyser | None = None
        self._drive = np.zeros(0)
        self._over: Violation | None = None
        self._runaway: Violation | None = None
        self._read = 0
        self._run = 0
        requests.cut_by(rig.halt)

    @property
    def state(self) -> State:
        """What the bench is doing."""
        return self._machine.state

    def run(self, plan: Plan) -> Ending:
        """Carry out `plan` to its end, or to the first reason to end it.

        An error of rig, record, plan or analysis is an ending. Any other exception is raised, the output cut before.
        """
        try:
            ending = self._until_ended(plan)
            # whatever the plan came to, nothing stays armed
            for last in (self._rig.stop, plan.close):
                ending = ending.then(self._ending_of(last))
            return ending.then(self._ending_of(lambda: self._machine.go(State.CLOSED, ending.reason)))
        except BaseException as error:
            self._rescue(error, plan)
            raise

    def _until_ended(self, plan: Plan) -> Ending:
        """The ending of a plan, with the output brought to zero along a ramp wherever the rig still works."""
        ending = self._ending_of(lambda: self._carry_out(plan)) or Ending("completed", "the plan was carried out")
        if self.state in _DRIVEN:
            # the record, the plan or an analysis gave up: no reason to jerk the table
            ending = ending.then(self._ending_of(lambda: self._ramp_out(State.ABORTING, ending.reason)))
        return self._cut(ending) if self.state in _DRIVEN else ending

    def _ending_of(self, work: Callable[[], object]) -> Ending | None:
        """Why `work` could not be done to its end, or None."""
        try:
            work()
        except Ended as ended:
            return ended.ending
        except RigError as error:
            if self._requests.strongest == "halt" and self.state in _DRIVEN:
                # the rig was cut under the loop by the thread that asked
                return self._cut(Ending("halted", "halt was asked for"))
            return self._cut(Ending("failed", str(error)))
        except RockbenchError as error:
            return Ending("failed", str(error))
        return None

    def _rescue(self, error: BaseException, plan: Plan) -> None:
        """Cut the output for an error that is about to be raised, and note on it what else goes wrong."""
        ending = Ending("failed", f"{type(error).__name__} in the plan or a subscriber")
        for last in (lambda: self._cut(ending), self._rig.stop, plan.close):
            try:
                last()
            except Exception as another:
                error.add_note(f"then {type(another).__name__}: {another}")

    def _carry_out(self, plan: Plan) -> None:
        try:
            step = next(plan)
            while True:
                step = plan.send(self._do(step))
        except StopIteration:
            return

    def _do(self, step: Step) -> Outcome:
        match step:
            case Follow():
                return self._follow(step)
            case Dwell():
                return self._dwell(step)
            case Say():
                self._stream.say(step.event)
            case Trim():
                self._oscillator.trim(step.shares)
            case Calibrate():
                self._oscillator.use(step.calibration)
            case Arm():
                self._arm(step)
            case Listen():
                return self._listen(step)
            case RampOut():
                return self._end_test(step)
            case Handle():
                self._handle(step)
        return Done()

    def _arm(self, step: Arm) -> None:
        self._begin("the operator's work is done")
        rest = self._stillness(step)
        self._signals.tare(rest)
        self._guard.tare(rest)
        self._fall = FallWatch(self._specimen, self._rig.sample_rate) if self._specimen else None
        self._machine.go(State.RUNNING, "at rest, zero taken")

    def _begin(self, reason: str) -> None:
        """Arm the rig, with silence ahead."""
        self._oscillator.reset()
        self._read, self._cycles = 0, None
        self._over = self._runaway = None
        self._run += 1
        self._heed_requests()
        self._machine.go(State.ARMED, reason)
        self._guard.arm()
        self._placements.begin(self._run)
        # a halt that came while the rig was being armed found no enable line to cut
        self._heed_requests()

    def _listen(self, step: Listen) -> Heard:
        """A violation ends the listening but not the plan, which may want to know what is wrong: nothing is driven."""
        self._begin("to listen with the output at zero")
        counts: list[Counts] = []
        violation: Violation | None = None
        for _ in range(max(round(step.duration * self._rig.sample_rate / self._block), 1)):
            exchange = self._exchange()
            counts.append(exchange.block.counts)
            violation = exchange.violation
            if violation is not None:
                self._guard.halt()
                break
            self._heed_requests()
        self._machine.go(State.STOPPING, "enough was heard" if violation is None else str(violation))
        self._rest()
        return Heard(self._rig.channels, np.concatenate(counts), violation)

    def _stillness(self, step: Arm) -> NDArray[np.float64]:
        """Channel values over a rest during which the storeys were still, shape (n, n_channels)."""
        turns = max(round(step.rest * self._rig.sample_rate / self._block), 1)
        waited = 0.0
        while True:
            values = np.concatenate([self._turn() for _ in range(turns)])
            if self._signals.scatter(values) <= step.still:
                return values
            waited += step.rest
            if waited >= step.patience:
                self._stream.say(Warned(0.0, f"the storeys are not still after {waited:g} s; zero taken anyway"))
                return values

    def _follow(self, step: Follow) -> Outcome:
        self._cycles = None
        for sweep in sweeps(step.legs, self._oscillator.amplitude, self._oscillator.omega):
            self._oscillator.follow(sweep)
        # what is asked now is played after the samples that already wait in the rig
        end = self._read + self._rig.lead + self._oscillator.remaining
        while self._read < end:
            if self._fell(self._signals.of(self._turn())):
                return Fallen()
        return Done()

    def _dwell(self, step: Dwell) -> Outcome:
        if self._cycles is None:
            self._cycles = CycleAnalyser(self._oscillator.omega, self._rig.sample_rate, self._read)
        done: list[Cycle] = []
        end = self._cycles.completed + step.cycles
        while self._cycles.completed < end:
            values = self._turn()
            signals = self._signals.of(values)
            if self._fell(signals):
                return Fallen()
            done += self._cycles.push(np.column_stack((signals, self._drive)))
        return Measured(tuple(done))

    def _handle(self, step: Handle) -> None:
        self._heed_requests()
        self._machine.go(State.WAITING, step.request)
        self._stream.say(OperatorAsked(0.0, step.request))
        agreed = self._operator.confirm(step.request)
        self._machine.go(State.IDLE, "the operator answered")
        self._heed_requests()
        if not agreed:
            raise Ended(Ending("aborted", f"the operator declined: {step.request}"))
        self._rig.handwork(step.work, step.specimen.k_c or None)
        self._specimen = step.specimen
        self._stream.say(OperatorAnswered(0.0, step.request, self._operator.name))

    def _turn(self) -> NDArray[np.float64]:
        """One turn of the loop: the channels' values, shape (block, n_channels)."""
        exchange = self._exchange()
        for near in exchange.warnings:
            self._stream.say(Warned(0.0, f"{near.quantity} {near.value:.4g} {near.unit} comes near {near.limit:.4g}"))
        self._runaway = exchange.runaway
        if exchange.violation is not None and self._over is None:
            self._exceeded(exchange.violation)
        self._heed_requests()
        return exchange.values

    def _exchange(self) -> Exchange:
        """Drive and read one block; an open safety input ends everything."""
        exchange = self._guard.exchange(self._oscillator.next(self._block))
        self._read = exchange.block.first + len(exchange.block)
        self._drive = exchange.drive
        self._stream.publish(Acquired(self._stream.now(), self._run, exchange.block, exchange.drive))
        if exchange.opened:
            raise Ended(self._cut(Ending("halted", f"{', '.join(exchange.opened)} opened")))
        return exchange

    def _exceeded(self, over: Violation) -> None:
        """The first limit that is exceeded since arming ends the run; a fast ramp that has begun goes on."""
        self._over = over
        self._stream.say(LimitExceeded(0.0, over.quantity, over.value, over.limit, over.unit))
        if self.state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", str(over)))

    def _heed_requests(self) -> None:
        asked = self._requests.strongest
        if asked == "halt":
            raise Ended(self._cut(Ending("halted", "halt was asked for")))
        if asked == "abort" and self.state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", "abort was asked for"))
        if asked == "stop" and self.state not in (State.ABORTING, State.STOPPING):
            self._end(State.STOPPING, Ending("stopped", "stop was asked for"))

    def _end(self, way: State, ending: Ending) -> Never:
        if self.state is not State.IDLE:
            ending = ending.then(self._ending_of(lambda: self._ramp_out(way, ending.reason)))
        raise Ended(ending)

    def _end_test(self, step: RampOut) -> Outcome:
        outcome = self._ramp_out(State.ABORTING if step.fast else State.STOPPING, "the test is over")
        if self._over is not None:
            raise Ended(Ending("aborted", str(self._over)))
        return outcome

    def _ramp_out(self, way: State, reason: str) -> Outcome:
        begin = self._guard.abort if way is State.ABORTING else self._guard.stop
        begin()
        if self.state is not way:
            self._machine.go(way, reason)
        fell = False
        while not self._guard.at_zero:
            fell |= self._fell(self._signals.of(self._turn()))
        if self._runaway is not None:
            reason = f"{self._runaway} although the drive has been ramped to zero"
            raise Ended(self._cut(Ending("halted", reason)))
        self._rest()
        return Fallen() if fell else Done()

    def _rest(self) -> None:
        self._guard.disarm()
        self._machine.go(State.IDLE, "the output is at zero")
        self._placements.tell()

    def _cut(self, ending: Ending) -> Ending:
        """Cut the enable line now. Returns the ending, with what went wrong while cutting."""
        try:
            self._guard.halt()
        except RigError as error:
            ending = ending.then(Ending("failed", str(error)))
        if self.state not in (State.HALTED, State.CLOSED):
            try:
                self._machine.go(State.HALTED, ending.reason)
            except RockbenchError as error:
                ending = ending.then(Ending("failed", str(error)))
        # what ended the run is what must be told of it
        with suppress(RockbenchError):
            self._placements.tell()
        return ending

    def _fell(self, signals: NDArray[np.float64]) -> bool:
        return self._fall is not None and self._fall.fallen(signals)

    def _announce(self, before: State, after: State, reason: str) -> None:
        self._stream.publish(StateChanged(self._stream.now(), before, after, reason))
