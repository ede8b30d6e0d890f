"""The motion that the table is asked for: a record within the table's band, at rest at both ends."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

Array = NDArray[np.float64]

ORDER = 4
"""Order of the Butterworth filters, applied forwards and backwards, that limit a record to the band."""

FLAT, REACH = 1.6, 2.0
"""Factors on the ends of the band: up to the first everything counts in full, beyond the second nothing."""

REST = 4.0
"""Rest before and after the record, in periods of the band's lower end: the filters have rung out by then."""


@dataclass(frozen=True)
class Target:
    """Table acceleration [m/s2] at `sample_rate` [1/s], shape (n,); rest at either end lasts `rest` samples.

    `band` [Hz] are the -6 dB points of the filters that shaped it. Its spectrum is zero outside `support`.
    """

    acceleration: Array
    sample_rate: float
    band: tuple[float, float]
    rest: int

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] that is compared and corrected."""
        return self.band[0] / REACH, self.band[1] * REACH

    @property
    def frequency(self) -> Array:
        """Frequencies [Hz] of the transform of the record, shape (n // 2 + 1,)."""
        return np.fft.rfftfreq(self.acceleration.size, 1.0 / self.sample_rate).astype(np.float64)

    @property
    def window(self) -> Array:
        """The zero-phase filter through which target and measurement are compared, shape (n // 2 + 1,): 0 to 1."""
        return band_window(self.frequency, self.band)

    @property
    def peaks(self) -> dict[str, float]:
        """Largest magnitudes of acceleration [m/s2], velocity [m/s] and displacement [m]."""
        velocity, displacement = integrated(self.acceleration, self.sample_rate)
        series = {"acceleration": self.acceleration, "velocity": velocity, "displacement": displacement}
        return {name: float(np.abs(values).max()) for name, values in series.items()}

    @property
    def duration(self) -> float:
        """Length [s], the rest included."""
        return self.acceleration.size / self.sample_rate

    def scaled(self, factor: float) -> "Target":
        """The same motion, `factor` times as strong."""
        return replace(self, acceleration=factor * self.acceleration)


def windowed(acceleration: Array, dt: float, band: tuple[float, float]) -> Array:
    """`acceleration`, shape (n,), through the window of `band` [Hz] and without phase; zeros are put after it."""
    from scipy.fft import next_fast_len

    size = int(next_fast_len(acceleration.size, real=True))
    window = band_window(np.fft.rfftfreq(size, dt).astype(np.float64), band)
    return np.fft.irfft(window * np.fft.rfft(acceleration, size), size)


def check_band(band: tuple[float, float], sample_rate: float) -> None:
    """Raise InvalidInput unless `sample_rate` [1/s] holds all of `band` [Hz] and what lies beside it."""
    low, high = band
    if not 0.0 < low < high or REACH * high > 0.5 * sample_rate:
        allowed = f"it must go up from above 0 to {0.5 * sample_rate / REACH:g} Hz at most"
        raise InvalidInput("band", band, allowed)


def band_gain(frequency: Array, band: tuple[float, float]) -> Array:
    """What the filters of `band` leave of each of the ascending frequencies [Hz], without phase; 0 to 1, same shape."""
    low, high = band
    gain = band_window(frequency, band)
    inside = gain > 0.0
    gain[inside] /= 1.0 + (low / frequency[inside]) ** (2 * ORDER)
    gain[inside] /= 1.0 + (frequency[inside] / high) ** (2 * ORDER)
    return gain


def integrated(acceleration: Array, sample_rate: float) -> tuple[Array, Array]:
    """Velocity [m/s] and displacement [m] from the first sample on, of an acceleration without its mean."""
    spectrum = np.fft.rfft(acceleration)
    omega = 2.0 * np.pi * np.fft.rfftfreq(acceleration.size, 1.0 / sample_rate)
    spectrum[0], omega[0] = 0.0, 1.0
    velocity = np.fft.irfft(-1j * spectrum / omega, acceleration.size)
    displacement = np.fft.irfft(-spectrum / omega**2, acceleration.size)
    return velocity - velocity[0], displacement - displacement[0]


def band_window(frequency: Array, band: tuple[float, float]) -> Array:
    """1 within the band and FLAT beyond, 0 from REACH on, half a cosine over the logarithm between; same shape."""
    low, high = band
    inside = (frequency > low / REACH) & (frequency < high * REACH)
    beyond = np.zeros_like(frequency)
    beyond[inside] = np.maximum(low / frequency[inside], frequency[inside] / high)
    over = np.log(np.maximum(beyond, FLAT) / FLAT) / np.log(REACH / FLAT)
    return np.where(inside, 0.5 * (1.0 + np.cos(np.pi * over)), 0.0)
