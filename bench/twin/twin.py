"""The live twin as a subscriber: the model runs in a thread of its own, and no block ever waits for it.

What came of a block is published with the next one. A model that is not done by then gives up half of its members; one
that is a second behind is off until the rig is armed again.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.engine.requests import Requests
from bench.events import (
    Acquired,
    Estimate,
    Event,
    RunningGain,
    SpecimenMounted,
    State,
    StateChanged,
    TwinEstimate,
    Warned,
)
from bench.twin.beside import BEHIND
from bench.twin.ensemble import Candidates, candidates
from bench.twin.estimator import Estimator, Setting
from bench.twin.gains import Measured
from bench.twin.lag import laser_lag
from bench.twin.residual import Limit
from bench.twin.standing import Standing
from sim.errors import CauseCode
from sim.specimen import Specimen

Array = NDArray[np.float64]

_LATE = 0.15
"""What may wait for the model before it gives up members [s]; two blocks may in any case."""
_BEHIND = 1.0
"""What may wait for it at all [s]."""


@dataclass(eq=False)
class _Run:
    """A run of the rig that the model goes through."""

    estimator: Future[Estimator]
    warn: Limit
    stop: Limit
    waiting: deque[Future[TwinEstimate | None]] = field(default_factory=deque[Future[TwinEstimate | None]])


class Twin:
    """Runs from when the zero is taken to when the rig is at rest again, wherever the model describes what is there.

    `publish` is called in the thread of the engine. A `patient` twin waits for its model, so that what it says and when
    is always the same: for benches whose clock does not run on. `requests` are asked to stop when a residual says so.
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
        import_module("sim.kernel.rocking")  # loading it would hold up a bench that is armed

        self._configuration = configuration
        self._publish, self._requests, self._patient = publish, requests, patient
        first, second = (configuration.analysis.laser_linearity * reach for reach in configuration.laser_ranges)
        on_ground = configuration.laser_reference == "ground"
        lag = laser_lag(configuration)
        self._setting = Setting(sample_rate, on_ground, lag, (first, second))
        block = configuration.block_samples / sample_rate
        self._late, self._most = max(round(_LATE / block), 2), max(round(_BEHIND / block), 5)
        self._standing = Standing()
        self._candidates: tuple[Specimen, Future[Candidates]] | None = None
        self._measured: Measured | None = None
        self._warned_of: Specimen | None = None
        self._about_to_run = False
        self._run: _Run | None = None
        self._worker = ThreadPoolExecutor(1, "twin")

    def close(self) -> None:
        """Let go of the thread, which ends by itself. Allowed any number of times."""
        self._worker.shutdown(wait=False, cancel_futures=True)

    def __call__(self, event: Event) -> None:
        match event:
            case SpecimenMounted():
                self._standing.follow(event)
                self._draw()
            case StateChanged():
                self._about_to_run = event.after is State.RUNNING
                # what the protocol has stated is of the test before
                self._measured = None
                if event.after in (State.IDLE, State.HALTED, State.ARMED):
                    self._leave()
            case Acquired():
                self._acquired(event)
            case Estimate() | RunningGain():
                omega = event.omega if isinstance(event, Estimate) else None
                self._measured = None if event.beta is None else Measured(event.alpha_2, omega)
            case _:
                pass

    def _draw(self) -> None:
        """Have the candidates for what stands there drawn, while nothing moves."""
        specimen = self._standing.specimen
        if specimen is not None and (self._candidates is None or self._candidates[0] != specimen):
            self._candidates = specimen, self._worker.submit(candidates, specimen, self._configuration)

    def _acquired(self, event: Acquired) -> None:
        if self._about_to_run and self._candidates is not None and self._standing.specimen is not None:
            self._begin(event.run, self._candidates[1])
        self._about_to_run = False
        if self._run is None:
            return
        if self._hear(self._run, event.time):
            self._offer(self._run, event)

    def _begin(self, number: int, those: Future[Candidates]) -> None:
        twin = self._configuration.twin
        estimator = self._worker.submit(lambda: Estimator(number, self._setting, those.result()))
        warn, stop = (Limit(limit, twin.persistence) for limit in (twin.residual_warn, twin.residual_stop))
        self._run = _Run(estimator, warn, stop)

    def _leave(self) -> None:
        run, self._run = self._run, None
        if run is not None:
            for each in run.waiting:
                each.cancel()

    def _hear(self, run: _Run, now: float) -> bool:
        """Publish what has come of the blocks before, in their order; whether the model goes on."""
        while run.waiting and (self._patient or run.waiting[0].done()):
            try:
                estimate = run.waiting.popleft().result()
            except Exception as error:
                # what runs beside a test never ends it
                self._give_up(now, f"the twin is off until the rig is armed again: {error}")
                return False
            if estimate is not None:
                self._publish(estimate)
                self._judge(run, estimate, now)
        return True

    def _offer(self, run: _Run, event: Acquired) -> None:
        if len(run.waiting) >= self._most:
            self._give_up(event.time, f"{BEHIND}: {len(run.waiting)} blocks wait for its model")
            return
        shed = len(run.waiting) >= self._late
        end = event.block.first + len(event.block)
        taking = self._worker.submit(_take, run.estimator, event.time, end, event.signals, self._measured, shed)
        run.waiting.append(taking)

    def _give_up(self, now: float, why: str) -> None:
        self._leave()
        self._publish(Warned(why, time=now))

    def _judge(self, run: _Run, estimate: TwinEstimate, now: float) -> None:
        excess, seconds = estimate.excess, estimate.seconds
        what = f"drift outside the twin's band, rms over 1 s: {excess:.3g} of the drift's"
        if run.warn.exceeded(excess, seconds) and self._warned_of != self._standing.specimen:
            self._warned_of = self._standing.specimen
            self._publish(Warned(f"{what}, limit {run.warn.limit:g}: is it the specimen that is configured?", time=now))
        if run.stop.exceeded(excess, seconds):
            self._requests.stop(f"{what}, limit {run.stop.limit:g}", CauseCode.RESIDUAL)


def _take(
    estimator: Future[Estimator], time: float, end: int, signals: Array, measured: Measured | None, shed: bool
) -> TwinEstimate | None:
    """In the twin's thread, where the estimator has been made before."""
    twin = estimator.result()
    if shed:
        twin.shed()
    return twin.take(time, end, signals, measured)
