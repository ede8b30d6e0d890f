"""Transient that remains in the mean of the measured cycles, from the decay that the cycles themselves show.

A slow mode of a settling motion changes the peak from cycle to cycle by C rho^n cos(psi n + phase). Modes that turn by
a large angle per cycle, as those of a rocking frame do (2 to 3 rad), average out within a few cycles; a mode that does
not turn shifts the mean. The modes are fitted to all cycles at a constant drive, and the shift of the measured ones is
averaged over decays and angles by their likelihood. It is not subtracted: its mean square is the squared uncertainty.
"""

from collections.abc import Sequence
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DECAYS = (0.7, 0.85, 0.92, 0.95, 0.97, 0.98, 0.988, 0.993)
"""Moduli of the multipliers. The slowest modes of the rocking and of the bare frame have 0.97 to 0.985; a slower one
would have been judged as unsteady.
"""

ANGLES = (0.0, 0.015, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.6, 0.8, 1.1, 1.4, 1.7, 2.0, 2.3, 2.6, 2.9, pi)
"""Angles of the multipliers [rad]."""

CAUTION = 0.3
"""Share of the logarithm of the likelihood that counts: decays and slow turns of nearly equal likelihood shift the mean
by different amounts, and the grid holds few of them.
"""

FINER = 9
"""Number of moduli and of angles around the best ones of the grid."""

FEWEST = 8
"""Least number of cycles of a fit."""

ROUNDING = 1e-12
"""Scatter relative to the values that is due to rounding."""


def remaining_transient(series: Array, measured: int) -> float:
    """Standard uncertainty of the mean of the last `measured` values of `series`, shape (n,), due to a transient."""
    n = series.size
    if n < FEWEST:
        return float(np.ptp(series))
    varying = series - series.mean()
    coarse = _modes(*np.meshgrid(DECAYS, ANGLES, indexing="ij"), n)
    k = int(_fitted(varying, coarse, measured)[0].argmin())
    decay, angle = divmod(k, len(ANGLES))
    fine = _modes(*np.meshgrid(_around(DECAYS, decay), _around(ANGLES, angle), indexing="ij"), n)
    squares, shifts, gains = _fitted(varying, np.concatenate((coarse, fine)), measured)
    least = float(squares.min())
    scatter = least / max(n - 5, 1)
    if scatter <= (ROUNDING * float(np.abs(series).max())) ** 2:
        return abs(float(shifts[squares.argmin()]))
    likely = np.exp(-0.5 * CAUTION * (squares - least) / scatter)
    return sqrt(float(likely @ (shifts**2 + scatter * gains) / likely.sum()))


def _around(grid: Sequence[float], k: int) -> Array:
    """Finer grid between the neighbours of its element `k`."""
    return np.linspace(grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)], FINER)


def _modes(decays: Array, angles: Array, n: int) -> Array:
    """A constant and both parts of each mode over `n` cycles, of the order of one at the first; shape (modes, n, 3)."""
    at = np.arange(n)
    turned = (decays.ravel() * np.exp(1j * angles.ravel()))[:, None] ** at
    return np.stack((np.ones(turned.shape), turned.real, turned.imag), axis=2)


def _fitted(series: Array, modes: Array, measured: int) -> tuple[Array, Array, Array]:
    """Sum of squares of the residuals, mean of the mode over the measured cycles, and its variance relative to that of
    white noise, of each mode.
    """
    transposed = modes.transpose(0, 2, 1)
    # one part of a mode that does not turn is zero
    inverse = np.linalg.pinv(transposed @ modes, rcond=1e-13, hermitian=True)
    found = np.einsum("kij,kj->ki", inverse, transposed @ series)
    residuals = series - np.einsum("kni,ki->kn", modes, found)
    share = modes[:, -measured:].mean(axis=1)
    share[:, 0] = 0.0
    return np.sum(residuals**2, axis=1), np.sum(share * found, axis=1), np.einsum("ki,kij,kj->k", share, inverse, share)
