"""Conversion of distances to codes, with optical errors, moving mean, mastering and hold, and of codes to bytes."""

from enum import IntEnum

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.settings import Settings
from sim.sensors import Laser

WORD = 3
"""Bytes per value."""
WORD_BITS = 30
"""Bits per value on the line, including a start bit and a stop bit per byte."""
LAST_DISTANCE = 65520
"""Code at the upper end of the reserve beyond the measuring range (manual of the optoNCDT 1420, p. 65)."""
LAST_MASTERED = 262071
"""Largest code of a mastered distance; error codes are greater."""


class Fault(IntEnum):
    """Codes in place of a distance (manual of the optoNCDT 1420, p. 66)."""

    DATA_VOLUME = 262075
    NO_PEAK = 262076
    TOO_CLOSE = 262077
    TOO_FAR = 262078
    LASER_OFF = 262082


def distance_codes(shares: NDArray[np.float64]) -> NDArray[np.int64]:
    """Codes of distances given as fractions of the measuring range, shape (n,), including the reserve.

    x = (100 d / MR + 1) 65520 / 102 (manual of the optoNCDT 1420, p. 65). NaN is not allowed.
    """
    codes = np.rint((100.0 * shares + 1.0) * (LAST_DISTANCE / 102.0))
    return np.clip(codes, 0, LAST_DISTANCE).astype(np.int64)


def mastered_codes(shares: NDArray[np.float64]) -> NDArray[np.int64]:
    """Codes of mastered distances, shape (n,): x = (100 d / MR + 51) 65520 / 102, over 18 bits (manual, p. 65)."""
    codes = np.rint((100.0 * shares + 51.0) * (LAST_DISTANCE / 102.0))
    return np.clip(codes, 0, LAST_MASTERED).astype(np.int64)


def words(blocks: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Bytes, in the order sent, of `blocks`, shape (n, m): n blocks of m values of 18 bits, each as its low, middle and
    high six bits (manual, p. 84).

    The two upper bits of each byte identify the byte of the value and mark the first value of a block.
    """
    sent = np.empty((*blocks.shape, WORD), dtype=np.uint8)
    sent[:, :, 0] = blocks & 0x3F
    sent[:, :, 1] = blocks >> 6 & 0x3F | 0x40
    sent[:, :, 2] = blocks >> 12 & 0x3F | 0xC0
    sent[:, 0, 2] &= 0xBF
    return sent.reshape(-1)


Array = NDArray[np.float64]

_RESERVE = 0.01
"""Reserve beyond each end of the measuring range, in which distances are still measured, as a fraction of the range."""


class Optics:
    """Triangulation with the errors of the simulated laser: sensitivity, linearity and noise."""

    def __init__(self, laser: Laser, random: Generator) -> None:
        self._laser, self._random = laser, random
        self._phase = float(random.uniform(0.0, 2.0 * np.pi))

    def shares(self, displacement: Array) -> Array:
        """Measured distances as fractions of the measuring range, for displacements from mid range [m], shape (n,)."""
        laser = self._laser
        seen = displacement + laser.noise * self._random.standard_normal(displacement.size)
        place = seen / laser.measuring_range
        waves = np.sin(2.0 * np.pi * laser.linearity_periods * place + self._phase)
        return 0.5 + (1.0 + laser.scale_error) * place + laser.linearity * waves


class Evaluation:
    """Converts successive measurements to codes; keeps the history for the moving mean and the hold."""

    def __init__(self, measuring_range: float) -> None:
        self._range = measuring_range
        self.restart()

    def restart(self) -> None:
        """Discard the history."""
        self._tail = np.empty(0)
        self._held = 0
        self._age = np.inf

    def codes(self, shares: Array, faults: NDArray[np.int64], settings: Settings) -> NDArray[np.int64]:
        """Codes of the next n > 0 measurements, shape (n,), after averaging, mastering and hold. Where `faults` is
        zero, `shares` is the distance (fraction of the range); elsewhere the code is the fault, unless the hold
        replaces it.
        """
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
        """Mean of the valid values among the last `n` up to each measurement; meaningless where it is invalid."""
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
    """The fault of each measurement, shape (n,); 0 within the measuring range and its reserve. `shares` are distances
    as fractions of the range, NaN without a target.
    """
    faults = np.zeros(shares.size, dtype=np.int64)
    if not (np.abs(shares - 0.5) <= 0.5 + _RESERVE).all():
        faults[shares < -_RESERVE] = Fault.TOO_CLOSE
        faults[shares > 1.0 + _RESERVE] = Fault.TOO_FAR
        faults[np.isnan(shares)] = Fault.NO_PEAK
    return faults
