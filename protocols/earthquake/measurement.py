"""Measured and predicted response to a played record: tracking, overturning, running gain and histories."""

from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.signals import ACCELERATION, DRIFT, U1, bridged
from bench.analysis.transient_base import BaseMotion
from bench.analysis.transient_peak import RunningPeak, running_peak
from bench.control.passes import SpectrumCheck
from bench.control.starts import CATCH_ANGLE
from bench.live_values import RunningGain
from protocols.earthquake.records import Shaking
from sim.rocking import simulate
from sim.specimen import Specimen

Array = NDArray[np.float64]

PERIODS = (0.1, 1.0)
"""Range of periods in which response spectra are compared [s]."""


@dataclass(frozen=True)
class Tracking:
    """Tracking errors relative to the record, within its band: rms error, and error of the response spectrum."""

    error: float
    spectrum_error: float


def tracking(shaking: Shaking, signals: Array) -> Tracking:
    """Tracking errors of `signals`, shape (n, len(SIGNALS)), which start with the record's drive and may extend beyond
    it.
    """
    target = shaking.target
    moved = _table_motion(shaking, signals)
    wanted = _windowed(shaking, target.acceleration)
    check = SpectrumCheck(wanted, target.sample_rate, PERIODS, ())
    return Tracking(_rms(moved - wanted) / _rms(wanted), check.error(moved))


def difference(shaking: Shaking, signals: Array, others: Array) -> float:
    """Rms difference between the table motions of two tests, relative to the record's rms, within its band."""
    wanted = _windowed(shaking, shaking.target.acceleration)
    return _rms(_table_motion(shaking, signals) - _table_motion(shaking, others)) / _rms(wanted)


def _table_motion(shaking: Shaking, signals: Array) -> Array:
    return _windowed(shaking, signals[: shaking.target.acceleration.size, ACCELERATION])


def _windowed(shaking: Shaking, acceleration: Array) -> Array:
    return np.fft.irfft(shaking.target.window * np.fft.rfft(acceleration), acceleration.size)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def overturning_time(signals: NDArray[np.float64], sample_rate: float, specimen: Specimen) -> float | None:
    """Time of overturning since the first of `signals` [s], shape (n, len(SIGNALS)), which end soon after the fall.

    A fallen block displaces the storey permanently. The moving mean of u1 over a period of the frame's first mode last
    crosses the threshold of `FallWatch` at about the time at which the block finally passes its critical angle. In ten
    simulated falls, the result was 0.12 s late on average, between 0.14 s early and 0.4 s late; the strap stopped the
    block 0.3 to 0.6 s after this time. None if no sample of u1 is valid.
    """
    span = min(round(2.0 * np.pi / specimen.frame.natural_frequencies[0] * sample_rate), len(signals))
    u1 = signals[:, U1]
    if not np.isfinite(u1).any():
        return None
    mean = np.convolve(bridged(u1), np.full(span, 1.0 / span), mode="same")
    # at the end the last valid mean is kept, since half the window is beyond the last sample
    mean[-(span // 2) :] = mean[-(span // 2) - 1]
    below = np.flatnonzero(np.abs(mean) <= FallWatch(specimen, sample_rate).threshold)
    return float((below[-1] + 1 if below.size else 0) / sample_rate)


TOLERANCE = 1e-8
"""Relative tolerance of simulated responses."""

STEP = 0.01
"""Time step of a predicted history [s]."""

AUDIBLE = 20.0
"""Running peak of the bare drift, in standard uncertainties of the final peak, above which a running gain is published.
"""


@dataclass(frozen=True, eq=False)
class History:
    """Predicted drift [m], shape (n,), every `STEP` seconds, up to the time of toppling."""

    drift: Array

    @staticmethod
    def of(specimen: Specimen, base: BaseMotion) -> "History":
        """History of the specimen under a motion of the table."""
        times = np.arange(0.0, base.record.duration, STEP)
        motion = simulate(
            specimen,
            base.record,
            sample_times=times,
            peaks_from=None,
            tolerance=TOLERANCE,
            overturning_angle=CATCH_ANGLE,
        )
        samples = np.empty((0, 6)) if motion.samples is None else motion.samples
        return History(samples[:, 1] - samples[:, 0])

    def padded(self, size: int) -> Array:
        """Drift [m], cut off or padded with NaN to shape (size,)."""
        return np.append(self.drift[:size], np.full(max(size - self.drift.size, 0), np.nan))


class GainMonitor:
    """Computes a `RunningGain` from each block of signals while a record is played.

    `bare` is the measured drift of the bare frame at the same samples, `noise` [m] the uncertainty of its peak, and
    `expected` are the predicted histories of the bare and the coupled frame, absent in the test of the bare frame.
    `correction` is applied to each block.
    """

    def __init__(
        self,
        record: str,
        beta: float | None,
        sample_rate: float,
        bare: Array | None = None,
        noise: float = 0.0,
        expected: tuple[History, History] | None = None,
        correction: ReadingCorrection | None = None,
    ) -> None:
        self._record, self._beta, self._rate = record, beta, sample_rate
        self._peak, self._correction = RunningPeak(), correction
        self._bare = None if bare is None else np.where((so_far := running_peak(bare)) > AUDIBLE * noise, so_far, nan)
        self._predicted = np.zeros(0) if expected is None else _running_gain(*expected)

    def __call__(self, signals: Array) -> RunningGain:
        corrected = signals if self._correction is None else self._correction(signals)
        peak = self._peak.push(corrected[:, DRIFT])
        seconds = self._peak.samples / self._rate
        bare = nan if self._bare is None else float(self._bare[min(self._peak.samples, self._bare.size) - 1])
        place = round(seconds / STEP)
        return RunningGain(
            record=self._record,
            beta=self._beta,
            seconds=seconds,
            drift_peak=peak,
            alpha_2=peak / bare,
            predicted=float(self._predicted[place]) if place < self._predicted.size and bare == bare else nan,
        )


def _running_gain(bare: History, coupled: History) -> Array:
    """Running gain at each step; NaN before the first motion and after the block has toppled."""
    size = bare.drift.size
    below = running_peak(bare.drift)
    gain = np.full(size, nan)
    # no gain after the block topples, although the earlier peak remains
    np.divide(running_peak(coupled.padded(size)), below, out=gain, where=below > 0.0)
    return np.where(np.isnan(coupled.padded(size)), nan, gain)


@dataclass(frozen=True, eq=False)
class DriftHistory:
    """Drift [m]: measured, every `Histories.interval` seconds, and predicted, every `STEP` seconds up to the time at
    which the model topples.
    """

    measured: Array
    predicted: Array


@dataclass(eq=False)
class Histories:
    """Histories for the figures of a campaign: accelerations of the table [m/s2], and drifts by record and stiffness
    ratio (None for the bare frame). `interval` is the time between measured values [s], about `STEP`.
    """

    requested: dict[str, Array] = field(default_factory=dict[str, Array])
    achieved: dict[str, Array] = field(default_factory=dict[str, Array])
    drifts: dict[tuple[str, float | None], DriftHistory] = field(
        default_factory=dict[tuple[str, float | None], DriftHistory]
    )
    interval: float = STEP

    def bare(self, shaking: Shaking, signals: Array, predicted: Array) -> None:
        every = _every(shaking)
        self.interval = every / shaking.target.sample_rate
        self.requested[shaking.name] = shaking.target.acceleration[::every]
        self.achieved[shaking.name] = signals[: shaking.target.acceleration.size : every, ACCELERATION]
        self.drifts[shaking.name, None] = DriftHistory(signals[::every, DRIFT], predicted)

    def coupled(self, shaking: Shaking, beta: float, signals: Array, predicted: Array) -> None:
        self.drifts[shaking.name, beta] = DriftHistory(signals[:: _every(shaking), DRIFT], predicted)


def _every(shaking: Shaking) -> int:
    return max(round(STEP * shaking.target.sample_rate), 1)
