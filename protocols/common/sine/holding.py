"""Hold of an unstable rocking motion: capture of the free motion, correction of the table, measurement and release."""

from collections import deque
from collections.abc import Generator
from dataclasses import replace
from math import nan, sqrt, tau

import numpy as np

from bench.analysis.cycles import Cycle
from bench.analysis.free_motion import SHORTEST, Rate, rate_of
from bench.analysis.gain import SensorAccuracy, steady_peak
from bench.analysis.signals import DRIFT
from bench.analysis.steady import WINDOW, SteadyDetector
from bench.config.model import BenchConfiguration
from bench.control.cycle_identification import Control, IdentifyingStabiliser
from bench.control.sine import Sine, SineControl, SineResponse, Tolerance
from bench.control.stabiliser import BLEND, DELAY, HoldMonitor, StabiliserDesign, observed
from bench.engine.steps import Dwell, Fallen, Measured, Outcome, Publish, Scheduled, SetHarmonics, Step
from bench.events import Event, StepStarted, event
from protocols.common.sine.settings import SineParameters
from protocols.common.sine.settling import (
    AIM,
    INTERVAL,
    JUDGED,
    LASERS,
    TRANSIENT,
    Held,
    Report,
    TableState,
)
from sim.cycle_map import cycle_map
from sim.parameters import column
from sim.shaker import Shaker
from sim.steady import NoOrbit, Orbit

PATIENCE, MODEL_FREE_PATIENCE = 200, 400
"""Number of cycles within which a motion must be captured, with a predicted or an identified map.

Correction of the table and measurement together may take another `PATIENCE` cycles.
"""

SLOW = 0.985
"""Largest modulus of the Floquet multipliers on fixed ground above which a hold is prepared before the test."""

UPDATES = 8
"""Largest number of corrections of the table while a motion is held."""

RELEASED, GROWN = 120, 0.3
"""Largest number of cycles observed after the release, and relative deviation of the peak drift from the orbit's at
which the observation ends.
"""

KICK, FADING = 0.003, 12
"""Control in a single cycle after the measurement, relative to the amplitude, which starts the deviation; and number of
cycles after it in which the effects of the other multipliers decay.
"""


@event(table="hold_cycles", journalled=False)
class HoldCycle(Event):
    """One cycle of an unstable motion while it is held or after its release.

    Values are NaN for an unmeasured cycle; the deviation is also NaN before a map is identified.
    """

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring")
    cycle: int = column("1", "number of the cycle since the beginning of the hold")
    drift_peak: float = column("m", "peak drift in the cycle")
    deviation: float = column("1", "estimated deviation from the periodic motion, relative to that motion")
    control: float = column("1", "magnitude of the control in the cycle, relative to the table's amplitude")


@event(table="hold_maps", journalled=False)
class HoldMap(Event):
    """A cycle map identified during a hold without a model; the stabiliser is then the one designed for this map."""

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring")
    cycle: int = column("1", "number of the cycle since the beginning of the hold")
    modulus: float = column("1", "modulus of the dominant pair of multipliers of the map")
    angle: float = column("rad", "argument of the dominant pair of multipliers of the map")


def prepared(orbit: Orbit | None, shaker: Shaker | None, harmonics: int) -> StabiliserDesign | None:
    """Design of the stabiliser, computed in advance because the computation takes too long to be done while the table
    is driven. None if there is no orbit on the table, or if no stabiliser can be designed for it.
    """
    if orbit is None:
        return None
    try:
        return StabiliserDesign.of(cycle_map(orbit, shaker, harmonics, BLEND))
    except (NoOrbit, np.linalg.LinAlgError, ValueError):
        return None


def collected(measured_cycles: int) -> int:
    """Number of cycles at the end of a hold from which its motion is judged and `measured_cycles` are taken. They
    follow the capture and the last correction of the table.
    """
    return max(measured_cycles, 2 * WINDOW)


def too_late(configuration: BenchConfiguration, omega: float) -> str | None:
    """Reason why a motion at `omega` [rad/s] cannot be held: corrections would take effect more than `DELAY` cycles
    after the measured cycle. None if it can be held.

    The last sample of a cycle is read up to a block late, and a command takes effect after the lead.
    """
    latency = (configuration.block_samples + configuration.lead_samples) / configuration.sample_rate
    cycle = tau / omega
    if latency <= (DELAY - 1) * cycle:
        return None
    return (
        f"acquisition.block_duration and acquisition.lead, together {latency:.3g} s, are longer than a cycle of "
        f"{cycle:.3g} s, so a correction would be too late: reduce them"
    )


def hold(
    sine: Sine,
    table: TableState,
    stabiliser: Control,
    beta: float,
    largest: float,
    parameters: SineParameters,
    accuracy: SensorAccuracy,
    report: Report,
) -> Generator[Step, Outcome, Held | Fallen]:
    """Capture an orbit from the present motion, hold it, measure it, and observe its motion after release.

    `largest` [m] is the largest peak drift allowed. The amplitude control is inactive while the motion is captured;
    after that it corrects the harmonics of the drive, to which the control of the hold is added.
    """
    run = Hold(sine, table, stabiliser, largest, parameters, accuracy)
    held = yield from capture_and_measure(run, beta, report)
    found = stabiliser.cycle_map
    if isinstance(held, Fallen) or held.peak is None or found is None:
        return held
    first, *others = run.shares
    kicked = (first + KICK * found.sensitive / table.answer, *others)
    yield SetHarmonics(kicked, run.monitor.cycles + 1, BLEND)
    yield SetHarmonics(run.shares, run.monitor.cycles + 2, BLEND)
    free = yield from _released(sine, beta, held.peak.drift, largest, run.monitor.cycles)
    # a fall after the release does not concern what was measured before it
    return replace(held, fallen=True) if isinstance(free, Fallen) else replace(held, rate=free)


def capture_and_measure(run: "Hold", beta: float, report: Report) -> Generator[Step, Outcome, Held | Fallen]:
    """Capture the orbit from the present motion, correct the motion of the table, and measure the held motion.

    On return, the control of the last cycle is still in effect, unless the hold was released for the stated reason.
    """
    phase: float | None = run.stabiliser.phase
    shown = run.stabiliser.cycle_map
    while True:
        outcome = yield Dwell(1, phase)
        phase = None
        if not isinstance(outcome, Measured):
            return Fallen()
        for cycle in outcome.cycles or (None,):
            reason = run.push(cycle)
            if not np.isfinite(run.command[0]):
                reason = "the estimate of the deviation is not finite"
            yield Publish(HoldCycle(run.sine.omega, beta, run.monitor.cycles, *run.last))
            if (found := run.stabiliser.cycle_map) is not shown and found is not None:
                shown, slowest = found, found.slowest
                yield Publish(HoldMap(run.sine.omega, beta, run.monitor.cycles, abs(slowest), float(np.angle(slowest))))
            if reason is None:
                reason = _delayed((yield SetHarmonics(run.command, run.monitor.cycles - 1 + DELAY, BLEND)))
            if reason is not None:
                yield SetHarmonics(run.shares)
                return Held(None, reason, captured=run.monitor.captured_after, cycles=run.monitor.cycles)
        if run.monitor.cycles % INTERVAL == 0 and run.recent:
            yield from report(list(run.recent))
        if (held := run.measured()) is not None and held.peak is not None:
            return held


def _delayed(outcome: Outcome) -> str | None:
    """Reason to release a hold whose correction began after the start of its cycle; None if it begins in time.

    `too_late` cannot exclude this, because the delays that a rig adds to the lead are known only once it is open.
    """
    if not isinstance(outcome, Scheduled) or outcome.late <= 0.0:
        return None
    return (
        f"a correction came {1e3 * outcome.late:.3g} ms too late for its cycle: the samples are delayed by more than "
        "acquisition.block_duration and acquisition.lead; reduce them"
    )


def _released(
    sine: Sine, beta: float, drift: float, largest: float, cycles: int
) -> Generator[Step, Outcome, Rate | Fallen | None]:
    """Rate at which a small deviation changes without control; None if it was not observed. `drift` [m] is the peak on
    the orbit; the first peak above `largest` [m] ends the observation.
    """
    yield Publish(StepStarted(f"beta = {beta:g} at {sine.omega:g} rad/s: released, observing the deviation"))
    found = list[Cycle]()
    for count in range(1, RELEASED + 1):
        outcome = yield Dwell(1)
        if not isinstance(outcome, Measured):
            return Fallen()
        for cycle in outcome.cycles:
            peak = float(cycle.extreme[DRIFT])
            deviation = peak / drift - 1.0
            yield Publish(HoldCycle(sine.omega, beta, cycles + count, peak, abs(deviation), 0.0))
            if count > DELAY + FADING:
                found.append(cycle)
            grown = abs(deviation) > GROWN and len(found) > SHORTEST
            if grown or peak > largest:
                return _rate(found)
    return _rate(found)


def _rate(cycles: list[Cycle]) -> Rate | None:
    return rate_of(cycles) if cycles else None


class Hold:
    """State of a hold between two cycles."""

    def __init__(
        self,
        sine: Sine,
        table: TableState,
        stabiliser: Control,
        largest: float,
        parameters: SineParameters,
        accuracy: SensorAccuracy,
    ) -> None:
        self.sine, self.stabiliser = sine, stabiliser
        self._table, self._parameters = table, parameters
        patience = MODEL_FREE_PATIENCE if isinstance(stabiliser, IdentifyingStabiliser) else PATIENCE
        self.monitor = HoldMonitor(sine.omega, parameters.hold_authority, patience, largest, table.answer)
        tolerances = (parameters.amplitude_tolerance, parameters.phase_tolerance, parameters.distortion_tolerance)
        self._control = SineControl(parameters.harmonics, Tolerance(*(AIM * each for each in tolerances)))
        jitter = sine.omega * accuracy.laser_timing
        self._detector = SteadyDetector(parameters.settle_tolerance, JUDGED, LASERS, jitter)
        self._wanted = collected(parameters.measured_cycles)
        self._controls: deque[complex] = deque([0j] * (DELAY + 1), maxlen=DELAY + 1)
        self._used: deque[tuple[Cycle, float]] = deque(maxlen=self._wanted)
        self._since = 0
        self._updates = 0
        self.shares = table.shares
        self.recent: deque[Cycle] = deque(maxlen=WINDOW)
        self.last = (nan, nan, nan)

    @property
    def command(self) -> tuple[complex, ...]:
        """Harmonics of the drive as shares of the commanded amplitude, including the latest control."""
        first, *others = self.shares
        return (first + self._controls[-1] / self._table.answer, *others)

    def push(self, cycle: Cycle | None) -> str | None:
        """Compute the next control from a cycle, or from None if the cycle was lost; returns the reason to release the
        hold, if any.
        """
        y = None if cycle is None else observed(cycle, self._table.turn)
        self._controls.append(self.stabiliser.next(y))
        control = self._controls[0]
        if cycle is None:
            self.last = (nan, nan, abs(control))
            return self.monitor.missed()
        drift = float(cycle.extreme[DRIFT])
        self.last = (drift, self.stabiliser.deviation, abs(control))
        self.recent.append(cycle)
        reason = self.monitor.push(control, drift, *self.sine.fundamentals(cycle, self._table.turn))
        if reason is None and self.monitor.captured_after is not None:
            reason = self._settle(cycle, abs(control))
        return reason

    def _settle(self, cycle: Cycle, control: float) -> str | None:
        """Correct the table until its motion is a sine, then collect cycles; returns the reason to release, if any."""
        longest = self.monitor.patience + PATIENCE
        if self.monitor.cycles > longest:
            return f"the held motion was not steady within {longest} cycles"
        self._since += 1
        if self._since <= TRANSIENT:
            return None
        self._used.append((cycle, control))
        self._detector.push(cycle)
        if self._since == INTERVAL and self._updates < UPDATES:
            response = SineResponse.of([each for each, _ in self._used], self.sine, self._table.turn)
            shares = self._control.next(response)
            if shares is not None:
                self.shares = shares
                self._updates += 1
                self._since = -DELAY
                self._used.clear()
                self._detector.restart()
        return None

    @property
    def used(self) -> list[Cycle]:
        """The measured cycles."""
        return [cycle for cycle, _ in self._used][-self._parameters.measured_cycles :]

    def measured(self) -> Held | None:
        """The held motion; None until the table's motion is a sine and enough cycles are steady."""
        if len(self._used) < self._wanted:
            return None
        if not self._detector.judge(allowance=2.0).steady:
            return None
        used = self.used
        table = SineResponse.of(used, self.sine, self._table.turn)
        controls = np.array([control for _, control in self._used])[-self._parameters.measured_cycles :]
        return Held(
            peak=steady_peak(used, self.sine.omega),
            amplitude_error=table.amplitude_error,
            phase_error=table.phase_error,
            updates=self._updates,
            control=sqrt(float(np.mean(controls**2))),
            captured=self.monitor.captured_after,
            cycles=self.monitor.cycles,
            model_free=isinstance(self.stabiliser, IdentifyingStabiliser),
        )
