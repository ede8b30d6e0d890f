"""The table's motion under sampled accelerations, exact for linear interpolation (first-order hold).

v += (a0 + a1) dt / 2,    d += v dt + (2 a0 + a1) dt^2 / 6
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class TableMotion(NamedTuple):
    """Velocity [m/s] and displacement [m] at the samples, shape (n,) each, from rest."""

    velocity: Array
    displacement: Array

    @property
    def peak_velocity(self) -> float:
        """Largest |velocity| at the samples [m/s]."""
        return float(np.abs(self.velocity).max())

    @property
    def peak_displacement(self) -> float:
        """Largest |displacement| at the samples [m]."""
        return float(np.abs(self.displacement).max())


def table_motion(acceleration: Array, dt: float) -> TableMotion:
    """Motion from rest under `acceleration` [m/s2], shape (n,), sampled every `dt` [s]."""
    before, after = acceleration[:-1], acceleration[1:]
    velocity, displacement = np.zeros_like(acceleration), np.zeros_like(acceleration)
    np.cumsum((before + after) * (0.5 * dt), out=velocity[1:])
    np.cumsum(velocity[:-1] * dt + (2.0 * before + after) * (dt * dt / 6.0), out=displacement[1:])
    return TableMotion(velocity, displacement)


def with_final_rest(acceleration: Array, dt: float) -> Array:
    """`acceleration` [m/s2], shape (n,), minus sines of one half period and one period over its duration, so that the
    table ends at rest where it began.

    The final velocity and displacement are linear in the two amplitudes, so this is exact except for rounding; the
    second iteration corrects the rounding of the first. The sines vanish at both ends and do not change the record's
    end values.
    """
    place = np.linspace(0.0, np.pi, acceleration.size)
    shapes = np.array([np.sin(place), np.sin(2.0 * place)])
    ends = np.array([_end(shape, dt) for shape in shapes]).T
    for _ in range(2):
        acceleration = acceleration - np.linalg.solve(ends, _end(acceleration, dt)) @ shapes
    return acceleration


def _end(acceleration: Array, dt: float) -> Array:
    velocity, displacement = table_motion(acceleration, dt)
    return np.array([velocity[-1], displacement[-1]])
