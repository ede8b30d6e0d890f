"""Peak of a noisy transient, without the bias of the largest sample.

The largest of many noisy samples is too large by several standard deviations, and the relative error grows as the
motion becomes smaller. Here a polynomial of degree four is fitted by least squares around each maximum that may be the
largest, and its extremum is the peak. The width of the window follows from the signal's bandwidth: of the terms missing
from the polynomial, the one with the sixth derivative is the first that shifts the value at the centre of the window.
The residual of x^6 over a window of half width h is the monic Legendre polynomial P_6 there, so the shift is

    (5 / 231) h^6 s^(6) / 720,    s^(6) ~ A omega_6^6,    omega_6^12 = sum omega^12 |S|^2 / sum |S|^2,

with the signal s, its spectrum S and its amplitude A. The half width h balances this shift against the variance of the
fit due to noise, 225/64 sigma^2 over the number of samples.
"""

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.selection import RIVALS, largest_of
from bench.analysis.signals import bridged
from bench.analysis.transient_base import noise_density
from sim.errors import InvalidInput

Array = NDArray[np.float64]


class RunningPeak:
    """Running peak of a signal in blocks of any size; missing samples are ignored."""

    def __init__(self) -> None:
        self._largest = np.nan
        self._seen = 0

    @property
    def samples(self) -> int:
        """Number of samples processed."""
        return self._seen

    def push(self, block: Array) -> float:
        """The largest magnitude up to the end of `block`, shape (n,); NaN before the first valid sample."""
        self._seen += block.size
        self._largest = float(np.fmax.reduce(np.abs(block), initial=self._largest))
        return self._largest


def running_peak(signal: Array) -> Array:
    """The largest magnitude up to each sample, shape (n,); NaN before the first valid sample."""
    return np.fmax.accumulate(np.abs(signal))


DEGREE = 4
_REMAINDER = 5.0 / 231.0 / 720.0
"""Shift of the fitted value at the centre, divided by h^6 s^(6)."""
_VARIANCE = 225.0 / 64.0
"""Variance of the fitted value at the centre, relative to sigma^2 / samples."""
_NARROWEST = 6
"""Minimum half width of the window in samples."""
_WIDEST = 0.5 * pi
"""Largest omega_6 h: a quarter of a period to either side."""
_BAND = (4.0, 50.0)
"""Band [Hz] in which the noise of a fit is evaluated; below it, a frame may still vibrate at rest."""
_STANDS_OUT, _SMOOTHED = 4.0, 0.5
"""Power, relative to the noise, above which a frequency counts as signal, and width [Hz] over which the power is
averaged first.
"""
_MISSING = 0.25
"""Largest fraction of missing samples in a window."""
_STRONG = 0.5
"""Magnitude beside a gap, relative to the peak, from which on the gap may hide a larger peak."""


@dataclass(frozen=True)
class TransientPeak:
    """The largest magnitude of a signal, in the unit of the signal.

    `value` is corrected for the selection of the largest maximum; `uncertainty` is the standard uncertainty due to
    noise alone; `bias` is the estimated shift due to the degree of the polynomial. `time` [s] is the time of the
    largest maximum since the first sample, `sign` its sign, `window` [s] the half width of the fit, and `rivals` the
    number of other maxima that may be the largest.
    """

    value: float
    uncertainty: float
    bias: float
    time: float
    sign: int
    window: float
    rivals: int


def transient_peak(signal: Array, rest: Array, sample_rate: float) -> TransientPeak:
    """The peak of |`signal`|, shape (n,), which is zero at rest; `rest`, shape (m,), is its noise without motion.

    NaN denotes a missing sample. Raises InvalidInput if `rest` is too short, if there is no motion above the noise, or
    if samples are missing around the largest motion or in a gap that may hide a larger one.
    """
    known = np.isfinite(signal)
    if rest.size < 16 * _NARROWEST or not np.isfinite(rest).all():
        allowed = f"it must consist of at least {16 * _NARROWEST} samples, none of them missing"
        raise InvalidInput("rest before the transient", rest.size, allowed)
    if not known.any():
        raise InvalidInput("transient", signal.size, "it has no valid sample")
    whole = bridged(signal)
    density = noise_density(rest, sample_rate)
    sigma = _equivalent_noise(density, sample_rate)
    omega = _sixth_moment(whole, density, sample_rate)
    half = _half_width(float(np.abs(whole).max()), sigma, omega / sample_rate, min(signal.size, rest.size))
    smooth = _smoothed(whole, half)
    spread = sigma * sqrt(_VARIANCE / (2.0 * half))
    if not np.abs(smooth).max() > RIVALS * max(spread, 1e-300):
        raise InvalidInput(
            "transient", float(np.abs(smooth).max()), "it does not exceed the noise; repeat with a larger motion"
        )
    found = [_maximum(whole, known, int(place), half, sigma) for place in _candidates(smooth, RIVALS * spread)]
    greatest = max(found, key=lambda each: each.value)
    _check_gaps(whole, known, half, greatest.value)
    value, uncertainty = largest_of(np.array([[each.value, each.uncertainty] for each in found]))
    return TransientPeak(
        value=value,
        uncertainty=uncertainty,
        bias=_REMAINDER * greatest.value * (omega * half / sample_rate) ** 6,
        time=greatest.place / sample_rate,
        sign=greatest.sign,
        window=half / sample_rate,
        rivals=len(found) - 1,
    )


@dataclass(frozen=True)
class _Maximum:
    value: float
    uncertainty: float
    place: float
    sign: int


def _equivalent_noise(density: tuple[Array, Array], sample_rate: float) -> float:
    """Standard deviation of white noise with the spectral density of the slow part of the true noise.

    Only that part affects a fit. Filtered samples scatter less, but are not independent.
    """
    frequency, power = density
    slow = (frequency > _BAND[0]) & (frequency < _BAND[1])
    return sqrt(float(np.mean(power[slow])) * 0.5 * sample_rate)


def _sixth_moment(signal: Array, density: tuple[Array, Array], sample_rate: float) -> float:
    """omega_6 [rad/s]: sixth-moment frequency of the part of the signal above the noise."""
    from scipy.signal.windows import tukey

    # a transient begins at rest but may still vibrate at its end: without a taper, the step at the end would contain
    # all frequencies
    taper: Any = tukey(signal.size, 0.1)
    frequency = np.fft.rfftfreq(signal.size, 1.0 / sample_rate)
    power = np.abs(np.fft.rfft(signal * taper)) ** 2 * (2.0 / (sample_rate * signal.size))
    floor = np.interp(frequency, density[0], density[1])
    count = max(round(_SMOOTHED * signal.size / sample_rate), 1)
    mean = np.convolve(power, np.full(count, 1.0 / count), mode="same")
    seen = (mean > _STANDS_OUT * floor) & (frequency > 0.0) & (frequency < _BAND[1])
    seen[max(int(power.argmax()), 1)] = True
    power, place = power[seen], frequency[seen] / frequency[seen].max()
    return 2.0 * pi * float(frequency[seen].max() * (np.sum(place**12 * power) / power.sum()) ** (1.0 / 12.0))


def _half_width(amplitude: float, sigma: float, omega: float, samples: int) -> int:
    """Half width of the window in samples; `omega` is omega_6 in rad per sample."""
    # zero derivative of the sum of squared shift and variance: 12 c^2 h^11 = 225/64 sigma^2 / (2 h^2)
    best = (_VARIANCE * sigma**2 / (24.0 * (_REMAINDER * amplitude * omega**6) ** 2)) ** (1.0 / 13.0)
    return max(int(min(best, _WIDEST / omega, (samples - 1) // 8)), _NARROWEST)


def _smoothed(signal: Array, half: int) -> Array:
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(signal, 2 * half + 1, DEGREE))


def _candidates(smooth: Array, near: float) -> NDArray[np.intp]:
    """Samples at local maxima of |smooth| that are less than `near` below the largest maximum."""
    size = np.abs(smooth)
    inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    places = np.append(inner, size.argmax())
    return np.unique(places[size[places] >= size.max() - near])


def _check_gaps(whole: Array, known: NDArray[np.bool_], half: int, peak: float) -> None:
    """Raise InvalidInput for a gap of more than `half` samples that may hide a motion larger than `peak`: within the
    length of the gap before or after it, the signal reaches `_STRONG` of the peak.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([True], known, [True])).astype(np.int8)))
    for begin, end in edges.reshape(-1, 2):
        size = int(end - begin)
        around = np.concatenate((whole[max(begin - size, 0) : begin], whole[end : end + size]))
        if size > half and np.abs(around).max(initial=0.0) >= _STRONG * peak:
            allowed = "it has no valid sample there, and the largest peak may lie there; repeat the test"
            raise InvalidInput("transient", f"samples {begin} to {end - 1}", allowed)


def _maximum(signal: Array, known: NDArray[np.bool_], place: int, half: int, sigma: float) -> _Maximum:
    """Extremum of the polynomial fitted around sample `place`."""
    low, high = max(place - half, 0), min(place + half + 1, signal.size)
    used = known[low:high]
    if np.count_nonzero(used) < (1.0 - _MISSING) * (2 * half + 1):
        raise InvalidInput("transient", f"sample {place}", "it has too few valid samples around its peak")
    powers = np.vander((np.arange(low, high)[used] - place) / half, DEGREE + 1, increasing=True)
    inverse = np.linalg.pinv(powers)
    polynomial = np.polynomial.Polynomial(inverse @ signal[low:high][used])
    sign = 1 if polynomial(0.0) >= 0.0 else -1
    slope, bend = polynomial.deriv(1), polynomial.deriv(2)
    top = 0.0
    if bend(0.0) * sign < 0.0:
        for _ in range(3):
            top = float(np.clip(top - slope(top) / bend(top), -0.5, 0.5))
    order = np.arange(DEGREE + 1)
    at, along = top**order @ inverse, (order * top ** np.maximum(order - 1, 0)) @ inverse
    value = sign * float(polynomial(top))
    if bend(top) * sign < 0.0:
        # noise shifts the position of the extremum, so that its magnitude is overestimated on average
        value -= 0.5 * sigma**2 * float(along @ along) / abs(float(bend(top)))
    return _Maximum(value, sigma * float(np.linalg.norm(at)), place + top * half, sign)
