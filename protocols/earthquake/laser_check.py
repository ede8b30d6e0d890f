"""Check of the lasers before the records: a slow sine of the bare frame, whose readings would have no harmonics if the
lasers were linear.

Under a record, the readings alone do not tell the shape of a laser's linearity error, so that the most unfavourable
number of waves within the measuring range is assumed. The harmonics under a sine tell which numbers are possible, and
the readings are corrected for the expected error (`bench.analysis.reading_correction`). Between the modes of the frame,
a table motion of a few centimetres moves the second storey as far as a strong record does.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt, tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.analysis.cycles import CycleAnalyser
from bench.analysis.error_curve import Checks
from bench.analysis.gain import steady_peak
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.sensor_uncertainty import LINEARITY
from bench.analysis.table_motion import table_motion
from bench.analysis.uncertainty import COVERAGE
from bench.config.model import BenchConfiguration
from bench.control.preparation import PreparedMotion
from bench.control.target import REST, Reach, Target, windowed
from bench.events import Event, event
from protocols.common.sine.settling import linear_frame
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import Shaking, band_used
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

Array = NDArray[np.float64]

NAME = "laser check"

ABOVE = 1.25
"""Frequency of the sine, relative to the frame's first mode: far enough from the resonance for its amplitude to be
known, near enough for a small table motion."""

INSIDE = 1.15
"""Smallest ratio of the frequency to the lower end of the band, and of the upper end to the frequency."""

SHARE = 0.7
"""Largest share of the limits on drift and readings that the sine uses, since stiffness and friction change its
amplitude."""

RAMP, SETTLING = 12.0, 15.0
"""Durations of each ramp, and of the wait for the free vibration to decay [s]. After ramps of 8 s the free
vibration, whose decay has harmonics of its own, would be 2.5 times as large.
"""

MEASURED, FEWEST = 30, 12
"""Number of evaluated cycles, and smallest number of them without missing samples."""

MOSTLY = sqrt(0.5)
"""Smallest share of the uncertainty of alpha_2 for which the linearity of the lasers is said to dominate it: half of
the variance.
"""

STEP = 0.005
"""Sample interval of the motion whose demands are simulated [s]."""


@event(notice="lasers")
class LasersChecked(Event):
    """Result of the check of the lasers: span of each laser's readings in the check, and the largest `corrections`
    within it [m], zero for calibrated lasers.
    """

    swings: tuple[float, float]
    corrections: tuple[float, float]

    @staticmethod
    def of(correction: ReadingCorrection) -> "LasersChecked":
        """The result of the check that the `correction` evaluates."""
        ((first, second),) = correction.sensors.checks
        largest = [float(np.abs(correction.expected(k, each.readings)).max()) for k, each in enumerate((first, second))]
        return LasersChecked((first.swing, second.swing), (largest[0], largest[1]))

    @property
    def line(self) -> str:
        spans, largest = (
            " and ".join(f"{1e3 * each:.3g}" for each in pair) for pair in (self.swings, self.corrections)
        )
        found = f"corrected by up to {largest} mm there" if any(self.corrections) else "not corrected"
        return f"lasers checked over {spans} mm; their readings are {found}"


@dataclass(frozen=True, eq=False)
class LaserCheck:
    """A sine of the bare frame at `omega` [rad/s] with the acceleration `amplitude` [m/s2], as a motion of the
    table."""

    omega: float
    amplitude: float
    shaking: Shaking

    @property
    def first(self) -> int:
        """Index of the first evaluated sample from the start of the drive."""
        target = self.shaking.target
        return target.rest + round((RAMP + SETTLING) * target.sample_rate)

    def evaluate(self, signals: Array, configuration: BenchConfiguration) -> Checks:
        """Harmonics of both lasers, from the signals of the played sine, shape (n, len(SIGNALS)). Raises InvalidInput
        if too many samples are missing.
        """
        rate = self.shaking.target.sample_rate
        last = self.first + round((MEASURED + 0.5) * tau / self.omega * rate)
        cycles = CycleAnalyser(self.omega, rate, self.first).push(signals[self.first : last])
        if len(cycles) < FEWEST:
            raise InvalidInput(NAME, f"{len(cycles)} cycles", f"at least {FEWEST} without missing samples are required")
        found = steady_peak(cycles, self.omega, frame=linear_frame(configuration)).checks
        assert found is not None
        return found


def advice(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, points: Sequence[Mapping[str, Any]]
) -> str:
    """Sentence that recommends the check; empty if it was requested, if the errors of the lasers are found in the
    motion or calibrated, or if their linearity does not dominate the uncertainty of alpha_2 at any of the `points`,
    which have the fields of the results.
    """
    if parameters.laser_check or parameters.laser_block or configuration.calibrated is not None:
        return ""
    measured = [row for row in points if row["alpha_2_uncertainty"] and row.get("uncertainty_parts")]
    number = sum(
        COVERAGE * json.loads(row["uncertainty_parts"]).get(LINEARITY, 0.0) > MOSTLY * row["alpha_2_uncertainty"]
        for row in measured
    )
    if number == 0:
        return ""
    return (
        f"The linearity of the lasers dominates {number} of {len(measured)} uncertainties of the measured alpha_2: "
        "without a laser calibration, --laser-check measures it before the records, which takes one and a half minutes "
        "and usually reduces these uncertainties to a tenth."
    )


def laser_check(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> LaserCheck | None:
    """The check of a campaign; None if it is not requested. Raises InvalidInput if the band has no frequency for it."""
    if not parameters.laser_check:
        return None
    band = band_used(parameters, configuration)
    omega = max(ABOVE * min(configuration.known_specimen.frame.natural_frequencies), INSIDE * tau * band[0])
    if omega > tau * band[1] / INSIDE:
        allowed = f"a check of the lasers needs {omega / tau:.3g} Hz: choose a wider band, or omit --laser-check"
        raise InvalidInput("--table-band", f"{band[0]:g}:{band[1]:g}", allowed)
    amplitude = _amplitude(omega, parameters, configuration)
    return LaserCheck(omega, amplitude, _shaking(omega, amplitude, band, configuration.sample_rate))


def _amplitude(omega: float, parameters: EarthquakeParameters, configuration: BenchConfiguration) -> float:
    """Acceleration [m/s2] at which drift, readings or table reach their share of the limits, at most that of the
    records."""
    limits, reach = configuration.limits, Reach.of(configuration)
    first, second = linear_frame(configuration).readings(omega, 1.0)
    bounds = [
        parameters.peak_factor * configuration.known_specimen.uplift_acceleration,
        SHARE * limits.drift / abs(second - first),
        SHARE * reach.displacement * omega**2,
        SHARE * reach.velocity * omega,
    ]
    ranges = zip(configuration.laser_half_ranges, (first, second), strict=True)
    return min(*bounds, *(SHARE * limits.laser_range * half / abs(reading) for half, reading in ranges))


def _shaking(omega: float, amplitude: float, band: tuple[float, float], sample_rate: float) -> Shaking:
    rest = round(REST / band[0] * sample_rate)
    acceleration = _sine(omega, amplitude, rest, sample_rate)
    wave = windowed(acceleration, 1.0 / sample_rate, band)
    every = max(round(STEP * sample_rate), 1)
    dt = every / sample_rate
    coarse = wave[::every]
    prepared = PreparedMotion(
        record=SampledRecord(coarse, dt),
        begin=0.0,
        time_ratio=1.0,
        band=band,
        factor=1.0,
        peak_before=amplitude,
        peak=float(np.abs(wave).max()),
        motion=table_motion(coarse, dt),
        reach=None,
        fit=None,
        steps=(f"sine of {omega:.4g} rad/s and {amplitude:.3g} m/s2",),
    )
    source = Accelerogram(NAME, coarse, dt, "computed", "none", "m/s2", "", {}, synthetic=True)
    return Shaking(source, 0.0, prepared, Target(wave, sample_rate, band, rest))


def _sine(omega: float, amplitude: float, rest: int, sample_rate: float) -> Array:
    """Samples of the sine between smooth ramps, with `rest` zeros at each end."""
    held = SETTLING + (MEASURED + 1) * tau / omega
    time = np.arange(round((2.0 * RAMP + held) * sample_rate)) / sample_rate
    rise = np.clip(np.minimum(time, time[-1] - time) / RAMP, 0.0, 1.0)
    wave = amplitude * 0.5 * (1.0 - np.cos(np.pi * rise)) * np.sin(omega * time)
    return np.concatenate((np.zeros(rest), wave, np.zeros(rest)))
