"""What the drive is made of: the oscillator, and before it whatever prepared drive is still to be played."""

import numpy as np
from numpy.typing import NDArray

from bench.control.oscillator import Oscillator
from sim.errors import InvalidInput

Array = NDArray[np.float64]


class Source:
    """The drive, block by block: a prepared one while there is one, the oscillator's otherwise."""

    def __init__(self, sample_rate: float, drive_range: float) -> None:
        self.oscillator = Oscillator(sample_rate)
        self._range = drive_range
        self._prepared = np.zeros(0)

    def reset(self) -> None:
        """Back to silence."""
        self.oscillator.reset()
        self._prepared = np.zeros(0)

    @property
    def playing(self) -> bool:
        """Whether samples of a prepared drive are still to be given out."""
        return self._prepared.size > 0

    def play(self, volts: Array) -> None:
        """Give out `volts`, shape (n,), which can be played, from the next sample on."""
        self._prepared = volts.copy()

    def require_playable(self, volts: Array) -> None:
        """Raise InvalidInput for a prepared drive that is not one row, not finite, not zero at both ends or beyond the
        drive range, and while anything else is driven.
        """
        if volts.ndim != 1 or volts.size == 0:
            raise InvalidInput("shape of a prepared drive", volts.shape, "it must be one row of samples")
        if not np.isfinite(volts).all():
            at = int(np.flatnonzero(~np.isfinite(volts))[0])
            raise InvalidInput(f"sample {at} of a prepared drive", float(volts[at]), "every sample must be finite")
        if volts[0] != 0.0 or volts[-1] != 0.0:
            ends = float(volts[0]), float(volts[-1])
            raise InvalidInput("ends of a prepared drive", ends, "it must begin and end at 0 V: lead it there")
        if (peak := float(np.abs(volts).max())) > self._range:
            raise InvalidInput("peak of a prepared drive", peak, f"the drive range is +-{self._range:g} V: scale it")
        if self.oscillator.amplitude != 0.0 or self.oscillator.remaining > 0:
            asked = f"{self.oscillator.amplitude:g} m/s2"
            raise InvalidInput("prepared drive on a sine of", asked, "bring the sine to zero before")
        self.require_silence("another prepared drive")

    def require_silence(self, wanted: str) -> None:
        """Raise InvalidInput, naming what is `wanted`, while a prepared drive is played."""
        if self.playing:
            left = f"{self._prepared.size} samples left"
            raise InvalidInput(f"{wanted} during a prepared drive", left, "ramp it out first")

    def next(self, n: int) -> Array:
        """The next `n` samples of drive [V], shape (n,)."""
        if not self.playing:
            return self.oscillator.next(n)
        now, self._prepared = self._prepared[:n], self._prepared[n:]
        return np.concatenate((now, self.oscillator.next(n - now.size))) if now.size < n else now
