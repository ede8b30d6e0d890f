"""From the channels of a rig to the signals of the experiment."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.analysis.laser_calibration import LaserCalibration
from drivers.rig import Channel
from sim.errors import InvalidInput

SIGNALS = ("acceleration", "displacement", "u1", "drift", "laser_1", "laser_2")
"""Columns of a signal array: table acceleration [m/s2], table displacement [m], first storey relative to the table
[m], drift u2 - u1 [m], and what the two lasers see [m]."""

ACCELERATION, DISPLACEMENT, U1, DRIFT, LASER_1, LASER_2 = range(6)


class SignalMap:
    """Turns channel values into signals, counted from the zero taken at rest.

    Lasers beside the table see x_g + u; lasers on it see u. The drift is free of x_g either way. A `calibration` takes
    the errors that it found of lasers and table sensors away.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        reference: Literal["ground", "table"],
        calibration: LaserCalibration | None = None,
    ) -> None:
        names = [channel.name for channel in channels]
        needed = ("table_acceleration", "table_displacement", "laser_1", "laser_2")
        for name in needed:
            if name not in names:
                raise InvalidInput("channels", ", ".join(names), f"the harmonic analysis needs a channel {name}")
        self._columns = [names.index(name) for name in needed]
        self._ground = reference == "ground"
        self._calibration = calibration
        self._zero = np.zeros(len(SIGNALS))

    def tare(self, values: NDArray[np.float64]) -> None:
        """Take the mean of channel values at rest, shape (n, n_channels), as the zero of every signal.

        A signal without any value keeps the zero of its sensor.
        """
        raw = self._raw(values)
        valid = np.count_nonzero(np.isfinite(raw), axis=0)
        self._zero = np.nansum(raw, axis=0) / np.maximum(valid, 1)

    def scatter(self, values: NDArray[np.float64]) -> float:
        """Larger standard deviation of u1 and drift [m] in channel values; infinite where samples are missing."""
        deviation = np.std(self._raw(values)[:, [U1, DRIFT]], axis=0)
        return float(np.nan_to_num(deviation, nan=np.inf).max())

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signals, shape (n, 6), of channel values, shape (n, n_channels); NaN where a sensor gave none."""
        return self._raw(values) - self._zero

    def _raw(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        acceleration, displacement, first, second = (values[:, column] for column in self._columns)
        if (found := self._calibration) is not None:
            acceleration, displacement = (
                found.table_acceleration * acceleration,
                found.table_displacement * displacement,
            )
            first, second = found.laser_1.corrected(first), found.laser_2.corrected(second)
        signals = np.empty((values.shape[0], len(SIGNALS)), order="F")
        signals[:, ACCELERATION] = acceleration
        signals[:, DISPLACEMENT] = displacement
        signals[:, U1] = first - displacement if self._ground else first
        signals[:, DRIFT] = second - first
        signals[:, LASER_1] = first
        signals[:, LASER_2] = second
        return signals
