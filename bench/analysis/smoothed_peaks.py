"""Errors of peaks of single cycles due to the resolution of a laser.

The sawtooth of `bench.analysis.rounding`, with an unknown position of the steps, is weighted by the polynomial that is
fitted to the samples around a peak. Around a turning point a laser passes few steps, which are averaged little. Peaks
at the same readings have errors in common. Noise of the laser ahead of its output smooths the steps, so that the errors
are smaller than stated here: by a third for noise of a tenth of a step.
"""

from dataclasses import dataclass, field
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TERMS = 10
"""Number of terms of the sawtooth; with few steps around a peak, the others have 6 % of the variance."""


@dataclass(frozen=True, eq=False)
class SmoothedPeaks:
    """Mean of peaks, each the value of a polynomial fitted to the samples around it.

    `readings` [m], shape (2, peaks, m), are those of laser 1 and 2 around each peak, smoothed; `weights`, shape (m,),
    are those of the samples in the value, and `shares`, shape (peaks,), are those of the values in the mean, negative
    where the drift is.
    """

    readings: Array
    weights: Array
    shares: Array
    _variances: dict[float, tuple[float, float]] = field(
        default_factory=dict[float, tuple[float, float]], init=False, repr=False
    )

    def variances(self, step: float) -> tuple[float, float]:
        """Variances [m2] of the mean due to rounding of the readings of laser 1 and of laser 2 to multiples of `step`
        [m].
        """
        if step not in self._variances:
            first, second = np.sum(np.abs(self._errors(step).sum(axis=2)) ** 2, axis=0).tolist()
            self._variances[step] = first, second
        return self._variances[step]

    def covariance(self, step: float) -> Array:
        """Covariance [m2], shape (peaks, peaks), of the parts of the peaks in the mean, due to both lasers: the sum of
        its elements is the sum of the `variances`.
        """
        errors = self._errors(step).reshape(-1, self.shares.size)
        return np.asarray((errors.conj().T @ errors).real)

    def _errors(self, step: float) -> NDArray[np.complex128]:
        """Complex rms amplitudes [m] of the terms of the sawtooth in each share, shape (TERMS, 2, peaks)."""
        turns = np.exp(2j * pi / step * self.readings)
        power, found = np.ones_like(turns), np.empty((TERMS, 2, self.shares.size), dtype=np.complex128)
        for term in range(TERMS):
            power *= turns
            found[term] = power @ self.weights / (term + 1.0)
        return step / (sqrt(2.0) * pi) * self.shares * found
