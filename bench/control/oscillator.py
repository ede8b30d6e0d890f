"""The phase-continuous sine that drives the table.

It follows sweeps of target acceleration (`sim.excitation.Sweep`), divides by the calibrated gain of the drive at the
momentary frequency, and holds the last amplitude and frequency until told otherwise.
"""

from collections import deque
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.control.calibration import DriveCalibration
from sim.excitation import Sweep


class Oscillator:
    """Turns target acceleration into volts, block by block."""

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._calibration: DriveCalibration | None = None
        self.reset()

    def reset(self) -> None:
        """Back to silence; the calibration stays."""
        self._sweeps: deque[Sweep] = deque()
        self._into = 0  # samples played of the first sweep
        self._amplitude, self._omega, self._phase = 0.0, tau, 0.0
        self._trim, self._trim_to, self._trim_left = 1.0, 1.0, 0

    def use(self, calibration: DriveCalibration) -> None:
        """Divide by the gain of `calibration` from now on."""
        self._calibration = calibration

    @property
    def amplitude(self) -> float:
        """Amplitude [m/s2] at the end of what has been asked."""
        return self._sweeps[-1].amplitude[1] if self._sweeps else self._amplitude

    @property
    def omega(self) -> float:
        """Circular frequency [rad/s] at the end of what has been asked."""
        return self._sweeps[-1].omega[1] if self._sweeps else self._omega

    def follow(self, sweep: Sweep) -> None:
        """Append a sweep."""
        self._sweeps.append(sweep)

    def trim(self, factor: float) -> None:
        """Multiply the drive by `factor`, over one cycle of the present frequency."""
        self._trim_to *= factor
        self._trim_left = max(round(tau / self._omega * self._rate), 1)

    @property
    def remaining(self) -> int:
        """Samples until the last sweep has been played."""
        return sum(self._length(sweep) for sweep in self._sweeps) - self._into

    def next(self, n: int) -> NDArray[np.float64]:
        """The next `n` samples of drive [V], shape (n,)."""
        pieces: list[NDArray[np.float64]] = []
        while n > 0:
            piece = self._from_sweep(n) if self._sweeps else self._held(n)
            pieces.append(piece)
            n -= piece.size
        volts = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
        return self._trimmed(volts)

    def _length(self, sweep: Sweep) -> int:
        return max(round(sweep.duration * self._rate), 1)

    def _from_sweep(self, n: int) -> NDArray[np.float64]:
        sweep = self._sweeps[0]
        length = self._length(sweep)
        n = min(n, length - self._into)
        t = np.arange(self._into + 1, self._into + n + 1) / self._rate
        volts = sweep.amplitude_at(t) * self._per_acceleration(sweep.omega_at(t))
        volts *= np.sin(self._phase + sweep.phase_at(t))
        self._into += n
        if self._into == length:
            self._phase = (self._phase + float(sweep.phase_at(np.array(length / self._rate)))) % tau
            self._amplitude, self._omega = sweep.amplitude[1], sweep.omega[1]
            self._into = 0
            self._sweeps.popleft()
        return volts

    def _held(self, n: int) -> NDArray[np.float64]:
        step = self._omega / self._rate
        phase = self._phase + step * np.arange(1, n + 1)
        self._phase = (self._phase + step * n) % tau
        if self._amplitude == 0.0:
            return np.zeros(n)
        return self._amplitude * self._per_acceleration(np.array(self._omega)) * np.sin(phase)

    def _per_acceleration(self, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._calibration is None:
            raise RuntimeError("the oscillator was asked to move the table before the drive was calibrated")
        return self._calibration.volts_per_acceleration(omega)

    def _trimmed(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._trim_left == 0:
            return volts if self._trim == 1.0 else volts * self._trim
        steps = np.minimum(np.arange(1, volts.size + 1), self._trim_left)
        factor = self._trim + (self._trim_to - self._trim) * steps / self._trim_left
        self._trim_left -= int(steps[-1])
        self._trim = float(factor[-1]) if self._trim_left else self._trim_to
        return volts * factor
