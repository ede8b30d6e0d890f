"""Runs a plan on a rig, through the guard, block by block."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Never

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.fall import FallWatch
from bench.analysis.signals import SignalMap
from bench.control.legs import sweeps
from bench.control.oscillator import Oscillator
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
from bench.guard.watch import Violation
from drivers.rig import Counts, Rig, RigError
from sim.errors import RockbenchError
from sim.specimen import Specimen


@dataclass(frozen=True)
class Ending:
    """How a session ended: `status` is completed, stopped, aborted, halted or failed, with the reason."""

    status: str
    reason: str


class _Ended(Exception):
    """The plan is over before its end."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending.reason)
        self.ending = ending


class Engine:
    """Owns the loop: drive from the oscillator, through the guard, signals back to the plan.

    `block` is the number of samples of one turn. Whatever happens, `run` leaves the output at zero.
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
        self._read = 0
        self._run = 0

    @property
    def state(self) -> State:
        """What the bench is doing."""
        return self._machine.state

    def run(self, plan: Plan) -> Ending:
        """Carry out `plan` to its end, or to the first reason to end it."""
        try:
            ending = self._until_ended(plan)
        except RigError as error:
            self._cut(str(error))
            ending = Ending("failed", str(error))
        except BaseException as error:
            self._cut(f"{type(error).__name__} in the plan or a subscriber")
            raise
        finally:
            try:
                self._rig.stop()
            finally:
                plan.close()
        self._machine.go(State.CLOSED, ending.reason)
        return ending

    def _until_ended(self, plan: Plan) -> Ending:
        """The ending of a plan, with the output brought to zero along a ramp wherever the rig still works."""
        try:
            ending = self._carry_out(plan)
        except _Ended as ended:
            return ended.ending
        except RigError:
            raise
        except RockbenchError as error:
            # the record, the plan or an analysis gave up: no reason to jerk the table
            ending = Ending("failed", str(error))
        if self.state in (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING):
            self._ramp_out(State.ABORTING, ending.reason)
        return ending

    def _carry_out(self, plan: Plan) -> Ending:
        try:
            step = next(plan)
            while True:
                step = plan.send(self._do(step))
        except StopIteration:
            return Ending("completed", "the plan was carried out")

    def _do(self, step: Step) -> Outcome:
        match step:
            case Follow():
                return self._follow(step)
            case Dwell():
                return self._dwell(step)
            case Say():
                self._stream.say(step.event)
            case Trim():
                self._oscillator.trim(step.factor)
            case Calibrate():
                self._oscillator.use(step.calibration)
            case Arm():
                self._arm(step)
            case Listen():
                return self._listen(step)
            case RampOut():
                return self._ramp_out(State.ABORTING if step.fast else State.STOPPING, "the test is over")
            case Handle():
                self._handle(step)
        return Done()

    def _arm(self, step: Arm) -> None:
        self._begin("the operator's work is done")
        self._signals.tare(self._stillness(step))
        self._fall = FallWatch(self._specimen, self._rig.sample_rate) if self._specimen else None
        self._machine.go(State.RUNNING, "at rest, zero taken")

    def _begin(self, reason: str) -> None:
        """Arm the rig, with silence ahead."""
        self._oscillator.reset()
        self._read, self._cycles = 0, None
        self._run += 1
        self._heed_requests()
        self._machine.go(State.ARMED, reason)
        self._guard.arm()
        self._placements.begin(self._run)

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
        if not agreed:
            raise _Ended(Ending("aborted", f"the operator declined: {step.request}"))
        self._heed_requests()
        self._rig.handwork(step.work, step.specimen.k_c or None)
        self._specimen = step.specimen
        self._stream.say(OperatorAnswered(0.0, step.request, self._operator.name))

    def _turn(self) -> NDArray[np.float64]:
        """One turn of the loop: the channels' values, shape (block, n_channels)."""
        exchange = self._exchange()
        self._over = over = exchange.violation
        if over is not None and self.state is not State.ABORTING:
            self._stream.say(LimitExceeded(0.0, over.quantity, over.value, over.limit, over.unit))
            self._end(State.ABORTING, Ending("aborted", str(over)))
        self._heed_requests()
        return exchange.values

    def _exchange(self) -> Exchange:
        exchange = self._guard.exchange(self._oscillator.next(self._block))
        self._read = exchange.block.first + len(exchange.block)
        self._drive = exchange.drive
        self._stream.publish(Acquired(self._stream.now(), self._run, exchange.block, exchange.drive))
        return exchange

    def _heed_requests(self) -> None:
        asked = self._requests.strongest
        if asked == "halt":
            self._cut("halt was asked for")
            raise _Ended(Ending("halted", "halt was asked for"))
        if asked == "abort" and self.state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", "abort was asked for"))
        if asked == "stop" and self.state not in (State.ABORTING, State.STOPPING):
            self._end(State.STOPPING, Ending("stopped", "stop was asked for"))

    def _end(self, way: State, ending: Ending) -> Never:
        if self.state is not State.IDLE:
            self._ramp_out(way, ending.reason)
        raise _Ended(ending)

    def _ramp_out(self, way: State, reason: str) -> Outcome:
        if self.state is not way:
            self._machine.go(way, reason)
        begin = self._guard.abort if way is State.ABORTING else self._guard.stop
        begin()
        fell = False
        while not self._guard.at_zero:
            fell |= self._fell(self._signals.of(self._turn()))
        if self._over is not None:
            self._cut(f"{self._over} although the drive has been ramped to zero")
            raise _Ended(Ending("halted", f"{self._over} although the drive has been ramped to zero"))
        self._rest()
        return Fallen() if fell else Done()

    def _rest(self) -> None:
        self._guard.disarm()
        self._machine.go(State.IDLE, "the output is at zero")
        self._placements.tell()

    def _cut(self, reason: str) -> None:
        self._guard.halt()
        if self.state not in (State.HALTED, State.CLOSED):
            self._machine.go(State.HALTED, reason)
        # what ended the run is what must be told of it
        with suppress(RockbenchError):
            self._placements.tell()

    def _fell(self, signals: NDArray[np.float64]) -> bool:
        return self._fall is not None and self._fall.fallen(signals)

    def _announce(self, before: State, after: State, reason: str) -> None:
        self._stream.publish(StateChanged(self._stream.now(), before, after, reason))
