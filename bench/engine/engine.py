"""Runs a plan on a rig, through the guard, block by block."""

from bench.engine.ending import Ended, Ending
from bench.engine.operator import Operator
from bench.engine.output import Output
from bench.engine.player import Player
from bench.engine.requests import Requests
from bench.engine.rest import Rest
from bench.engine.sines import Sines
from bench.engine.steps import (
    Arm,
    Calibrate,
    Done,
    Dwell,
    Fallen,
    Follow,
    Handle,
    Listen,
    Outcome,
    Plan,
    Play,
    RampOut,
    Say,
    Step,
    Trim,
)
from bench.engine.stream import Stream
from bench.engine.turns import Turns
from bench.events import OperatorAnswered, OperatorAsked, SpecimenMounted, State
from bench.guard.guard import Guard
from drivers.rig import Handwork, Rig
from sim.errors import Cause, CauseCode
from sim.specimen import Specimen


class Engine:
    """Owns the loop: drive from its source, through the guard, signals back to the plan.

    `block` is the number of samples of one turn; `guard` has the map of the signals. Whatever happens, `run` leaves the
    output at zero. A halt that is asked for cuts the enable line in the thread that asks, also while the loop waits for
    a block.
    """

    def __init__(
        self,
        rig: Rig,
        guard: Guard,
        stream: Stream,
        requests: Requests,
        operator: Operator,
        block: int,
    ) -> None:
        self._rig, self._stream, self._operator, self._requests = rig, stream, operator, requests
        self._output = Output(rig, guard, stream, requests, block)
        self._turns = Turns(self._output, guard, stream, requests)
        self._rest = Rest(self._turns, rig, guard, stream)
        self._sines = Sines(self._turns, rig.sample_rate)
        self._player = Player(self._turns, guard, stream)
        self._specimen: Specimen | None = None
        self.returned: object = None
        """What the plan returned; None where it broke off."""
        requests.cut_by(rig.halt)

    @property
    def state(self) -> State:
        """What the bench is doing."""
        return self._output.state

    def run(self, plan: Plan) -> Ending:
        """Carry out `plan` to its end, or to the first reason to end it.

        An error of rig, record, plan or analysis is an ending. Any other exception is raised, the output cut before.
        """
        ending_of = self._output.ending_of
        try:
            ending = self._until_ended(plan)
            # whatever the plan came to, nothing stays armed
            for last in (self._rig.stop, plan.close):
                ending = ending.then(ending_of(last))
            return ending.then(ending_of(lambda: self._output.machine.go(State.CLOSED, ending.reason)))
        except BaseException as error:
            self._output.rescue(error, (self._rig.stop, plan.close))
            raise

    def _until_ended(self, plan: Plan) -> Ending:
        """The ending of a plan, with the output brought to zero along a ramp wherever the rig still works."""
        output = self._output
        ending = output.ending_of(lambda: self._carry_out(plan)) or Ending("completed", "the plan was carried out")
        if output.driven:
            # the record, the plan or an analysis gave up: no reason to jerk the table
            ending = ending.then(output.ending_of(lambda: self._turns.ramp_out(State.ABORTING, ending.reason)))
        return output.cut(ending) if output.driven else ending

    def _carry_out(self, plan: Plan) -> None:
        outcome: Outcome | None = None
        try:
            while True:
                # what the plan computes between its steps may take long, and looks at no request
                with self._requests.breakable(self._asked_to_end):
                    if self._requests.interrupted:
                        raise self._asked_to_end()
                    step = next(plan) if outcome is None else plan.send(outcome)
                outcome = self._do(step)
        except StopIteration as end:
            self.returned = end.value

    def _asked_to_end(self) -> Ended:
        return Ended(Ending("aborted", self._requests.reason, self._requests.cause))

    def _do(self, step: Step) -> Outcome:
        match step:
            case Follow():
                return self._sines.follow(step)
            case Dwell():
                return self._sines.dwell(step)
            case Play():
                self._sines.forget()
                return self._player.play(step)
            case Say():
                self._stream.publish(step.event)
            case Trim():
                self._sines.trim(step)
            case Calibrate():
                self._output.source.oscillator.use(step.calibration)
            case Arm():
                self._sines.forget()
                self._rest.arm(step, self._specimen)
            case Listen():
                return self._rest.listen(step)
            case RampOut():
                return Fallen() if self._turns.end_test(fast=step.fast) else Done()
            case Handle():
                self._handle(step)
        return Done()

    def _handle(self, step: Handle) -> None:
        machine = self._output.machine
        self._turns.heed_requests()
        machine.go(State.WAITING, step.request)
        self._stream.publish(OperatorAsked(step.request, step.work))
        agreed = self._operator.confirm(step.request)
        machine.go(State.IDLE, "the operator answered")
        self._turns.heed_requests()
        if not agreed:
            raise Ended(Ending("aborted", f"the operator declined: {step.request}", Cause(CauseCode.DECLINED)))
        self._rig.handwork(step.work, (step.specimen.nominal_k_c or None) if step.amount is None else step.amount)
        self._specimen = step.specimen
        if step.work in (Handwork.WATCH_BLOCK, Handwork.WATCH_STOREYS):
            self._rest.sees_storeys = step.work is Handwork.WATCH_STOREYS
        self._stream.publish(OperatorAnswered(step.request, self._operator.name))
        self._stream.publish(SpecimenMounted(step.specimen, step.work, step.amount))
