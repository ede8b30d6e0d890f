"""How much table acceleration a volt of drive makes, at each frequency, and how far it lags."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class DriveCalibration:
    """Response of the table to the drive, `response` [m/s2 per V] at `omega` [rad/s], ascending, shape (n,).

    Complex with the convention exp(+i omega t), as measured: the delay of the filter in front of the converter is in
    it. Between the points it is interpolated linearly, in its real and its imaginary part; outside it is held.
    """

    omega: tuple[float, ...]
    response: tuple[complex, ...]

    @staticmethod
    def flat(response: complex) -> "DriveCalibration":
        """One response for every frequency: where a calibration starts."""
        return DriveCalibration((1.0,), (response,))

    def at(self, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Response at `omega` [rad/s], same shape."""
        return np.asarray(np.interp(omega, self.omega, np.asarray(self.response, dtype=np.complex128)), np.complex128)

    def beyond(self, other: "DriveCalibration") -> "DriveCalibration":
        """This calibration, continued above its last frequency by what `other` has there."""
        above = [(omega, response) for omega, response in other.points if omega > self.omega[-1]]
        return DriveCalibration(
            (*self.omega, *(omega for omega, _ in above)), (*self.response, *(response for _, response in above))
        )

    @property
    def points(self) -> list[tuple[float, complex]]:
        """Frequencies [rad/s] with their responses."""
        return list(zip(self.omega, self.response, strict=True))
