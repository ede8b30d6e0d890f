"""The signals of the experiment, and their computation from the channels of a rig."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.analysis.laser_calibration import LaserCalibration
from drivers.rig import Channel
from sim.channel import STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT
from sim.errors import InvalidInput

SIGNALS = ("acceleration", "displacement", "u1", "drift", *STOREYS)
"""First columns of a signal array: table acceleration [m/s2], table displacement [m], displacement of the first storey
relative to the table [m], drift u2 - u1 [m], and readings of the two lasers [m].
"""

ACCELERATION, DISPLACEMENT, U1, DRIFT, LASER_1, LASER_2 = range(6)

MEASURED_BY = (TABLE_ACCELERATION, TABLE_DISPLACEMENT, *STOREYS)
"""Channels from which the signals are computed."""


@dataclass(frozen=True)
class Further:
    """An additional signal, which consists of the values of one channel."""

    name: str
    unit: str
    quantity: str


def further_of(channels: Sequence[Channel]) -> tuple[Further, ...]:
    """The additional signals of a rig with these channels, in channel order."""
    return tuple(Further(each.name, each.unit, each.quantity) for each in channels if each.name not in MEASURED_BY)


class SignalMap:
    """Converts channel values to signals relative to the zero taken at rest.

    Lasers on the ground measure x_g + u, with the table displacement x_g; lasers on the table measure u. In both cases
    the drift does not depend on x_g. A `calibration` corrects lasers and table sensors for their identified errors. All
    other channels become additional columns (`further`) after those of SIGNALS. Raises InvalidInput if a channel is
    missing.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        reference: Literal["ground", "table"],
        calibration: LaserCalibration | None = None,
    ) -> None:
        names = [channel.name for channel in channels]
        for name in MEASURED_BY:
            if name not in names:
                raise InvalidInput("channels", ", ".join(names), f"the signals require a channel {name}")
        self._columns = [names.index(name) for name in MEASURED_BY]
        self.further = further_of(channels)
        self._others = [names.index(each.name) for each in self.further]
        self._ground = reference == "ground"
        self._calibration = calibration
        self._zero = np.zeros(len(SIGNALS) + len(self.further))
        self.taken = np.zeros(self._zero.size, dtype=np.bool_)
        """Mask of the signals that had a value when the zero was taken, shape (n_signals,)."""

    def tare(self, values: NDArray[np.float64]) -> None:
        """Take the mean of channel values at rest, shape (n, n_channels), as the zero of every signal.

        A signal without any value at rest keeps the zero of its sensor.
        """
        raw = self._raw(values)
        valid = np.count_nonzero(np.isfinite(raw), axis=0)
        self._zero = np.nansum(raw, axis=0) / np.maximum(valid, 1)
        self.taken = valid > 0

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signals, shape (n, n_signals), of channel values, shape (n, n_channels); NaN where a sensor has no value."""
        signals = self._raw(values)
        signals -= self._zero
        return signals

    def _raw(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        acceleration, displacement, first, second = (values[:, column] for column in self._columns)
        if (found := self._calibration) is not None:
            acceleration, displacement = (
                found.table_acceleration * acceleration,
                found.table_displacement * displacement,
            )
            first, second = found.laser_1.corrected(first), found.laser_2.corrected(second)
        signals = np.empty((values.shape[0], self._zero.size), order="F")
        signals[:, ACCELERATION] = acceleration
        signals[:, DISPLACEMENT] = displacement
        signals[:, U1] = first - displacement if self._ground else first
        signals[:, DRIFT] = second - first
        signals[:, LASER_1] = first
        signals[:, LASER_2] = second
        if self._others:
            signals[:, len(SIGNALS) :] = values[:, self._others]
        return signals


def bridged(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """`values`, shape (n,), with missing ones interpolated; at least one is known."""
    known = np.flatnonzero(np.isfinite(values))
    return values if known.size == values.size else np.interp(np.arange(values.size), known, values[known])


def scatter(signals: NDArray[np.float64]) -> float:
    """The larger of the standard deviations [m] of u1 and of the drift in signals of shape (n, n_signals); infinite if
    samples are missing.
    """
    deviation = np.std(signals[:, [U1, DRIFT]], axis=0)
    return float(np.nan_to_num(deviation, nan=np.inf).max())
