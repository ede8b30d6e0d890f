"""Source of the drive, block by block."""

import numpy as np
from numpy.typing import NDArray

from bench.control.oscillator import Oscillator
from sim.errors import InvalidInput

Array = NDArray[np.float64]


class DriveSource:
    """Source of the drive, block by block: the prepared drive while one is playing, otherwise the oscillator."""

    def __init__(self, sample_rate: float, drive_range: float) -> None:
        self.oscillator = Oscillator(sample_rate)
        self._range = drive_range
        self._prepared = np.zeros(0)

    def reset(self) -> None:
        """Reset the drive to zero."""
        self.oscillator.reset()
        self._prepared = np.zeros(0)

    @property
    def playing(self) -> bool:
        """Whether a prepared drive is playing."""
        return self._prepared.size > 0

    def play(self, volts: Array) -> None:
        """Play `volts`, shape (n,), starting with the next sample. The caller has checked them."""
        self._prepared = volts.copy()

    def require_playable(self, volts: Array) -> None:
        """Check a prepared drive.

        Raises InvalidInput unless it is one-dimensional, finite, zero at both ends and within the drive range, and the
        current drive is zero.
        """
        if volts.ndim != 1 or volts.size == 0:
            raise InvalidInput("shape of a prepared drive", volts.shape, "it must be a non-empty one-dimensional array")
        if not np.isfinite(volts).all():
            at = int(np.flatnonzero(~np.isfinite(volts))[0])
            raise InvalidInput(f"sample {at} of a prepared drive", float(volts[at]), "every sample must be finite")
        if volts[0] != 0.0 or volts[-1] != 0.0:
            ends = float(volts[0]), float(volts[-1])
            raise InvalidInput("ends of a prepared drive", ends, "it must begin and end at 0 V: taper it")
        if (peak := float(np.abs(volts).max())) > self._range:
            raise InvalidInput(
                "peak of a prepared drive", peak, f"the drive range is +-{self._range:g} V: scale the drive"
            )
        if self.oscillator.amplitude != 0.0 or self.oscillator.remaining > 0:
            asked = f"{self.oscillator.amplitude:g} m/s2"
            raise InvalidInput("sine amplitude before a prepared drive", asked, "ramp the sine to zero first")
        self.require_silence("another prepared drive")

    def require_silence(self, wanted: str) -> None:
        """Raise InvalidInput naming the requested step, `wanted`, if a prepared drive is playing."""
        if self.playing:
            left = f"{self._prepared.size} samples left"
            raise InvalidInput(f"{wanted} during a prepared drive", left, "ramp the prepared drive out first")

    def next(self, n: int) -> Array:
        """The next `n` samples of drive [V], shape (n,)."""
        if not self.playing:
            return self.oscillator.next(n)
        now, self._prepared = self._prepared[:n], self._prepared[n:]
        return np.concatenate((now, self.oscillator.next(n - now.size))) if now.size < n else now
