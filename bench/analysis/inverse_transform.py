"""Inverse Fourier transform to real series whose length has a large prime factor, fast if used repeatedly.

For such a length n = a p, the usual algorithm transforms series of more than twice the length, which may exceed the
processor's cache. With j = p l + i and k = a m + q, the transform consists of one transform of length p for each q, a
rotation, and one transform of length a for each i (Cooley and Tukey, 1965). The symmetry of the spectrum halves the
work.
"""

from functools import lru_cache
from math import isqrt

import numpy as np
from numpy.typing import NDArray

LARGE = 64
"""Prime factor above which the length is split."""

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


def real_inverse(spectrum: Complex, n: int) -> Floats:
    """The series, shape (n,), with this `spectrum`, shape (n // 2 + 1,): equal to that of `numpy.fft.irfft` to within
    rounding.
    """
    a, p = _factors(n)
    if p <= LARGE or a == 1:
        return np.fft.irfft(spectrum, n)
    places, mirrored, rotations = _split(n)
    parts = spectrum[places]
    np.conjugate(parts, out=parts, where=mirrored)
    parts = np.fft.ifft(parts, axis=1)
    parts *= rotations
    return np.fft.irfft(parts, a, axis=0).reshape(n)


def _factors(n: int) -> tuple[int, int]:
    """n / p and p, where p is the largest prime factor of n."""
    rest, largest = n, 1
    for factor in range(2, isqrt(n) + 1):
        while rest % factor == 0:
            rest, largest = rest // factor, factor
    largest = max(largest, rest)
    return n // largest, largest


@lru_cache(maxsize=4)
def _split(n: int) -> tuple[NDArray[np.intp], NDArray[np.bool_], Complex]:
    """Indices into the spectrum, a mask of the mirrored ones, and rotations; each has the shape (a // 2 + 1, p)."""
    a, p = _factors(n)
    q = np.arange(a // 2 + 1)[:, None]
    k = a * np.arange(p) + q
    mirrored = k > n // 2
    rotations = np.exp(2j * np.pi / n * (q * np.arange(p) % n))
    return np.where(mirrored, n - k, k), mirrored, rotations
