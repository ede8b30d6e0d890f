"""Base motion of a transient, from both table sensors, as the input of the transient's prediction.

A displacement sensor measures the acceleration far more precisely than an accelerometer at low frequencies, and far
less precisely at high frequencies, since its noise grows with omega^2. At each frequency the spectra A_a of the
accelerometer and X of the displacement sensor are combined with weights from the densities S_a and S_x of their noise
at rest,

    A = w (-omega^2 X) + (1 - w) A_a,    w = S_a / (S_a + omega^4 S_x),

after X has been aligned with the accelerometer's delay at the frequencies where both measure the motion. The ratio of
their scales serves as a check, not a correction: calibrations determine the scales more precisely than one motion. The
remaining noise has the density S_a omega^4 S_x / (S_a + omega^4 S_x).

The output of a sensor whose noise is below its resolution is constant at rest and has an error of up to half a step in
motion. That error has the variance step^2 / 12, spread over frequencies up to the number of steps passed per second, at
most half the sample rate (Bennett, Bell Syst. Tech. J. 27, 1948); in slow motions it is concentrated at low
frequencies. It limits the weight of a sensor.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from bench.analysis.inverse_transform import real_inverse
from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

Array = NDArray[np.float64]


def noise_density(rest: Array, sample_rate: float) -> tuple[Array, Array]:
    """Frequencies [Hz] and one-sided spectral density [unit^2/Hz] of `rest`, shape (n,), without its linear trend."""
    from scipy import signal

    # `Any`: scipy's stubs do not declare the value "linear" of `detrend`
    tools: Any = signal
    frequency, power = tools.welch(rest, sample_rate, nperseg=max(rest.size // 4, 8), detrend="linear")
    return np.asarray(frequency), np.asarray(power)


MODEL_RATE = 1000.0
"""Sample rate of the model's input [1/s], of which the nearest integer fraction of the bench's sample rate is used."""

_TOP = 0.4
"""Frequency up to which the motion is retained, as a fraction of the sample rate of the model's input."""
_NOISE_BAND = (2.0, 60.0)
"""Frequencies [Hz] between which the sensors' noise is assumed white."""
_PASSING = 0.05
"""Interval [s] in which a sensor's resolution steps are counted; it is shorter than the relevant periods."""
_CLEAR = 100.0
"""Ratio of power to noise above which a sensor measures the motion."""
ALIKE = 0.02
"""Relative difference between the two sensors' scales above which one of them is assumed to be wrong and only the
accelerometer is used.
"""


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Acceleration of the table [m/s2], shape (n,), every `dt` [s]; `draw` adds random errors.

    `agreement` is the ratio of the displacement sensor's scale to the accelerometer's, from the motion itself; None if
    the motion is too small. If it is None or differs from 1 by more than `ALIKE`, only the accelerometer is used.
    `noise` is the spectral density of the error [(m/s2)^2/Hz] at the frequencies of `numpy.fft.rfft` for n samples.
    """

    acceleration: Array
    dt: float
    agreement: float | None
    noise: Array

    @property
    def record(self) -> SampledRecord:
        """The motion as a base excitation of the model."""
        return SampledRecord(self.acceleration, self.dt)

    @property
    def peak(self) -> float:
        """Largest |acceleration| at the samples [m/s2]."""
        return float(np.abs(self.acceleration).max())

    def draw(self, random: Generator, scale: float = 1.0) -> SampledRecord:
        """A possible true motion: the measured motion multiplied by `scale`, plus a random realisation of the noise."""
        spectrum = np.empty(self.noise.size, np.complex128)
        spectrum.real = self._root * random.standard_normal(spectrum.size)
        spectrum.imag = self._root * random.standard_normal(spectrum.size)
        return SampledRecord(scale * self.acceleration + real_inverse(spectrum, self.acceleration.size), self.dt)

    @cached_property
    def _root(self) -> Array:
        """Standard deviation of the real part, and of the imaginary part, of each spectral line of the noise."""
        root: Array = np.sqrt(self.noise * self.acceleration.size / (4.0 * self.dt))
        return root


def base_motion(signals: Array, rest: Array, sample_rate: float) -> BaseMotion:
    """The table's motion from `signals`, shape (n, n_signals), that begin and end at rest; `rest`, shape (m,
    n_signals), is the noise at rest.

    Raises InvalidInput if samples of a table sensor are missing.
    """
    sensors = signals[:, [ACCELERATION, DISPLACEMENT]]
    if not (np.isfinite(sensors).all() and np.isfinite(rest[:, [ACCELERATION, DISPLACEMENT]]).all()):
        raise InvalidInput("motion of the table", len(signals), "every sample of both table sensors is required")
    still = len(rest)
    size = len(signals)
    frequency = np.fft.rfftfreq(size, 1.0 / sample_rate).astype(np.float64)
    a = np.fft.rfft(_levelled(sensors[:, 0], still))
    x = -((2.0 * np.pi * frequency) ** 2) * np.fft.rfft(_closed(sensors[:, 1], still))
    noise_a = np.full(frequency.size, _density(rest[:, ACCELERATION], sensors[:, 0], sample_rate))
    noise_x = _density(rest[:, DISPLACEMENT], sensors[:, 1], sample_rate) * (2.0 * np.pi * frequency) ** 4
    share = np.zeros(frequency.size)
    agreement, lead = _alignment(frequency, a, x, noise_a, noise_x, size / sample_rate)
    if agreement is not None and abs(agreement - 1.0) <= ALIKE:
        x *= np.exp(-2j * np.pi * frequency * lead)
        share = noise_a / (noise_a + noise_x)
    every = max(round(sample_rate / MODEL_RATE), 1)
    dt = every / sample_rate
    # higher frequencies contain only noise, which would alias
    kept = 1.0 / np.sqrt(1.0 + (frequency * dt / _TOP) ** 16)
    whole = np.fft.irfft(kept * (share * x + (1.0 - share) * a), size)[::every]
    lines = np.fft.rfftfreq(whole.size, dt)
    left = np.interp(lines, frequency, kept**2 * (share**2 * noise_x + (1.0 - share) ** 2 * noise_a))
    return BaseMotion(np.ascontiguousarray(whole), dt, agreement, left)


def _density(rest: Array, values: Array, sample_rate: float) -> float:
    """Spectral density of a sensor's white noise [unit^2/Hz]: that at `rest` or, if larger, that due to the steps of
    its `values`.
    """
    frequency, power = noise_density(rest, sample_rate)
    inside = (frequency >= _NOISE_BAND[0]) & (frequency <= _NOISE_BAND[1])
    return max(float(np.mean(power[inside])), _of_steps(values, sample_rate), 1e-30)


def _of_steps(values: Array, sample_rate: float) -> float:
    """Spectral density [unit^2/Hz] of the error due to the rounding of `values` to their resolution; zero without
    motion.
    """
    apart: Array = np.diff(np.unique(values))
    if not apart.size:
        return 0.0
    step, turn = float(np.min(apart)), max(round(_PASSING * sample_rate), 1)
    whole = (values.size - 1) // turn * turn
    path: Array = np.abs(np.diff(values[: whole + 1])).reshape(-1, turn).sum(axis=1)
    rate = np.clip(path / step, 1.0, turn) * (sample_rate / turn)
    return step**2 / 12.0 * 2.0 * float(np.mean(1.0 / rate))


def _levelled(values: Array, still: int) -> Array:
    """Values minus the line through their means at rest before and after the motion, because a sensor's offset
    drifts.
    """
    begin, end = float(values[:still].mean()), float(values[-still:].mean())
    return values - np.linspace(begin, end, values.size)


def _closed(values: Array, still: int) -> Array:
    """Values relative to their initial mean, with the final offset removed smoothly, because friction may stop the
    table at a different position.
    """
    begin, end = float(values[:still].mean()), float(values[-still:].mean())
    x = np.linspace(0.0, 1.0, values.size)
    return values - begin - (end - begin) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _alignment(
    frequency: Array,
    a: NDArray[np.complex128],
    x: NDArray[np.complex128],
    noise_a: Array,
    noise_x: Array,
    duration: float,
) -> tuple[float | None, float]:
    """Ratio of the displacement sensor's scale to the accelerometer's, None if it cannot be measured, and the
    displacement sensor's lead [s].
    """
    # relation between a density and the spectrum S of n samples at rate f: |S|^2 = density n f / 2
    to_power = 0.5 * duration * (2.0 * frequency[-1]) ** 2
    clear = (np.abs(a) ** 2 > _CLEAR * noise_a * to_power) & (np.abs(x) ** 2 > _CLEAR * noise_x * to_power)
    if np.count_nonzero(clear) < 8:
        return None, 0.0
    # each line is weighted by the precision of the ratio at that line
    weight, omega = 1.0 / (noise_a[clear] + noise_x[clear]), 2.0 * np.pi * frequency[clear]
    cross = weight * np.conj(a[clear]) * x[clear]
    side = 1.0 if np.sum(cross.real) >= 0.0 else -1.0
    lead = np.sum(np.abs(cross) * omega * np.angle(side * cross)) / np.sum(np.abs(cross) * omega**2)
    scale = np.sum((cross * np.exp(-1j * omega * lead)).real) / np.sum(weight * np.abs(a[clear]) ** 2)
    return float(scale), float(lead)
