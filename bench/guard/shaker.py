"""Model of the shaker: force on the table, and current and heating of the coil, computed from the motion."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Motion = TypeVar("Motion", float, NDArray[np.float64], NDArray[np.complex128])


@dataclass(frozen=True)
class ShakerModel:
    """Model that estimates force and current from the motion.

    `mass` is the mass of everything that moves with the table, including the specimen [kg], `stiffness` the stiffness
    of the suspension [N/m], and `force_constant` the force constant of the coil [N/A].
    """

    mass: float
    stiffness: float
    force_constant: float

    def force(self, acceleration: Motion) -> Motion:
        """Force on table and specimen [N] from the table `acceleration` [m/s2], same shape."""
        return self.mass * acceleration

    def current(self, acceleration: Motion, displacement: Motion) -> Motion:
        """Current of the coil [A] from table `acceleration` [m/s2] and `displacement` [m], without friction."""
        return (self.force(acceleration) + self.stiffness * displacement) / self.force_constant

    def largest_force(self, acceleration: float) -> float:
        """Largest magnitude of the force [N] for this largest magnitude of the acceleration [m/s2]."""
        return abs(self.mass) * acceleration

    def largest_current(self, acceleration: float, displacement: float) -> float:
        """Upper bound of the current's magnitude [A] for these largest magnitudes of acceleration [m/s2] and
        displacement [m].
        """
        return (self.largest_force(acceleration) + abs(self.stiffness) * displacement) / abs(self.force_constant)

    def current_amplitude(self, amplitude: Array, omega: Array) -> Array:
        """Amplitude of the current [A] under a sine of `amplitude` [m/s2] at `omega` [rad/s], same shape."""
        return np.abs(self.mass - self.stiffness / omega**2) * amplitude / self.force_constant


def exponential_mean(values: Array, forget: float, state: Array | None = None) -> tuple[Array, Array]:
    """Exponential running mean of `values`, shape (n,), starting at zero, and the filter state for the next call.

    `forget` is the weight of the past per sample. The mean of the squared current approximately follows the temperature
    rise of the coil.
    """
    from sim.kernel.filter import exponential_mean as kernel

    mean = np.array(values, dtype=np.float64)
    after = np.zeros(1) if state is None else state.copy()
    kernel(mean, forget, after)
    return mean, after


def largest_repeated_mean(values: Array, forget: float) -> float:
    """Largest exponential mean of `values`, shape (n,), n > 0, of a programme that is repeated without pause for ever.

    Upper bound for a programme that follows others of the same load, or a pause.
    """
    mean, _ = exponential_mean(values, forget)
    left = forget ** np.arange(1.0, values.size + 1.0)
    # a time constant so long that no decay is visible leaves the mean
    begin = float(mean[-1]) / (1.0 - float(left[-1])) if left[-1] < 1.0 else float(np.mean(values))
    return float(np.max(mean + begin * left))
