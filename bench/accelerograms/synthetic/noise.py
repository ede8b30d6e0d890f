"""Filtered shot noise: white noise that rises and decays, through the ground's filters.

The envelope is that of Saragoni and Hart (Earthquake Eng. Struct. Dyn. 2, 1974) with an exponent of 1,
e(t) = c t exp(1 - c t). The filters are those of Kanai (1957) and Tajimi (1960), the ground as an oscillator, with the
high-pass of Clough and Penzien (Dynamics of Structures, 1975), which brings velocity and displacement back to zero.
Noise that is modulated first and filtered then: Amin and Ang, J. Eng. Mech. Div. ASCE 94, 1968.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIGNIFICANT = 2.73905
"""c times the time between 5 and 95 % of the envelope's energy: e^2 is a gamma distribution of shape 3."""

DECAYED = 6.5
"""c t at which the noise ends: 2.7 % of its greatest are left, and the filters let them die away."""

HIGH_PASS_DAMPING = 0.6
"""Damping ratio of Clough and Penzien's second filter, their usual value."""


def shot_noise(
    seed: int, member: int, n: int, dt: float, significant: float, ground: tuple[float, float, float]
) -> Array:
    """A sample of the noise, shape (n,), of any size, from rest.

    `significant` [s] is the duration between 5 and 95 % of its energy; `ground` are frequency [Hz] and damping ratio of
    the ground and frequency [Hz] of the high-pass. The same `seed` and `member` give the same noise everywhere.
    """
    from scipy.fft import next_fast_len

    rate = SIGNIFICANT / significant
    time = np.arange(n) * dt
    white = _white(seed, member, n) * np.where(rate * time < DECAYED, rate * time * np.exp(1.0 - rate * time), 0.0)
    # as long again, so that the filters' ringing does not come round to the beginning
    length = next_fast_len(2 * n, real=True)
    frequency = np.fft.rfftfreq(length, dt).astype(np.float64)
    filtered = np.fft.irfft(np.fft.rfft(white, length) * _response(frequency, *ground), length)
    return np.asarray(filtered[:n], dtype=np.float64)


def _white(seed: int, member: int, n: int) -> Array:
    """White noise between -1 and 1: numpy promises that the generator's own integers stay what they are."""
    raw = np.random.PCG64(np.random.SeedSequence((seed, member))).random_raw(n)
    return 2.0 * (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53 - 1.0


def _response(frequency: Array, ground: float, damping: float, high_pass: float) -> NDArray[np.complex128]:
    """Ground acceleration per rock acceleration; convention exp(+i omega t), so that it is causal."""
    x, y = frequency / ground, frequency / high_pass
    kanai_tajimi = (1.0 + 2j * damping * x) / (1.0 - x**2 + 2j * damping * x)
    return np.asarray(kanai_tajimi * -(y**2) / (1.0 - y**2 + 2j * HIGH_PASS_DAMPING * y), dtype=np.complex128)
