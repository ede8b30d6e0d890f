"""Pseudo-acceleration response spectrum of a base motion.

A damped oscillator u'' + 2 zeta omega u' + omega^2 u = -a_g under a linearly interpolated record is integrated exactly
(Nigam and Jennings, Bull. Seism. Soc. Am. 59, 1969). Here their 2 x 2 recursion is diagonalised: with lambda = omega
(-zeta + i sqrt(1 - zeta^2)) the state is one complex number, z' = lambda z + a_g, u = -Im z / omega_d and u' =
-Im(lambda z) / omega_d.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

Array = NDArray[np.float64]

DAMPING = 0.05
"""Default damping ratio of a response spectrum."""

_COARSEST_STEP = 0.25
"""Largest omega dt [rad].

A turning point lies between two samples: the error of the cubic through displacement and velocity at both samples is
below (omega dt)^4 / 384 of the amplitude, 1e-5.
"""


def pseudo_acceleration(acceleration: Array, dt: float, periods: Array, damping: float = DAMPING) -> Array:
    """omega^2 max |u| [m/s2] at each of `periods` [s], shape (n_periods,).

    `acceleration` [m/s2], shape (n,), has the step `dt` [s]; the oscillators start at rest, and the free vibration
    after the last sample, on a resting base, is included. Raises InvalidInput.
    """
    record = np.ascontiguousarray(acceleration, dtype=np.float64)
    if record.ndim != 1 or record.size < 2 or not np.isfinite(record).all():
        raise InvalidInput(
            "record", record.shape, "it must be one-dimensional with at least two samples, all of them finite"
        )
    if not dt > 0.0:
        raise InvalidInput("dt", dt, "it must be a positive number of seconds")
    if not 0.0 <= damping < 1.0:
        raise InvalidInput("damping", damping, "the damping ratio must be at least 0 and below 1")
    if not np.all(periods > 0.0):
        raise InvalidInput("periods", periods.tolist(), "every period must be a positive number of seconds")
    return np.array([_peak(record, dt, 2.0 * np.pi / float(period), damping) for period in periods])


def logarithmic_periods(shortest: float, longest: float, per_octave: int = 6) -> Array:
    """Periods [s] from `shortest` to `longest`, both included, about `per_octave` per octave."""
    count = max(round(per_octave * float(np.log2(longest / shortest))), 1) + 1
    return np.geomspace(shortest, longest, count)


def _peak(record: Array, dt: float, omega: float, damping: float) -> float:
    """Peak of omega^2 |u| [m/s2] of one oscillator."""
    from scipy import signal

    parts = int(np.ceil(omega * dt / _COARSEST_STEP))
    if parts > 1:
        fine = np.arange((record.size - 1) * parts + 1) / parts
        record, dt = np.interp(fine, np.arange(record.size), record), dt / parts
    damped = omega * (1.0 - damping**2) ** 0.5
    eigenvalue = complex(-damping * omega, damped)
    x = eigenvalue * dt
    first = np.expm1(x) / x
    second = (np.expm1(x) - x) / x**2
    # `Any`: scipy's stubs do not declare the type of a filtered array
    states: Any = signal.lfilter(
        [dt * second, dt * (first - second)], [1.0, -np.exp(x)], record, zi=np.array([-dt * second * record[0]])
    )[0]
    # half a damped cycle after the record contains the largest later displacement
    after = states[-1] * np.exp(x * np.arange(1, int(np.ceil(np.pi / (damped * dt))) + 2))
    z: NDArray[np.complex128] = np.concatenate((states, after))
    u, v = -z.imag / damped, -(eigenvalue * z).imag / damped
    return omega**2 * max(float(np.abs(u).max()), _turning_points(u, v, dt))


def _turning_points(u: Array, v: Array, dt: float) -> float:
    """Largest |u| at the turning points between samples, on the cubic through displacement and velocity at both."""
    at = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    if at.size == 0:
        return 0.0
    u0, v0, v1 = u[at], v[at] * dt, v[at + 1] * dt
    rise = u[at + 1] - u0
    second, third = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
    # the root in (0, 1) of v0 + 2 second s + 3 third s^2, in a form without cancellation
    q = -second - np.copysign(np.sqrt(np.maximum(second**2 - 3.0 * third * v0, 0.0)), second)
    s = np.where((q * v0 > 0.0) & (np.abs(v0) <= np.abs(q)), v0 / q, q / np.where(third == 0.0, 1.0, 3.0 * third))
    return float(np.abs(u0 + s * (v0 + s * (second + s * third))).max())
