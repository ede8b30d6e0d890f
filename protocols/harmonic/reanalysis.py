"""Every point of a recorded harmonic campaign anew: other cycles, harmonics, peaks, accuracies, another specimen."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle, CycleAnalyser, mean_amplitude
from bench.analysis.gain import SteadyPeak, modulated_peak, steady_peak
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.analysis.steady import Steadiness, SteadyDetector
from bench.config.model import BenchConfiguration
from bench.control.answer import Answer, Sine
from bench.control.calibration import DriveCalibration
from bench.engine.steps import Arm, Calibrate, Dwell, Follow, Measured, Outcome, Say, Step, Trim
from bench.events import Acquired, Estimate, Event, PointFinished
from bench.prediction.model_uncertainty import expanded_uncertainty
from protocols.harmonic.judge import judge
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, HarmonicSettings, PointStatus
from protocols.harmonic.settle import JUDGED, KIN, LEFT, TURNING, Settled
from sim.gain import predict_gain


@dataclass
class _Series:
    """The dwells at one frequency between two changes of it. `recent` are the cycles since the drive last changed."""

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


class HarmonicFollower:
    """A `bench.replaying.analysis.Follower` of the lab sheet."""

    def __init__(
        self,
        settings: HarmonicSettings,
        parameters: HarmonicParameters,
        configuration: BenchConfiguration,
        sample_rate: float,
    ) -> None:
        self._settings, self._parameters, self._configuration = settings, parameters, configuration
        self._rate = sample_rate
        self._cycles = settings.measured_cycles or parameters.measured_cycles
        self._tolerance = settings.settle_tolerance or parameters.settle_tolerance
        self._calibration = DriveCalibration.flat(1.0)
        self._read = 0
        self._last: Follow | None = None
        self._series: _Series | None = None
        self._dwelling = False
        self._tries: list[_Series] = []
        self._bare: dict[float, Settled] = {}
        self._points: list[HarmonicPoint] = []

    @property
    def points(self) -> Sequence[HarmonicPoint]:
        """The results so far."""
        return self._points

    def before(self, step: Step) -> None:
        """Begin a series where a dwell begins one."""
        match step:
            case Arm() | Follow():
                self._end_series()
                self._last = step if isinstance(step, Follow) else None
            case Calibrate():
                self._calibration = step.calibration
            case Dwell() if self._last is not None:
                if self._series is None:
                    leg = self._last.legs[-1]
                    sine = Sine(leg.omega, leg.amplitude, self._calibration)
                    analyser = CycleAnalyser(leg.omega, self._rate, self._read, self._settings.harmonics)
                    self._series = _Series(sine, analyser)
                self._dwelling = True
            case _:
                pass

    def after(self, step: Step, outcome: Outcome) -> None:
        """Take note of what came of a step."""
        series = self._series
        match step:
            case Dwell() if series is not None:
                self._dwelling = False
                series.waited += step.cycles * tau / series.sine.omega
                series.measured = outcome.cycles if isinstance(outcome, Measured) else ()
            case Trim() if series is not None:
                series.updates += 1
                series.recent.clear()
                series.trimmed = True
            case Say(event=Estimate(beta=beta)) if series is not None:
                series.tested, series.beta = True, beta
            case Say(event=PointFinished(point=HarmonicPoint() as point)):
                self._end_series()
                self._points.append(self._again(point))
                self._tries.clear()
            case _:
                pass

    def __call__(self, event: Event) -> None:
        """Fit the cycles of a dwell as they come."""
        if not isinstance(event, Acquired):
            return
        self._read = event.block.first + len(event.block)
        if not self._dwelling or (series := self._series) is None:
            return
        cycles = series.analyser.push(np.column_stack((event.signals[:, : len(SIGNALS)], event.drive)))
        if series.turn is None and cycles:
            series.turn = series.sine.turn(cycles[0])
        series.recent += cycles

    def _end_series(self) -> None:
        series, self._series = self._series, None
        if series is None or not series.tested or not series.measured:
            return
        if series.beta is None:
            self._bare[series.sine.omega] = self._settled(series)
        else:
            self._tries.append(series)

    def _again(self, point: HarmonicPoint) -> HarmonicPoint:
        omega = point.omega_rad_s
        specimen = self._configuration.known_specimen.coupled(point.beta)
        known = self._configuration.known_on_table
        bare = self._bare[omega]
        if point.status is PointStatus.OVERTURNED:
            asked = self._parameters.amplitude_factor * self._configuration.known_specimen.uplift_acceleration
            layer = predict_gain(specimen, omega, asked, bare.peak.amplitude).rocking
            return point.model_copy(
                update={
                    "layer": "rocking" if layer else "none",
                    "alpha_2_predicted": layer.alpha_2 if layer else None,
                    "alpha_2_predicted_uncertainty": expanded_uncertainty(layer, known) if layer else None,
                    "predicted_stable": layer.stable if layer else None,
                    "bare_drift_peak_m": bare.peak.drift,
                    "bare_amplitude_m_s2": bare.peak.amplitude,
                }
            )
        settled = self._settled(min(self._tries, key=lambda series: self._unlike(series, point)))
        found = judge(settled, bare, omega, specimen, known, self._configuration.sensors, point.starts_tried)
        return found.model_copy(update={"start_chance": point.start_chance})

    def _unlike(self, series: _Series, point: HarmonicPoint) -> float:
        """How far the dwell is from the one that the point was made of: of several that stood, one was taken."""
        used = series.measured[-self._parameters.measured_cycles :]
        return abs(mean_amplitude(used, ACCELERATION) - (point.amplitude_m_s2 or 0.0))

    def _settled(self, series: _Series) -> Settled:
        omega = series.sine.omega
        jitter = omega * self._configuration.analysis.laser_timing
        detector = SteadyDetector(self._tolerance, JUDGED, KIN, jitter)
        for cycle in series.recent:
            detector.push(cycle)
        steadiness = detector.judge(allowance=2.0)
        # the first cycles after a change of the drive are on their way to it
        still = series.recent[TURNING:] if series.trimmed else series.recent
        used = still[-self._cycles :]
        table = Answer.of(used, series.sine, series.turn or 1.0 + 0.0j)
        return Settled(
            self._peak(used, omega, steadiness),
            steadiness,
            series.waited,
            table.amplitude_error,
            table.phase_error,
            series.updates,
        )

    def _peak(self, used: Sequence[Cycle], omega: float, steadiness: Steadiness) -> SteadyPeak:
        how = self._settings.peak
        if how == "mean" or (how == "judged" and steadiness.steady):
            return steady_peak(used, omega, LEFT * self._tolerance)
        return modulated_peak(used, omega)
