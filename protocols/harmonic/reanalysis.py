"""Re-analysis of a recorded harmonic campaign with different cycles, harmonics, peaks, accuracies or specimen."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.free_motion import CYCLES, KEPT, Rate, free_motion, orbit_peak
from bench.analysis.gain import SteadyPeak, steady_peak
from bench.analysis.signals import SIGNALS
from bench.analysis.steady import SteadyDetector
from bench.analysis.unsteady_peaks import unsteady_peaks
from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration
from bench.control.sine import Sine, SineResponse
from bench.datafile.reader import DataFile
from bench.engine.steps import Arm, Calibrate, Dwell, Measured, Outcome, Publish, SetHarmonics, Step, Sweep
from bench.events import Acquired, Event, PointFinished, StepStarted
from bench.live_values import Estimate
from bench.replay.session import stored_configuration
from protocols.common.sine.holding import collected
from protocols.common.sine.settling import (
    JUDGED,
    LASERS,
    TRANSIENT,
    Held,
    Settled,
    checked,
    linear_frame,
    preceding,
)
from protocols.harmonic.conditions import ROCKING, Conditions, predicted_fields
from protocols.harmonic.free_prediction import with_free_prediction
from protocols.harmonic.judgement import judge
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, HarmonicSettings, PointStatus
from sim.gain import predict_gain


@dataclass
class _Series:
    """Consecutive dwells at one frequency. `recent` are the cycles since the last change of the drive; in a `hold`,
    which changes the drive in every cycle, they are all cycles until the hold is `released`. `held` is the series of
    the hold that follows.
    """

    sine: Sine
    analyser: CycleAnalyser
    beta: float | None = None
    tested: bool = False
    waited: float = 0.0
    updates: int = 0
    turn: complex | None = None
    recent: list[Cycle] = field(default_factory=list[Cycle])
    trimmed: bool = False
    measured: tuple[Cycle, ...] = ()
    hold: bool = False
    released: bool = False
    held: "_Series | None" = None


class HarmonicFollower:
    """Recomputes the points of a harmonic campaign from its recorded steps; a `bench.protocol.Follower`."""

    def __init__(
        self,
        settings: HarmonicSettings,
        parameters: HarmonicParameters,
        configuration: BenchConfiguration,
        record: DataFile,
    ) -> None:
        self._settings, self._parameters, self._configuration = settings, parameters, configuration
        self._rate = record.sample_rate
        self._cycles = settings.measured_cycles or parameters.measured_cycles
        self._tolerance = settings.settle_tolerance or parameters.settle_tolerance
        # the table was driven for the recorded specimen
        recorded = stored_configuration(record).known_specimen
        self._amplitude = parameters.amplitude_factor * recorded.uplift_acceleration
        self._calibration = DriveCalibration.flat(1.0)
        self._read = 0
        self._last: Sweep | None = None
        self._series: _Series | None = None
        self._dwelling = False
        self._tries: list[_Series] = []
        self._bare: dict[float, Settled] = {}
        self._points: list[HarmonicPoint] = []

    @property
    def points(self) -> Sequence[HarmonicPoint]:
        return self._points

    def before(self, step: Step) -> None:
        """Start a series at its first dwell or at the start of a hold, and end it at the next sweep or arming."""
        match step:
            case Arm() | Sweep():
                self._end_series(self._series)
                self._last = step if isinstance(step, Sweep) else None
            case Calibrate():
                self._calibration = step.calibration
            case Dwell() if self._last is not None:
                if step.phase is not None or self._series is None:
                    free = self._series
                    segment = self._last.segments[-1]
                    sine = Sine(segment.omega, segment.amplitude, self._calibration)
                    analyser = CycleAnalyser(segment.omega, self._rate, self._read, self._settings.harmonics)
                    self._series = _Series(sine, analyser)
                    if free is not None:
                        self._end_series(free)
                        self._series.hold, self._series.turn = True, free.turn
                        # a second start for a hold without a model is not a test of its own
                        held_after = free if free.tested or not self._tries else self._tries[-1]
                        held_after.held = self._series
                self._dwelling = True
            case _:
                pass

    def after(self, step: Step, outcome: Outcome) -> None:
        """Record the outcome of a step."""
        series = self._series
        match step:
            case Dwell() if series is not None:
                self._dwelling = False
                series.waited += step.cycles * tau / series.sine.omega
                series.measured = outcome.cycles if isinstance(outcome, Measured) else ()
            case SetHarmonics() if series is not None and not series.hold:
                series.updates += 1
                series.recent.clear()
                series.trimmed = True
            case Publish(event=StepStarted()) if series is not None:
                series.released = True
            case Publish(event=Estimate(beta=beta)) if series is not None:
                series.tested, series.beta = True, beta
            case Publish(event=PointFinished(point=HarmonicPoint() as point)):
                self._end_series(self._series)
                self._points.append(self._recomputed(point))
                self._tries.clear()
            case _:
                pass

    def __call__(self, event: Event) -> None:
        """Fit the cycles of a dwell as its blocks arrive."""
        if not isinstance(event, Acquired):
            return
        self._read = event.block.first + len(event.block)
        if not self._dwelling or (series := self._series) is None or (series.hold and series.released):
            return
        cycles = series.analyser.push(np.column_stack((event.signals[:, : len(SIGNALS)], event.drive)))
        if series.turn is None and cycles:
            series.turn = series.sine.turn(cycles[0])
        series.recent += cycles

    def _end_series(self, series: _Series | None) -> None:
        if series is self._series:
            self._series = None
        if series is None or series.hold or not series.tested or not series.measured:
            return
        if series.beta is None:
            self._bare[series.sine.omega] = self._settled(series)
        else:
            self._tries.append(series)

    def _recomputed(self, point: HarmonicPoint) -> HarmonicPoint:
        omega = point.omega_rad_s
        specimen = self._configuration.known_specimen.coupled(point.beta)
        bare = self._bare[omega]
        if point.status is PointStatus.OVERTURNED:
            asked = self._amplitude
            branch = predict_gain(specimen, omega, asked, bare.peak.amplitude).rocking
            predicted = predicted_fields(ROCKING, branch, self._configuration.known_on_table)
            peaks = {"bare_drift_peak_m": bare.peak.drift, "bare_amplitude_m_s2": bare.peak.amplitude}
            return point.model_copy(update=predicted | peaks)
        sensors = checked(self._configuration.sensors, self._bare.values())
        tried = self._tried(point)
        settled = self._settled(tried)
        held = None if tried.held is None else self._held(tried.held, point)
        conditions = Conditions.of(omega, specimen, bare, sensors, self._configuration, self._parameters)
        found = judge(settled, conditions, point.starts_tried, held)
        found = with_free_prediction(found, specimen, self._amplitude, self._configuration, self._parameters.harmonics)
        return found.model_copy(update={"start_chance": point.start_chance})

    def _tried(self, point: HarmonicPoint) -> _Series:
        """The dwell of a point among those without a fall, by the rule of the plan: the last one ended the tries, or
        all starts were tried and the first one is reported.
        """
        ended = point.status in (PointStatus.STEADY, PointStatus.HELD) or not point.predicted_stable
        return self._tries[-1 if ended else 0]

    def _held(self, series: _Series, point: HarmonicPoint) -> Held:
        """The hold of a point, evaluated from its last cycles, with control and capture as recorded."""
        if point.status is not PointStatus.HELD:
            return Held(None, "as recorded", cycles=len(series.recent))
        # earlier cycles may be from before the capture or the last correction of the table
        certain = collected(self._parameters.measured_cycles)
        omega, used = series.sine.omega, series.recent[-min(self._cycles, certain) :]
        table = SineResponse.of(used, series.sine, series.turn or 1.0 + 0.0j)
        return Held(
            peak=self._largest(used, omega) if self._settings.peak == "largest" else steady_peak(used, omega),
            amplitude_error=table.amplitude_error,
            phase_error=table.phase_error,
            control=point.control_share or 0.0,
            captured=point.captured_cycles,
            model_free=point.model_free or False,
            cycles=len(series.recent),
            rate=_rate(point),
        )

    def _settled(self, series: _Series) -> Settled:
        omega = series.sine.omega
        accuracy = self._configuration.analysis
        jitter = omega * accuracy.laser_timing
        detector = SteadyDetector(self._tolerance, JUDGED, LASERS, jitter)
        for cycle in series.recent:
            detector.push(cycle)
        steadiness = detector.judge(allowance=2.0)
        # the first cycles after a correction of the drive are transient
        constant = series.recent[TRANSIENT:] if series.trimmed else series.recent
        used = constant[-self._cycles :]
        table = SineResponse.of(used, series.sine, series.turn or 1.0 + 0.0j)
        how = self._settings.peak
        mean = how == "mean" or (how == "judged" and steadiness.steady)
        if not steadiness.steady and self._settings.measured_cycles is None:
            used = constant[-CYCLES:]
        motion = None if steadiness.steady else free_motion(constant[-KEPT:], omega, accuracy)
        frame = linear_frame(self._configuration) if series.beta is None else None
        before = preceding(constant, used) if steadiness.steady else ()
        return Settled(
            steady_peak(used, omega, before=before, frame=frame) if mean else self._largest(used, omega),
            steadiness,
            series.waited,
            table.amplitude_error,
            table.phase_error,
            series.updates,
            motion,
            None if motion is None else orbit_peak(constant, motion, omega),
        )

    def _largest(self, cycles: Sequence[Cycle], omega: float) -> SteadyPeak:
        return unsteady_peaks(cycles, omega, self._configuration.analysis).greatest


def _rate(point: HarmonicPoint) -> Rate | None:
    """The recorded multiplier of a point; None if it has none."""
    modulus, uncertainty, angle = point.multiplier, point.multiplier_uncertainty, point.multiplier_angle_rad
    if modulus is None or uncertainty is None or angle is None:
        return None
    return Rate(modulus, 0.5 * uncertainty, angle)
