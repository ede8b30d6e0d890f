"""How much table acceleration a volt of drive makes, at each frequency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class DriveCalibration:
    """Gain of the drive, `gain` [m/s2 per V] at `omega` [rad/s], both ascending in omega, shape (n,).

    Between the points the gain is interpolated linearly; outside it is held.
    """

    omega: tuple[float, ...]
    gain: tuple[float, ...]

    @staticmethod
    def flat(gain: float) -> "DriveCalibration":
        """One gain for every frequency: where a calibration starts."""
        return DriveCalibration((1.0,), (gain,))

    def volts_per_acceleration(self, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        """Drive amplitude per acceleration amplitude [V s2/m], same shape as `omega`."""
        return 1.0 / np.interp(omega, self.omega, self.gain)
