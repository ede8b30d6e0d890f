"""Errors of fitted cycles due to the resolution of a laser.

Rounding a reading x to steps q changes it by e(x), a sawtooth with period q (Bennett, Bell Syst. Tech. J. 27, 1948):

    e(x) = q sum over m = 1, 2, ... of (-1)^m / (pi m) sin(2 pi m x / q)

The error of a fitted value is the sum of w_i e(x_i) over all readings, with their weights w_i. All cycles pass the same
steps, so it does not average out, except as far as the cycles differ by a part of a step. The position of the steps is
unknown; if it is uniformly distributed, the terms are uncorrelated and the error has the variance

    sum over m of q^2 / (2 pi^2 m^2) |sum of w_i exp(2 pi j m x_i / q)|^2

The largest part is from the turning points, with a phase that a fraction of a step changes. The fitted motion contains
just these errors, so that the variance is averaged over motions that are larger by up to one step.

A sine of amplitude A has a harmonic k of magnitude |J_k(2 pi m A / q)|, with the mean square q / (2 pi^2 m A) from many
steps on.
"""

from dataclasses import dataclass, field
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TERMS = 4
"""Number of terms of the sawtooth; with many steps per cycle, the others have 2 % of the variance."""

PLACES, SIZES = 2048, 4
"""Number of phases at which the readings are evaluated, shared between the cycles, which are sampled at different
phases in a test as well; and number of motions, from the fitted one to one that is larger by almost one step.
"""


@dataclass(frozen=True, eq=False)
class FittedPeak:
    """Peak of the mean of fitted cycles, from the harmonics 1 to `orders` of both lasers' readings.

    `harmonics` [m], shape (2, cycles, 1 + H), are the mean and the complex amplitudes c_k of the readings of laser 1
    and 2, which are Re(sum of c_k exp(j k phase)) in each cycle; `phase` [rad] is that of the peak. `remaining`, shape
    (2,), are the variances [m2] of the peak after a correction of the rounding errors, None without one.
    """

    harmonics: NDArray[np.complex128]
    phase: float
    orders: int
    remaining: tuple[float, float] | None = None
    _variances: dict[float, tuple[float, float]] = field(
        default_factory=dict[float, tuple[float, float]], init=False, repr=False
    )

    def variances(self, step: float) -> tuple[float, float]:
        """Variances [m2] of the peak due to rounding of the readings of laser 1 and of laser 2 to multiples of `step`
        [m], or those that remain.
        """
        if self.remaining is not None:
            return self.remaining
        if step not in self._variances:
            cycles, highest = self.harmonics.shape[1], self.harmonics.shape[2] - 1
            n = max(PLACES // cycles, 4 * highest)
            number: Array = np.arange(cycles, dtype=np.float64)
            orders: Array = np.arange(highest + 1, dtype=np.float64)
            shifts = np.exp((2j * pi / (n * cycles)) * np.outer(number, orders))
            steps = _values(self.harmonics * shifts, n) / step
            larger = np.linspace(0.0, 1.0, SIZES, endpoint=False)[:, None, None, None]
            turns = np.exp(2j * pi * steps * (1.0 + larger / (0.5 * np.ptp(steps, axis=(1, 2), keepdims=True) + 1.0)))
            # the derivative of the peak with respect to a reading
            fitted = np.exp(-1j * self.phase * np.arange(self.orders + 1))
            fitted[0] = 0.0
            weights = _values(fitted * shifts[:, : self.orders + 1], n) * (2.0 / (n * cycles))
            power, found = turns.copy(), np.zeros(2)
            for term in range(1, TERMS + 1):
                together = np.einsum("slcn,cn->sl", power, weights)
                found += step**2 / (2.0 * pi**2 * term**2) * np.mean(np.abs(together) ** 2, axis=0)
                power *= turns
            self._variances[step] = float(found[0]), float(found[1])
        return self._variances[step]


def _values(harmonics: NDArray[np.complex128], n: int) -> Array:
    """Re(sum of c_k exp(j k phase)) at n equally spaced phases, for amplitudes c_k on the last axis."""
    spectrum = harmonics * (0.5 * n)
    spectrum[..., 0] *= 2.0
    return np.fft.irfft(spectrum, n)
