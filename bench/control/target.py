"""Target motion of the table, a record within the table's band with rest at both ends; and the reach of the table."""

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from bench.analysis.table_motion import TableMotion
from bench.config.model import BenchConfiguration
from sim.errors import InvalidInput

Array = NDArray[np.float64]

ORDER = 4
"""Order of the Butterworth filters, applied forwards and backwards, that limit a record to the band."""

FLAT, REACH = 1.6, 2.0
"""Factors by which the band is widened at both ends: the window is 1 up to the first and 0 beyond the second."""

REST = 4.0
"""Duration of the rest before and after the record, in which the filters settle, in periods of the band's lower end."""


@dataclass(frozen=True)
class Target:
    """Table acceleration [m/s2] at `sample_rate` [1/s], shape (n,); the rest at each end lasts `rest` samples.

    `band` [Hz] is the pair of -6 dB points of the filters applied to the motion, whose spectrum is zero outside
    `support`.
    """

    acceleration: Array
    sample_rate: float
    band: tuple[float, float]
    rest: int

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] at which motions are compared and corrected."""
        return self.band[0] / REACH, self.band[1] * REACH

    @property
    def frequency(self) -> Array:
        """Frequencies [Hz] of the transform of the record, shape (n // 2 + 1,)."""
        return np.fft.rfftfreq(self.acceleration.size, 1.0 / self.sample_rate).astype(np.float64)

    @property
    def window(self) -> Array:
        """The zero-phase filter with which target and measurement are compared: values from 0 to 1, shape (n // 2 +
        1,).
        """
        return band_window(self.frequency, self.band)

    @property
    def peaks(self) -> dict[str, float]:
        """Largest magnitudes of acceleration [m/s2], velocity [m/s] and displacement [m]."""
        velocity, displacement = integrated(self.acceleration, self.sample_rate)
        series = {"acceleration": self.acceleration, "velocity": velocity, "displacement": displacement}
        return {name: float(np.abs(values).max()) for name, values in series.items()}

    @property
    def duration(self) -> float:
        """Duration [s], including the rest."""
        return self.acceleration.size / self.sample_rate

    def scaled(self, factor: float) -> "Target":
        """The same motion, multiplied by `factor`."""
        return replace(self, acceleration=factor * self.acceleration)


def windowed(acceleration: Array, dt: float, band: tuple[float, float]) -> Array:
    """`acceleration`, shape (n,), filtered by the zero-phase window of `band` [Hz] after zero padding."""
    from scipy.fft import next_fast_len

    size = int(next_fast_len(acceleration.size, real=True))
    window = band_window(np.fft.rfftfreq(size, dt).astype(np.float64), band)
    return np.fft.irfft(window * np.fft.rfft(acceleration, size), size)


def check_band(band: tuple[float, float], sample_rate: float) -> None:
    """Raise InvalidInput unless `sample_rate` [1/s] covers `band` [Hz] and its transition bands."""
    low, high = band
    if not 0.0 < low < high or REACH * high > 0.5 * sample_rate:
        allowed = f"its ends must be positive, ascending and at most {0.5 * sample_rate / REACH:g} Hz"
        raise InvalidInput("band", band, allowed)


def band_gain(frequency: Array, band: tuple[float, float]) -> Array:
    """Gain of the zero-phase filters of `band` at ascending frequencies [Hz]; 0 to 1, same shape."""
    low, high = band
    gain = band_window(frequency, band)
    inside = gain > 0.0
    gain[inside] /= 1.0 + (low / frequency[inside]) ** (2 * ORDER)
    gain[inside] /= 1.0 + (frequency[inside] / high) ** (2 * ORDER)
    return gain


def integrated(acceleration: Array, sample_rate: float) -> tuple[Array, Array]:
    """Velocity [m/s] and displacement [m] for `acceleration` [m/s2] without its mean; both begin at zero."""
    spectrum = np.fft.rfft(acceleration)
    omega = 2.0 * np.pi * np.fft.rfftfreq(acceleration.size, 1.0 / sample_rate)
    spectrum[0], omega[0] = 0.0, 1.0
    velocity = np.fft.irfft(-1j * spectrum / omega, acceleration.size)
    displacement = np.fft.irfft(-spectrum / omega**2, acceleration.size)
    return velocity - velocity[0], displacement - displacement[0]


def band_window(frequency: Array, band: tuple[float, float]) -> Array:
    """Weight at each frequency, same shape: 1 within the band widened by FLAT, 0 beyond REACH, and in between a
    half-cosine taper in the logarithm of frequency.
    """
    low, high = band
    inside = (frequency > low / REACH) & (frequency < high * REACH)
    beyond = np.zeros_like(frequency)
    beyond[inside] = np.maximum(low / frequency[inside], frequency[inside] / high)
    over = np.log(np.maximum(beyond, FLAT) / FLAT) / np.log(REACH / FLAT)
    return np.where(inside, 0.5 * (1.0 + np.cos(np.pi * over)), 0.0)


SHARE = 0.9
"""Fraction of the stroke and the limits that a record may use, since the table does not follow a record exactly."""


@dataclass(frozen=True)
class Reach:
    """Largest |displacement| [m] and |velocity| [m/s] of the table. Raises InvalidInput unless both are positive."""

    displacement: float
    velocity: float

    def __post_init__(self) -> None:
        for name, value in (("displacement", self.displacement), ("velocity", self.velocity)):
            if not (isfinite(value) and value > 0.0):
                raise InvalidInput(name, value, "it must be a positive number")

    @staticmethod
    def of(configuration: BenchConfiguration, share: float = SHARE) -> "Reach":
        """The fraction `share` of the smaller of half stroke and displacement limit, and of the velocity limit."""
        limits = configuration.limits
        return Reach(share * min(configuration.half_stroke, limits.displacement), share * limits.velocity)

    def holds(self, motion: TableMotion) -> bool:
        """Whether the motion stays within the reach."""
        return motion.peak_displacement <= self.displacement and motion.peak_velocity <= self.velocity
