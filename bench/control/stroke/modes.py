"""Half sines over the length of a record, and the table's motion that each makes, in closed form."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.table_motion import Array


class SineModes:
    """sin(k pi j / (n - 1)) at the samples j = 0 to n - 1, for every k whose frequency is `lowest` to `highest` [Hz].

    There are two at least. They vanish at both ends of the record.
    """

    def __init__(self, n: int, dt: float, highest: float, lowest: float = 0.0) -> None:
        self._n, self._dt = n, dt
        length = (n - 1) * dt
        first = min(max(int(np.ceil(2.0 * length * lowest)), 1), n - 3)
        last = min(max(int(np.ceil(2.0 * length * highest)), first + 1), n - 2)
        self._below = first - 1
        orders = np.arange(first, last + 1)
        self.frequencies: Array = orders / (2.0 * length)
        self._steps: Array = np.pi * orders / (n - 1)

    def sum(self, sizes: Array) -> Array:
        """The sum of the modes with `sizes`, shape (k,), at the samples, shape (n,)."""
        whole = np.zeros(self._n)
        whole[1:-1] = 0.5 * _transformed(np.pad(sizes, (self._below, self._n - 2 - self._below - sizes.size)))
        return whole

    def products(self, weights: Array) -> Array:
        """What `weights` at the samples, shape (n,), make of each mode: weights . mode, shape (k,)."""
        return 0.5 * _transformed(weights[1:-1])[self._below : self._below + self._steps.size]

    def motions(self, samples: NDArray[np.intp]) -> tuple[Array, Array]:
        """Velocity and displacement after each of `samples`, shape (m,), under each mode of size 1, shape (m, k).

        The first-order hold's sums over sines and cosines of equal steps theta, in closed form:
        sum of sin(i theta), i < j, is (cos(theta/2) - cos((j - 1/2) theta)) / (2 sin(theta/2)), and so on.
        """
        dt, theta, j = self._dt, self._steps, samples[:, None]
        half = np.sin(0.5 * theta)
        sines = (np.cos(0.5 * theta) - np.cos((j - 0.5) * theta)) / (2.0 * half)
        cosines = 0.5 + np.sin((j - 0.5) * theta) / (2.0 * half)
        trapezium = 0.5 * dt / np.tan(0.5 * theta)
        velocity = trapezium * (1.0 - np.cos(j * theta))
        displacement = dt * trapezium * (j - cosines) + (dt * dt / 6.0) * (3.0 * sines + np.sin(j * theta))
        return velocity, displacement


def _transformed(values: Array) -> Array:
    """Twice the discrete sine transform of type I, shape (n,)."""
    from scipy.fft import dst

    return np.asarray(dst(values, type=1), dtype=np.float64)
