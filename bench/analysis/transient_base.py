"""How the table moved, from both of its sensors: the base motion that a prediction for a transient starts from.

At low frequencies a displacement sensor knows the acceleration far better than an accelerometer does, at high ones far
worse: its noise counts omega^2. Each frequency takes both, weighted by their noise as it was at rest,

    A = w (-omega^2 X) + (1 - w) A_a,    w = S_a / (S_a + omega^4 S_x),

with X brought to the accelerometer's delay first, over the frequencies at which both show the motion. The ratio of
their scales comes out of that as well. It is a check and not a correction: calibrations know the scales better than one
motion does. The noise that is left has the density S_a omega^4 S_x / (S_a + omega^4 S_x).

A sensor quieter than its steps shows nothing at rest, and yet is off by up to half a step as soon as it moves. Its
error has the variance step^2 / 12, spread over as many frequencies as steps are passed in a second, at most up to half
the rate (Bennett, Bell Syst. Tech. J. 27, 1948): slow motions leave it at low ones. No sensor counts for more.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

Array = NDArray[np.float64]


def noise_density(rest: Array, sample_rate: float) -> tuple[Array, Array]:
    """Frequencies [Hz] and one-sided spectral density [unit^2/Hz] of `rest`, shape (n,), without its linear trend."""
    from scipy import signal

    # `Any`: scipy's stubs know no linear trend
    tools: Any = signal
    frequency, power = tools.welch(rest, sample_rate, nperseg=max(rest.size // 4, 8), detrend="linear")
    return np.asarray(frequency), np.asarray(power)


MODEL_RATE = 1000.0
"""Samples per second that a model is given [1/s], or the bench's own where that is less."""

_TOP = 0.4
"""Share of that rate up to which the motion is kept."""
_NOISE_BAND = (2.0, 60.0)
"""Frequencies [Hz] between which the sensors' noise is white."""
_PASSING = 0.05
"""Time over which the passed steps of a sensor are counted [s]: a fraction of the periods that matter."""
_CLEAR = 100.0
"""Power over its noise at which a sensor shows the motion."""
ALIKE = 0.02
"""Relative difference of the two sensors' scales from which on one is wrong: the accelerometer is used alone."""


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Acceleration of the table [m/s2], shape (n,), every `dt` [s]; its errors are drawn by `draw`.

    `agreement` is the displacement sensor's scale over the accelerometer's, from the motion itself; None where the
    motion is too small to tell. Where it is not 1 the accelerometer is used alone. `noise` is the spectral density of
    the error [(m/s2)^2/Hz] at the frequencies of `numpy.fft.rfft` of so many samples.
    """

    acceleration: Array
    dt: float
    agreement: float | None
    noise: Array

    @property
    def record(self) -> SampledRecord:
        """As an excitation of the model."""
        return SampledRecord(self.acceleration, self.dt)

    @property
    def peak(self) -> float:
        """Largest magnitude [m/s2]."""
        return float(np.abs(self.acceleration).max())

    def draw(self, random: Generator, scale: float = 1.0) -> SampledRecord:
        """A motion that this one may really be: `scale` times as strong, its noise drawn once more."""
        lines = self.noise.size
        waves = random.standard_normal(lines) + 1j * random.standard_normal(lines)
        spectrum = np.sqrt(self.noise * self.acceleration.size / (4.0 * self.dt)) * waves
        return SampledRecord(scale * self.acceleration + np.fft.irfft(spectrum, self.acceleration.size), self.dt)


def base_motion(signals: Array, rest: Array, sample_rate: float) -> BaseMotion:
    """The table's motion in `signals` that begin and end at rest; `rest` is the noise, shapes (n or m, n_signals).

    Raises InvalidInput when samples of a table sensor are missing.
    """
    sensors = signals[:, [ACCELERATION, DISPLACEMENT]]
    if not (np.isfinite(sensors).all() and np.isfinite(rest[:, [ACCELERATION, DISPLACEMENT]]).all()):
        raise InvalidInput("motion of the table", len(signals), "every sample of both of its sensors is needed")
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
    # what lies above is noise, and would fold into the motion
    kept = 1.0 / np.sqrt(1.0 + (frequency * dt / _TOP) ** 16)
    whole = np.fft.irfft(kept * (share * x + (1.0 - share) * a), size)[::every]
    lines = np.fft.rfftfreq(whole.size, dt)
    left = np.interp(lines, frequency, kept**2 * (share**2 * noise_x + (1.0 - share) ** 2 * noise_a))
    return BaseMotion(np.ascontiguousarray(whole), dt, agreement, left)


def _density(rest: Array, values: Array, sample_rate: float) -> float:
    """Spectral density of a sensor's white noise [unit^2/Hz]: as at `rest`, or that of the steps of its `values`."""
    frequency, power = noise_density(rest, sample_rate)
    inside = (frequency >= _NOISE_BAND[0]) & (frequency <= _NOISE_BAND[1])
    return max(float(np.mean(power[inside])), _of_steps(values, sample_rate), 1e-30)


def _of_steps(values: Array, sample_rate: float) -> float:
    """Density [unit^2/Hz] of the rounding of `values` to the steps that they show; none of steps without motion."""
    apart: Array = np.diff(np.unique(values))
    if not apart.size:
        return 0.0
    step, turn = float(np.min(apart)), max(round(_PASSING * sample_rate), 1)
    whole = (values.size - 1) // turn * turn
    path: Array = np.abs(np.diff(values[: whole + 1])).reshape(-1, turn).sum(axis=1)
    rate = np.clip(path / step, 1.0, turn) * (sample_rate / turn)
    return step**2 / 12.0 * 2.0 * float(np.mean(1.0 / rate))


def _levelled(values: Array, still: int) -> Array:
    """Without the line through its means at rest: a sensor's offset drifts."""
    begin, end = float(values[:still].mean()), float(values[-still:].mean())
    return values - np.linspace(begin, end, values.size)


def _closed(values: Array, still: int) -> Array:
    """Led back from where it ended to where it began, slowly: friction leaves a table somewhere else."""
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
    """Scale of the displacement sensor over the accelerometer's, None where it cannot be told, and its lead [s]."""
    # a density and the spectrum of n samples at rate f: |S|^2 = density n f / 2
    to_power = 0.5 * duration * (2.0 * frequency[-1]) ** 2
    clear = (np.abs(a) ** 2 > _CLEAR * noise_a * to_power) & (np.abs(x) ** 2 > _CLEAR * noise_x * to_power)
    if np.count_nonzero(clear) < 8:
        return None, 0.0
    # each line counts by what is known of its ratio
    weight, omega = 1.0 / (noise_a[clear] + noise_x[clear]), 2.0 * np.pi * frequency[clear]
    cross = weight * np.conj(a[clear]) * x[clear]
    side = 1.0 if np.sum(cross.real) >= 0.0 else -1.0
    lead = np.sum(np.abs(cross) * omega * np.angle(side * cross)) / np.sum(np.abs(cross) * omega**2)
    scale = np.sum((cross * np.exp(-1j * omega * lead)).real) / np.sum(weight * np.abs(a[clear]) ** 2)
    return float(scale), float(lead)
