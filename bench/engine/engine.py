"""Engine: runs a plan on a rig through the guard, block by block."""

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.at_rest import AtRest
from bench.engine.drives import PreparedDrive, SineDrive
from bench.engine.interface import Ended, Ending, EventStream, Operator, Requests
from bench.engine.loop import Loop
from bench.engine.output import Output
from bench.engine.stalls import Stalls
from bench.engine.steps import (
    AcquireAtRest,
    Arm,
    Calibrate,
    Done,
    Dwell,
    Fallen,
    OperatorAction,
    Outcome,
    Plan,
    Play,
    Publish,
    RampOut,
    SetHarmonics,
    Step,
    Sweep,
)
from bench.events import OperatorAnswered, OperatorAsked, SpecimenMounted, State
from bench.guard.guard import Guard
from drivers.clock import VirtualClock
from drivers.rig import OperatorTask, Rig
from sim.errors import Cause, CauseCode
from sim.specimen import Specimen


class Engine:
    """Engine of a bench: sends the drive through the guard and returns the signals to the plan.

    `block` is the number of samples per iteration; `guard` must have a signal map. On every path, `run` ramps the
    output to zero or cuts the enable line. A request to halt cuts the enable line in the requesting thread, even while
    the loop waits.
    """

    def __init__(
        self,
        rig: Rig,
        guard: Guard,
        stream: EventStream,
        requests: Requests,
        operator: Operator,
        block: int,
    ) -> None:
        self._rig, self._stream, self._operator, self._requests = rig, stream, operator, requests
        self._output = Output(rig, guard, stream, requests, block)
        self._loop = Loop(self._output, guard, stream, requests)
        self._rest = AtRest(self._loop, rig, guard, stream)
        self._sines = SineDrive(self._loop, rig)
        self._prepared = PreparedDrive(self._loop, guard, stream)
        self._specimen: Specimen | None = None
        self.returned: object = None
        """Value returned by the plan; None if the plan did not run to its end."""
        requests.cut_by(rig.halt)

    @property
    def state(self) -> State:
        """State of the bench."""
        return self._output.state

    def run(self, plan: Plan) -> Ending:
        """Run `plan` to its end, or until a request, an exceeded limit or an error ends it. Returns the ending.

        A RockbenchError of the rig, data file, plan or analysis, or a lack of memory, is returned as an ending. After
        any other error, the enable line is cut and the error is raised again.
        """
        ending_of = self._output.ending_of
        try:
            ending = self._watched(plan)
            # disarm the rig after every ending
            for last in (self._rig.stop, plan.close):
                ending = ending.then(ending_of(last))
            return ending.then(ending_of(lambda: self._output.machine.go(State.CLOSED, ending.reason, ending.cause)))
        except BaseException as error:
            self._output.rescue(error, (self._rig.stop, plan.close))
            raise

    def _watched(self, plan: Plan) -> Ending:
        """Run a plan; in real time, also detect stalls of the program."""
        if isinstance(self._rig.clock, VirtualClock):
            return self._until_ended(plan)
        with Stalls() as self._output.stalls:
            return self._until_ended(plan)

    def _until_ended(self, plan: Plan) -> Ending:
        """Run a plan, ramp the output to zero if the rig still works, and return the ending."""
        output = self._output
        ending = output.ending_of(lambda: self._carry_out(plan)) or Ending("completed", "the plan was carried out")
        if output.driven:
            # the rig still works after an error in the data file, plan or analysis: stop smoothly
            ending = ending.then(
                output.ending_of(lambda: self._loop.ramp_out(State.ABORTING, ending.reason, ending.cause))
            )
        return output.cut(ending) if output.driven else ending

    def _carry_out(self, plan: Plan) -> None:
        outcome: Outcome | None = None
        try:
            while True:
                # between steps, the plan may compute for a long time without polling for requests
                with self._requests.breakable(self._requested_end):
                    if self._requests.interrupted:
                        raise self._requested_end()
                    step = next(plan) if outcome is None else plan.send(outcome)
                outcome = self._do(step)
        except StopIteration as end:
            self.returned = end.value

    def _requested_end(self) -> Ended:
        return Ended(Ending("aborted", self._requests.reason, self._requests.cause))

    def _do(self, step: Step) -> Outcome:
        match step:
            case Sweep():
                return self._sines.sweep(step)
            case Dwell():
                return self._sines.dwell(step)
            case Play():
                self._sines.restart()
                return self._prepared.play(step)
            case Publish():
                self._stream.publish(step.event)
            case SetHarmonics():
                return self._sines.set_harmonics(step)
            case Calibrate():
                self._output.source.oscillator.use(step.calibration)
            case Arm():
                self._sines.restart()
                self._rest.arm(step, self._specimen)
            case AcquireAtRest():
                return self._rest.acquire(step)
            case RampOut():
                return Fallen() if self._loop.end_test(fast=step.fast) else Done()
            case OperatorAction():
                self._act(step)
        return Done()

    def _act(self, step: OperatorAction) -> None:
        machine = self._output.machine
        self._loop.check_requests()
        machine.go(State.WAITING, step.request)
        self._stream.publish(OperatorAsked(step.request, step.work))
        agreed = self._operator.confirm(step.request)
        machine.go(State.IDLE, "the operator answered")
        self._loop.check_requests()
        if not agreed:
            raise Ended(Ending("aborted", f"the operator declined: {step.request}", Cause(CauseCode.DECLINED)))
        self._rig.perform(step.work, (step.specimen.nominal_k_c or None) if step.amount is None else step.amount)
        self._specimen = step.specimen
        if step.work in (OperatorTask.WATCH_BLOCK, OperatorTask.WATCH_STOREYS):
            self._rest.measures_storeys = step.work is OperatorTask.WATCH_STOREYS
        self._stream.publish(OperatorAnswered(step.request, self._operator.name))
        self._stream.publish(SpecimenMounted(step.specimen, step.work, step.amount))


def configured_engine(
    rig: Rig, configuration: BenchConfiguration, stream: EventStream, requests: Requests, operator: Operator
) -> Engine:
    """Return the engine of a configured bench, with a guard that has the configured limits and signal map."""
    signals = SignalMap(rig.channels, configuration.laser_reference, configuration.calibrated)
    limits, ramps, shaker = configuration.limits, configuration.ramps, configuration.shaker_model
    guard = Guard(rig, limits, ramps, shaker, signals, configuration.channels, configuration.laser_ranges)
    return Engine(rig, guard, stream, requests, operator, configuration.block_samples)
