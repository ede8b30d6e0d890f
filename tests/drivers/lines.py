"""Amplitudes of lines in a signal, as the tests of two sensors under one motion need them."""

import numpy as np
from numpy.typing import NDArray


def complex_amplitudes(
    signal: NDArray[np.float64], sample_rate: float, omega: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Amplitudes, shape (m,), of the lines `omega` [rad/s] in a signal, shape (n,), by least squares with its mean.

    An amplitude a is the line Re(a exp(i omega t)), t from the first sample. The lines need not fit the length, and
    samples that a busy computer read too late, which are NaN, are left out.
    """
    phase = np.outer(np.arange(signal.size) / sample_rate, omega)
    lines = np.hstack((np.cos(phase), -np.sin(phase), np.ones((signal.size, 1))))
    there = np.isfinite(signal)
    assert there.mean() > 0.5, f"{np.count_nonzero(~there)} of {signal.size} samples are missing"
    found = np.linalg.lstsq(lines[there], signal[there])[0].astype(np.float64)
    return found[: omega.size] + 1j * found[omega.size : 2 * omega.size]
