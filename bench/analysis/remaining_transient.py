"""Remaining transient in the mean of the measured cycles, estimated from the decay in the cycles themselves.

A slow mode of a settling motion changes the peak from cycle to cycle by C rho^n cos(psi n + phase). Modes with a large
angle psi per cycle, such as those of a rocking frame (2 to 3 rad), average out within a few cycles; a mode with psi = 0
shifts the mean. Each mode is fitted separately to all cycles at a constant drive, and the squared shift of the mean of
the measured cycles is averaged over decays and angles with their likelihood as weight. The shift is not subtracted: its
mean square is the squared uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DECAYS = (0.7, 0.85, 0.92, 0.95, 0.97, 0.98, 0.988, 0.993)
"""Moduli rho of the multipliers. Those of the slowest modes of the default specimen, rocking or bare, are 0.97 to
0.985.
"""

ANGLES = (0.0, 0.015, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.6, 0.8, 1.1, 1.4, 1.7, 2.0, 2.3, 2.6, 2.9, pi)
"""Angles psi of the multipliers [rad]."""

CAUTION = 0.3
"""Factor applied to the logarithm of the likelihood. It is below 1 because modes of nearly equal likelihood, with
different moduli or small angles, shift the mean by different amounts, and the grid contains only a few of them.
"""

FINER = 9
"""Number of moduli, and of angles, in the finer grid around the best ones."""

FEWEST = 8
"""Minimum number of cycles for a fit."""

ROUNDING = 1e-12
"""Largest scatter, relative to the values, that is attributed to rounding."""


def remaining_transient(series: Array, measured: int) -> float:
    """Standard uncertainty of the mean of the last `measured` values of `series`, shape (n,), due to a transient."""
    n = series.size
    if n < FEWEST:
        return float(np.ptp(series))
    varying = series - series.mean()
    coarse = _coarse(n, measured).fitted(varying)
    decay, angle = divmod(int(coarse[0].argmin()), len(ANGLES))
    fine = _fine_fit(n, measured, decay, angle).fitted(varying)
    squares, shifts, gains = (np.concatenate(each) for each in zip(coarse, fine, strict=True))
    least = float(squares.min())
    scatter = least / max(n - 5, 1)
    if scatter <= (ROUNDING * float(np.abs(series).max())) ** 2:
        return abs(float(shifts[squares.argmin()]))
    likely = np.exp(-0.5 * CAUTION * (squares - least) / scatter)
    return sqrt(float(likely @ (shifts**2 + scatter * gains) / likely.sum()))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Least-squares fits over n cycles, one for each of K modes: the series is fitted by a constant and the mode's real
    and imaginary parts.

    `modes`, shape (K, n, 3), are the basis functions; `inverse`, (K, 3, 3), the inverse normal matrices; `share`, (K,
    3), the means of the basis functions over the measured cycles, zero for the constant; and `gains`, (K,), the
    variance of the fitted mode's mean over the measured cycles, for white noise of unit variance in the series.
    """

    modes: Array
    inverse: Array
    share: Array
    gains: Array

    @staticmethod
    def of(decays: Sequence[float] | Array, angles: Sequence[float] | Array, n: int, measured: int) -> "_Fit":
        """The fits of the modes with every combination of modulus and angle [rad]."""
        modes = _modes(*np.meshgrid(decays, angles, indexing="ij"), n)
        # the imaginary part of a mode with psi = 0 or pi is zero
        normal = modes.transpose(0, 2, 1) @ modes
        inverse = np.asarray(np.linalg.pinv(normal, rcond=1e-13, hermitian=True), dtype=np.float64)
        share = modes[:, -measured:].mean(axis=1)
        share[:, 0] = 0.0
        return _Fit(modes, inverse, share, np.einsum("ki,kij,kj->k", share, inverse, share))

    def fitted(self, series: Array) -> tuple[Array, Array, Array]:
        """For each mode: sum of squares of the residuals, mean of the fitted mode over the measured cycles, and
        `gains`.
        """
        found = np.einsum("kij,kj->ki", self.inverse, self.modes.transpose(0, 2, 1) @ series)
        residuals = series - np.einsum("kni,ki->kn", self.modes, found)
        return np.sum(residuals**2, axis=1), np.sum(self.share * found, axis=1), self.gains


@lru_cache(maxsize=16)
def _coarse(n: int, measured: int) -> _Fit:
    return _Fit.of(DECAYS, ANGLES, n, measured)


@lru_cache(maxsize=64)
def _fine_fit(n: int, measured: int, decay: int, angle: int) -> _Fit:
    """The fits of the modes around one point of the coarse grid."""
    return _Fit.of(_around(DECAYS, decay), _around(ANGLES, angle), n, measured)


def _around(grid: Sequence[float], k: int) -> Array:
    """Finer grid between the neighbours of element `k` of `grid`."""
    return np.linspace(grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)], FINER)


def _modes(decays: Array, angles: Array, n: int) -> Array:
    """A constant, and the real and imaginary parts of each mode with amplitude 1 in the first cycle, over `n` cycles;
    shape (modes, n, 3).
    """
    at = np.arange(n)
    turned = (decays.ravel() * np.exp(1j * angles.ravel()))[:, None] ** at
    return np.stack((np.ones(turned.shape), turned.real, turned.imag), axis=2)
