"""From what the sensor sees to codes: errors of the optics, moving mean, mastering, hold."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.settings import Settings
from drivers.emulation.optoncdt.words import Fault, distance_codes, mastered_codes
from sim.sensors import Laser

Array = NDArray[np.float64]

_RESERVE = 0.01
"""How far beyond either end of the measuring range a distance is still measured [share of the range]."""


class Optics:
    """Triangulation with the errors of the simulated laser: sensitivity, linearity, noise."""

    def __init__(self, laser: Laser, random: Generator) -> None:
        self._laser, self._random = laser, random
        self._phase = float(random.uniform(0.0, 2.0 * np.pi))

    def shares(self, displacement: Array) -> Array:
        """Measured distances as shares of the measuring range for displacements from mid range [m], shape (n,)."""
        laser = self._laser
        seen = displacement + laser.noise * self._random.standard_normal(displacement.size)
        place = seen / laser.measuring_range
        waves = np.sin(2.0 * np.pi * laser.linearity_waves * place + self._phase)
        return 0.5 + (1.0 + laser.scale_error) * place + laser.linearity * waves


class Evaluation:
    """Turns measurements, in order, into codes; keeps what the moving mean and the hold need of the past."""

    def __init__(self, measuring_range: float) -> None:
        self._range = measuring_range
        self.restart()

    def restart(self) -> None:
        """Forget the past."""
        self._tail = np.empty(0)
        self._held = 0
        self._age = np.inf

    def codes(self, shares: Array, faults: NDArray[np.int64], settings: Settings) -> NDArray[np.int64]:
        """Codes of measurements, shape (n,), n > 0: of `shares` of the range where `faults` is zero, else the fault."""
        valid = faults == 0
        shares = self._mean(np.where(valid, shares, np.nan), settings.average)
        shares = np.where(valid, shares, 0.0)
        master = settings.mastering
        if master is None:
            codes = distance_codes(shares)
        else:
            codes = mastered_codes(shares - master.place + master.value / self._range)
        return self._hold(np.where(valid, codes, faults), valid, settings.hold)

    def _mean(self, shares: Array, n: int) -> Array:
        """Mean of the valid ones among the last `n` measurements, where the newest is valid."""
        known = np.concatenate((self._tail, shares))
        self._tail = known[known.size - min(n - 1, known.size) :]
        if n == 1:
            return shares
        valid = ~np.isnan(known)
        sums = np.concatenate(([0.0], np.cumsum(np.where(valid, known, 0.0))))
        counts = np.concatenate(([0], np.cumsum(valid)))
        end = np.arange(known.size - shares.size, known.size) + 1
        start = np.maximum(end - n, 0)
        return (sums[end] - sums[start]) / np.maximum(counts[end] - counts[start], 1)

    def _hold(self, codes: NDArray[np.int64], valid: NDArray[np.bool_], cycles: float) -> NDArray[np.int64]:
        """Codes with errors replaced by the last valid code, for at most `cycles` measurements."""
        if valid.all():
            self._age, self._held = 0.0, int(codes[-1])
            return codes
        places = np.arange(codes.size)
        newest = np.maximum.accumulate(np.where(valid, places, -1))
        age = np.where(newest >= 0, places - newest, self._age + 1.0 + places)
        last = np.where(newest >= 0, codes[newest], self._held)
        self._age, self._held = float(age[-1]), int(last[-1])
        return np.where((age <= cycles) & np.isfinite(age), last, codes) if cycles else codes


def faults_of(shares: Array) -> NDArray[np.int64]:
    """The fault of each measurement, shape (n,); 0 where the distance is within the measuring range or its reserve."""
    faults = np.zeros(shares.size, dtype=np.int64)
    if not (np.abs(shares - 0.5) <= 0.5 + _RESERVE).all():
        faults[shares < -_RESERVE] = Fault.TOO_CLOSE
        faults[shares > 1.0 + _RESERVE] = Fault.TOO_FAR
        faults[np.isnan(shares)] = Fault.NO_PEAK
    return faults
