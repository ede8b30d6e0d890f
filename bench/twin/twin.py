"""Live twin: a subscriber to events whose model runs in a separate thread. Acquisition in real time never waits for it.

An estimate is published with the first block read after it is finished. A late model drops half of its members; one
that is too far behind is switched off until the rig is armed again.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.engine.interface import Requests
from bench.events import Acquired, Event, SpecimenMounted, State, StateChanged, Warned
from bench.live_values import Estimate, RunningGain, TwinEstimate
from bench.twin.ensemble import Measured, Members, draw_members
from bench.twin.estimator import Estimator, Limit, Setting, laser_lag
from drivers.rig import OperatorTask
from sim import waiting
from sim.errors import CauseCode
from sim.specimen import Specimen

_BEGINS = {
    OperatorTask.LOCK_FRAME: "the frame is locked",
    OperatorTask.LOCK_TABLE: "the table is locked",
    OperatorTask.HOLD_BLOCK: "the block is held",
    OperatorTask.WATCH_BLOCK: "the laser of storey 2 is aimed at the block",
    OperatorTask.TILT_BLOCK: "the block is released from a tilt",
    OperatorTask.PULL_FRAME: "the frame is released from a deflection",
}
"""Operator actions after which the model does not apply, and the reason for each."""

_MOUNTED = (OperatorTask.HOLD_BLOCK, OperatorTask.TILT_BLOCK, OperatorTask.PULL_FRAME)
_ENDS = {
    OperatorTask.UNLOCK_FRAME: (OperatorTask.LOCK_FRAME,),
    OperatorTask.UNLOCK_TABLE: (OperatorTask.LOCK_TABLE,),
    OperatorTask.WATCH_STOREYS: (OperatorTask.WATCH_BLOCK,),
    OperatorTask.MOUNT_SPRING: _MOUNTED,
    OperatorTask.REMOVE_BLOCK: _MOUNTED,
}
"""Operator actions that undo earlier ones, and the actions that each undoes."""


class Applicability:
    """Applicability of the model to the mounted specimen, determined from the operator actions."""

    def __init__(self) -> None:
        self._mounted: Specimen | None = None
        self._against: set[OperatorTask] = set()

    def follow(self, event: SpecimenMounted) -> None:
        """Update the applicability after an operator action."""
        self._mounted = event.specimen
        self._against.difference_update(_ENDS.get(event.work, ()))
        if event.work in _BEGINS:
            self._against.add(event.work)

    @property
    def specimen(self) -> Specimen | None:
        """Mounted specimen if the model applies to it. None if it is unknown, or if the model does not apply (see
        `why_not`).
        """
        return None if self._against else self._mounted

    @property
    def why_not(self) -> str:
        """Reason why the model does not apply to the mounted specimen; empty if it applies."""
        return "; ".join(_BEGINS[work] for work in _BEGINS if work in self._against)


Array = NDArray[np.float64]

_LATE = 0.15
"""Backlog [s], but not less than two blocks, at which the model drops members."""
_BEHIND = 1.0
"""Backlog [s], but not less than five blocks, at which the twin is switched off."""
_NOT_IN_TIME = "the twin did not keep up and is off until the rig is armed again"


@dataclass(eq=False)
class _Run:
    """State of the twin in one run of the rig."""

    estimator: Future[Estimator]
    warn: Limit
    stop: Limit
    waiting: deque[Future[TwinEstimate | None]] = field(default_factory=deque[Future[TwinEstimate | None]])


class Twin:
    """Computes estimates during every test, from taring to rest, if the model applies to the mounted specimen.

    `publish` is called in the engine's thread. A `patient` twin waits for its model, so that its estimates are
    reproducible, as needed in virtual time. If the relative excess of the measured drift over the model's band exceeds
    `twin.residual_warn`, the twin issues a warning, once per specimen; if it exceeds `twin.residual_stop`, the twin
    requests a stop.
    """

    def __init__(
        self,
        sample_rate: float,
        configuration: BenchConfiguration,
        publish: Callable[[Event], None],
        requests: Requests,
        *,
        patient: bool,
    ) -> None:
        import_module("sim.kernel.rocking")  # load it now, because loading it later would delay an armed bench

        self._configuration = configuration
        self._publish, self._requests, self._patient = publish, requests, patient
        on_ground = configuration.laser_reference == "ground"
        lag = laser_lag(configuration)
        self._setting = Setting(sample_rate, on_ground, lag, configuration.sensors)
        block = configuration.block_samples / sample_rate
        self._late, self._most = max(round(_LATE / block), 2), max(round(_BEHIND / block), 5)
        self._applicability = Applicability()
        self._members: tuple[Specimen, Future[Members]] | None = None
        self._measured: Measured | None = None
        self._warned_of: Specimen | None = None
        self._about_to_run = False
        self._run: _Run | None = None
        self._worker = ThreadPoolExecutor(1, "twin")

    def close(self) -> None:
        """Release the thread; may be called repeatedly."""
        self._worker.shutdown(wait=False, cancel_futures=True)

    def __call__(self, event: Event) -> None:
        match event:
            case SpecimenMounted():
                self._applicability.follow(event)
                self._draw()
            case StateChanged():
                self._about_to_run = event.after is State.RUNNING
                # the last published gain is that of the preceding test
                self._measured = None
                if event.after in (State.IDLE, State.HALTED, State.ARMED):
                    self._end_run()
            case Acquired():
                self._acquired(event)
            case Estimate() | RunningGain():
                omega = event.omega if isinstance(event, Estimate) else None
                self._measured = None if event.beta is None else Measured(event.alpha_2, omega)
            case _:
                pass

    def _draw(self) -> None:
        """Draw the members for the mounted specimen while the bench is at rest."""
        specimen = self._applicability.specimen
        if specimen is not None and (self._members is None or self._members[0] != specimen):
            self._members = specimen, self._worker.submit(draw_members, specimen, self._configuration)

    def _acquired(self, event: Acquired) -> None:
        if self._about_to_run and self._members is not None and self._applicability.specimen is not None:
            self._begin(event.run, self._members[1])
        self._about_to_run = False
        if self._run is None:
            return
        if self._collect(self._run, event.time):
            self._enqueue(self._run, event)

    def _begin(self, number: int, members: Future[Members]) -> None:
        twin = self._configuration.twin
        estimator = self._worker.submit(lambda: Estimator(number, self._setting, members.result()))
        warn, stop = (Limit(limit, twin.persistence) for limit in (twin.residual_warn, twin.residual_stop))
        self._run = _Run(estimator, warn, stop)

    def _end_run(self) -> None:
        run, self._run = self._run, None
        if run is not None:
            for each in run.waiting:
                each.cancel()

    def _collect(self, run: _Run, now: float) -> bool:
        """Publish the finished estimates in order. Returns whether the model continues."""
        while run.waiting and (self._patient or run.waiting[0].done()):
            try:
                estimate = waiting.result(run.waiting.popleft())
            except Exception as error:
                # an error in the twin must not end a test
                self._suspend(now, f"the twin is off until the rig is armed again: {error}")
                return False
            if estimate is not None:
                self._publish(estimate)
                self._judge(run, estimate, now)
        return True

    def _enqueue(self, run: _Run, event: Acquired) -> None:
        if len(run.waiting) >= self._most:
            self._suspend(
                event.time, f"{_NOT_IN_TIME}: {len(run.waiting)} blocks are waiting for its model", realtime=True
            )
            return
        shed = len(run.waiting) >= self._late
        end = event.block.first + len(event.block)
        taking = self._worker.submit(_take, run.estimator, event.time, end, event.signals, self._measured, shed)
        run.waiting.append(taking)

    def _suspend(self, now: float, why: str, *, realtime: bool = False) -> None:
        self._end_run()
        self._publish(Warned(why, realtime, time=now))

    def _judge(self, run: _Run, estimate: TwinEstimate, now: float) -> None:
        excess, seconds = estimate.excess, estimate.seconds
        what = f"drift outside the twin's band: rms over 1 s of the excess is {excess:.3g} times the largest rms drift"
        if run.warn.exceeded(excess, seconds) and self._warned_of != self._applicability.specimen:
            self._warned_of = self._applicability.specimen
            self._publish(Warned(f"{what}, limit {run.warn.limit:g}: check which specimen is mounted", time=now))
        if run.stop.exceeded(excess, seconds):
            self._requests.stop(f"{what}, limit {run.stop.limit:g}", CauseCode.RESIDUAL)


def _take(
    estimator: Future[Estimator], time: float, end: int, signals: Array, measured: Measured | None, shed: bool
) -> TwinEstimate | None:
    """Compute the estimate of a block; called in the twin's thread after the estimator has been created."""
    twin = estimator.result()
    if shed:
        twin.shed()
    return twin.take(time, end, signals, measured)
