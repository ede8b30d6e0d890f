"""What a table answers to the oscillator: its acceleration and the drive as shares of the sine that was asked for.

The sine asked for is A sin(phi), with phi the phase of the oscillator (`bench.control.oscillator`). Over a cycle the
table's acceleration is the imaginary part of A times the sum of y_k exp(i k phi), and y = (1, 0, 0, ...) is what was
asked. The drive has shares c_k in the same way, after the calibrated response has been taken out of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS, Cycle
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.calibration import DriveCalibration

Shares = NDArray[np.complex128]

_DRIVE = len(SIGNALS)
_ORDERS: NDArray[np.float64] = np.arange(1, HARMONICS + 1, dtype=np.float64)


@dataclass(frozen=True)
class Sine:
    """A sine of `amplitude` [m/s2] at `omega` [rad/s], made by an oscillator that divides by `calibration`."""

    omega: float
    amplitude: float
    calibration: DriveCalibration

    def turn(self, cycle: Cycle) -> complex:
        """exp(i phi) where the phase of the cycles is zero, from one during which the oscillator played a pure sine."""
        asked = complex(cycle.harmonics(_DRIVE)[0] * self.calibration.at(np.array(self.omega)))
        return asked / abs(asked)


@dataclass(frozen=True)
class Answer:
    """Shares over some cycles, shape (HARMONICS,): `played` by the drive, `achieved` by the table's acceleration.

    `doubt` is the standard uncertainty of what was achieved.
    """

    played: Shares
    achieved: Shares
    doubt: NDArray[np.float64]

    @staticmethod
    def of(cycles: Sequence[Cycle], sine: Sine, turn: complex) -> "Answer":
        """The means over two `cycles` or more, of a dwell whose phase is counted from `turn` (see `Sine.turn`).

        The uncertainty is that of their scatter, of all harmonics together at least: a few cycles may agree by chance.
        """
        unit = sine.amplitude * turn**_ORDERS
        driven, moved = (
            np.array([cycle.harmonics(column) for cycle in cycles]) / unit for column in (_DRIVE, ACCELERATION)
        )
        achieved = moved.mean(axis=0)
        variance = np.sum(np.abs(moved - achieved) ** 2, axis=0) / (len(cycles) - 1)
        return Answer(
            played=driven.mean(axis=0) * sine.calibration.at(_ORDERS * sine.omega),
            achieved=achieved,
            doubt=np.sqrt(np.maximum(variance, variance.mean()) / len(cycles)),
        )

    @property
    def amplitude_error(self) -> float:
        """Relative error of the fundamental's amplitude."""
        return float(np.abs(self.achieved[0])) - 1.0

    @property
    def phase_error(self) -> float:
        """How far the fundamental is ahead of the oscillator [rad]."""
        return float(np.angle(self.achieved[0]))

    @property
    def distortion(self) -> float:
        """Total harmonic distortion: rms of the harmonics over the fundamental."""
        return float(np.linalg.norm(self.achieved[1:]) / np.abs(self.achieved[0]))
