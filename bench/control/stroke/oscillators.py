"""The peaks of a record's response spectrum as linear functions of its samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.analysis.table_motion import Array


@dataclass(frozen=True, eq=False)
class Peak:
    """The greatest pseudo-acceleration of an oscillator [m/s2], with its sign, and each sample's weight in it."""

    value: float
    weights: Array


def oscillator_peak(acceleration: Array, dt: float, period: float, damping: float) -> Peak:
    """`Peak` of the oscillator of `period` [s] under `acceleration` [m/s2], shape (n,); at the nearest sample.

    The recursion of `bench.analysis.response_spectrum`: z' = lambda z + a, exact between samples joined by lines.
    """
    from scipy import signal

    omega = 2.0 * np.pi / period
    damped = omega * (1.0 - damping**2) ** 0.5
    x = complex(-damping * omega, damped) * dt
    first = np.expm1(x) / x
    second = (np.expm1(x) - x) / x**2
    taps = dt * second, dt * (first - second)
    # `Any`: scipy's stubs leave the type of a filtered array open
    z: Any = signal.lfilter(taps, [1.0, -np.exp(x)], acceleration)
    response = np.asarray(-(omega**2 / damped) * z.imag, dtype=np.float64)
    at = int(np.abs(response).argmax())
    age = np.arange(at, -1, -1)
    answers = taps[0] * np.exp(x * age)
    answers[:-1] += taps[1] * np.exp(x * (age[:-1] - 1))
    weights = np.zeros_like(acceleration)
    weights[: at + 1] = -(omega**2 / damped) * answers.imag
    return Peak(float(response[at]), weights)
