"""Computation of the live twin in one run, without threads: estimates and residuals from blocks of samples."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, nan
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.transient_base import MODEL_RATE
from bench.config.model import BenchConfiguration
from bench.live_values import TwinEstimate
from bench.twin.ensemble import Ensemble, Gains, Measured, Members
from sim.errors import RockbenchError

_PIPELINE = 3
"""Delay from exposure to output of an optoNCDT 1420, in measurement periods; the output begins up to one period later
(manual, p. 52).
"""
_HELD = 0.5
"""Mean age of the output value, which is held until the next measurement, in measurement periods."""


def laser_lag(configuration: BenchConfiguration) -> tuple[float, float]:
    """Delays of the lasers relative to the table's accelerometer and relative to its displacement sensor [s].

    `twin.laser_lag`, if configured, applies to both. Otherwise the delays are zero for serial lasers, whose values are
    already aligned to the sample clock, and are assumed zero for backends of other packages.
    """
    if (told := configuration.twin.laser_lag) is not None:
        return told, told
    if configuration.backend == "simulated":
        laser = configuration.simulation.bench.laser_1
        lag = (laser.latency + _HELD) / laser.rate
        # the simulated accelerometer averages over the preceding sample interval
        return lag - 0.5 / configuration.sample_rate, lag
    lasers = configuration.hardware.lasers
    placed = configuration.backend != "hardware" or lasers.connection == "serial"
    lag = 0.0 if placed else (_PIPELINE + _HELD) / lasers.rate
    return lag, lag


Array = NDArray[np.float64]

_CUTOFF = 0.35
"""Middle of the transition band, as a fraction of the model's rate. The signals are assumed to be limited to
frequencies far below it by the filter cards.
"""
_HALF_WIDTH = 6
"""Half the length of the filter's impulse response [samples of the model]."""
_KAISER = 5.65
"""Parameter beta of the Kaiser window (Kaiser, 1974) for a stop-band attenuation of 60 dB. With a length of twice
`_HALF_WIDTH`, the width of the transition band is 0.3 times the model's rate.
"""


class Resampler:
    """Linear-phase low-pass filter for signals in blocks; the output does not depend on the division into blocks.

    Delays every signal by `latency` [s], and signal i by a further `delays[i]` [s] (0 or more) with interpolation
    between samples. Outputs a sample every `dt` [s]. The input before the first block is taken as zero.
    """

    def __init__(self, sample_rate: float, delays: Sequence[float]) -> None:
        self.every = max(round(sample_rate / MODEL_RATE), 1)
        self.dt = self.every / sample_rate
        half = _HALF_WIDTH * self.every
        self.latency = half / sample_rate
        late = np.array(delays) * sample_rate
        length = 2 * half + 1 + ceil(float(late.max()))
        # the weights are in the order of the samples, that of the newest sample last
        places = (np.arange(length)[::-1] - half - late[:, None]) / self.every
        window = np.i0(_KAISER * np.sqrt(np.maximum(1.0 - (places / _HALF_WIDTH) ** 2, 0.0)))
        taps = np.sinc(2.0 * _CUTOFF * places) * np.where(np.abs(places) <= _HALF_WIDTH, window, 0.0)
        self._taps = taps / taps.sum(axis=1, keepdims=True)
        self._kept = np.zeros((length - 1, len(late)))
        self._skip = 0

    def push(self, block: Array) -> tuple[Array, int]:
        """Resample a block, shape (n, n_signals).

        Returns samples, shape (m, n_signals), NaN where an input within the filter's length is missing, and the number
        of input samples of the block that are newer than the last output sample.
        """
        line = np.concatenate((self._kept, block))
        chosen = sliding_window_view(line, self._taps.shape[1], axis=0)[self._skip :: self.every]
        self._kept = line[len(block) :]
        self._skip = (self._skip - len(block)) % self.every
        return np.einsum("nct,ct->nc", chosen, self._taps), self.every - 1 - self._skip


SPAN = 1.0
"""Length of the window over which a residual is evaluated [s]."""


class Residual:
    """Root mean squares of the model's error over the last `SPAN`, relative to the largest rms of the measured drift so
    far.

    This reference is at least `least` [m], because differences below the errors of the sensors are not significant.
    """

    def __init__(self, dt: float, least: float) -> None:
        self._span, self._least = round(SPAN / dt), least
        self._sums: deque[tuple[int, int, Array]] = deque()
        self._largest = 0.0

    def push(self, measured: Array, model: Array, low: Array, high: Array) -> tuple[float, float]:
        """Add drifts [m], shape (n,): measured, modelled, and the bounds of the model's band.

        Returns the relative rms of measured minus modelled drift, and of the measured drift's excess over the band; NaN
        until the window is full, and while half of its values or more are missing.
        """
        parts = np.stack((measured, measured - model, np.maximum(np.maximum(measured - high, low - measured), 0.0)))
        known = np.isfinite(parts).all(axis=0)
        squares = np.square(parts[:, known]).sum(axis=1)
        self._sums.append((measured.size, int(np.count_nonzero(known)), squares))
        total = sum(size for size, *_ in self._sums)
        while total - self._sums[0][0] >= self._span:
            total -= self._sums.popleft()[0]
        seen = sum(n for _, n, _ in self._sums)
        if total < self._span or 2 * seen <= total:
            return nan, nan
        rms = np.sqrt(np.sum([part for *_, part in self._sums], axis=0) / seen)
        self._largest = max(self._largest, float(rms[0]))
        scale = max(self._largest, self._least)
        return float(rms[1]) / scale, float(rms[2]) / scale


class Limit:
    """Limit that trips as soon as a value has exceeded it for `persistence` [s], and only once."""

    def __init__(self, limit: float | None, persistence: float) -> None:
        self.limit = limit
        self._persistence = persistence
        self._since: float | None = None
        self._counted = False

    def exceeded(self, value: float, seconds: float) -> bool:
        """Whether `value` at the time `seconds` [s] trips the limit; NaN counts as within the limit."""
        if self.limit is None or not value > self.limit:
            self._since = None
            return False
        self._since = seconds if self._since is None else self._since
        if self._counted or seconds - self._since < self._persistence:
            return False
        self._counted = True
        return True


_TRACE = 0.01
"""Interval between the rows of an estimate's trace [s]."""


@dataclass(frozen=True)
class Setting:
    """Sample rate and sensors of the bench.

    `on_ground`: the lasers' signals include the table's displacement. `lag` contains the delays of the lasers relative
    to the table's accelerometer and displacement sensor [s], `sensors` the uncertainty of the sensors.
    """

    sample_rate: float
    on_ground: bool
    lag: tuple[float, float]
    sensors: SensorUncertainty


class NoEstimate(RockbenchError):
    """Error raised if samples of the table's acceleration are missing, so that the model cannot continue."""

    error_code = "no_estimate"


class Estimator:
    """Computes estimates from consecutive blocks; the bench must be at rest at the first sample."""

    def __init__(self, run: int, setting: Setting, members: Members) -> None:
        self._run, self._setting = run, setting
        # delay the table's signals by the lag of the lasers, or the lasers' signals if the lag is negative
        lasers = max(0.0, *(-lag for lag in setting.lag))
        self._resampler = Resampler(setting.sample_rate, (*(lasers + lag for lag in setting.lag), lasers, lasers))
        dt = self._resampler.dt
        self._latency = self._resampler.latency + lasers
        self._ensemble, self._gains = Ensemble(members, dt), Gains(members, dt)
        accuracy, ranges = setting.sensors.accuracy, setting.sensors.ranges
        # differences below the errors of a data sheet are not significant, even if a calibration has found the errors
        self._residual = Residual(dt, float(np.hypot(*ranges)) * accuracy.laser_linearity)
        self._uncertainties, self._of_peak = np.zeros(3), 0.0
        self._peaks = np.zeros(len(members.specimens))
        self._measured_peak = 0.0
        self._every, self._skip = max(round(_TRACE / dt), 1), 0

    @property
    def members(self) -> int:
        """Number of members, excluding the nominal one."""
        return len(self._ensemble) - 1

    def shed(self) -> None:
        """Drop half of the members, which narrows their band."""
        self._ensemble.keep(1 + self.members // 2)

    def take(self, time: float, end: int, signals: Array, measured: Measured | None) -> TwinEstimate | None:
        """Return the estimate at the end of a block, or None if the block is too short for a sample of the model.

        `time` is the time at which the block was read, and `end` the index, counted in the run, of the sample after the
        block. `signals` are the signals of the block in SI units, shape (n, n_signals). Raises NoEstimate if samples of
        the table's acceleration are missing.
        """
        setting = self._setting
        samples, newer = self._resampler.push(signals[:, [ACCELERATION, DISPLACEMENT, LASER_1, LASER_2]])
        if not np.isfinite(samples[:, 0]).all():
            raise NoEstimate("samples of the table's acceleration are missing")
        if not len(samples):
            return None
        acceleration, x, first, second = np.ascontiguousarray(samples.T)
        one, two = (setting.sensors.linearity_amplitude(k, seen) for k, seen in enumerate((first, second)))
        self._uncertainties = np.array([one, two, np.hypot(one, two)])
        self._of_peak = max(self._of_peak, float(self._uncertainties[2]))
        u1 = first - x if setting.on_ground else first
        seen = np.stack((u1, u1 + second - first, second - first))
        motions = self._ensemble.feed(acceleration)
        u = np.stack((motions[0], motions[1], motions[1] - motions[0]))
        seconds = (end - 1 - newer) / setting.sample_rate - self._latency
        return self._estimate(time, seconds, acceleration, seen, u, motions[2], measured)

    def _estimate(
        self,
        time: float,
        seconds: float,
        acceleration: Array,
        seen: Array,
        u: Array,
        theta: Array,
        measured: Measured | None,
    ) -> TwinEstimate:
        """Estimate from u1, u2 and drift [m], both measured (`seen`, shape (3, n)) and modelled (`u`, shape (3, k, n)),
        and from the modelled rotation `theta` [rad], shape (k, n); k is the number of members.
        """
        low, high = _band(u.swapaxes(0, 1), self._uncertainties[:, None])
        residual, excess = self._residual.push(seen[2], u[2, 0], low[2], high[2])
        alphas = self._gains.push(acceleration, u[2], measured)
        self._peaks = np.maximum(self._peaks[: u.shape[1]], np.abs(u[2]).max(axis=1))
        self._measured_peak = float(np.fmax.reduce(np.abs(seen[2]), initial=self._measured_peak))
        stated = np.nan if measured is None else measured.alpha_2
        values: dict[str, float] = {}
        for k, name in enumerate(("u1", "u2", "drift")):
            values |= _fields(name, u[k, 0, -1], low[k, -1], high[k, -1], seen[k, -1])
        values |= _fields("drift_peak", self._peaks[0], *_band(self._peaks, self._of_peak), self._measured_peak)
        values |= _fields("alpha_2", alphas[0], *_band(alphas, 0.0), stated)
        return TwinEstimate(
            time=time,
            run=self._run,
            seconds=seconds,
            members=self.members,
            standing=float(np.isfinite(theta[:, -1]).mean()),
            theta=float(theta[0, -1]),
            residual=residual,
            excess=excess,
            trace=self._trace(seconds, u, theta, low[2], high[2]),
            **values,
        )

    def _trace(self, seconds: float, u: Array, theta: Array, low: Array, high: Array) -> Array:
        """Rows of the trace, one every `_TRACE` [s], with the columns of `bench.live_values.TWIN_TRACE`."""
        n = low.size
        rows = np.arange(self._skip, n, self._every)
        self._skip = (self._skip - n) % self._every
        moments: Array = seconds + self._resampler.dt * (rows - (n - 1)).astype(np.float64)
        trace: Array = np.column_stack((moments, u[0, 0, rows], u[1, 0, rows], theta[0, rows], low[rows], high[rows]))
        return trace


def _band(values: Array, uncertainty: float | Array) -> tuple[Array, Array]:
    """Smallest and largest of `values` along the first axis over the members whose block is standing, widened by the
    `uncertainty` of the sensors; NaN where fewer than half of the blocks are standing.
    """
    few = 2 * np.count_nonzero(np.isfinite(values), axis=0) < len(values)
    low, high = np.fmin.reduce(values, axis=0) - uncertainty, np.fmax.reduce(values, axis=0) + uncertainty
    return np.where(few, np.nan, low), np.where(few, np.nan, high)


def _fields(name: str, model: Any, low: Any, high: Any, measured: Any) -> dict[str, float]:
    """Fields of an estimate for one quantity."""
    values = {name: model, f"{name}_low": low, f"{name}_high": high, f"{name}_measured": measured}
    return {key: float(value) for key, value in values.items()}
