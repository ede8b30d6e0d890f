"""Detection of a steady state from the cycles of every signal."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle

WINDOW = 12
"""Number of cycles per window; two windows are compared."""

LONGEST_SUBHARMONIC = 6

SPREAD = 5.0
"""Largest deviation of a cycle of a steady motion from the mean of its window, in units of the tolerance."""

KIN_SHARE = 0.25
"""A storey that hardly moves is assessed relative to at least this fraction of the larger motion."""


@dataclass(frozen=True)
class Steadiness:
    """Steadiness of a dwell, a period of constant drive. `spread`, the deviation of the cycles within a window, and
    `drift`, the change of the mean between the windows, are relative to each signal's mean amplitude and in excess of
    its noise; each is the largest value over the assessed signals.

    `repeats` is the number of cycles after which the motion repeats: 1 if it is steady, 2 to 6 for a subharmonic, 0 if
    it does not repeat.
    """

    steady: bool
    spread: float
    drift: float
    repeats: int


class SteadyDetector:
    """Compares the complex amplitudes of every signal over the last two windows of cycles.

    A motion is steady if the means of the two windows differ by less than a third of the tolerance, which bounds the
    remainder of a transient that decays by 2 % per cycle (0.98^12 / (1 - 0.98^12) / 3 = 1.2 tolerances), and if within
    the last window no cycle deviates from the mean by more than `SPREAD` tolerances. A weakly damped orbit excited by
    noise, or a transient that rotates from cycle to cycle, spreads the cycles more than it shifts their mean; its
    remainder is part of the scatter of the measured cycles. Every signal is allowed a noise floor of four standard
    deviations of a fitted amplitude, sigma sqrt(2 / N), and every phase the jitter of a sensor with a free-running
    clock.
    """

    def __init__(
        self,
        tolerance: float,
        columns: Sequence[int] | None = None,
        kin: Sequence[int] = (),
        jitter: float = 0.0,
        reference: Sequence[int] = (),
    ) -> None:
        """`columns` are the assessed signals, by default all. `kin` holds the indices, within `columns`, of signals of
        the same kind, each of which is assessed relative to at least `KIN_SHARE` of the largest. `reference` are
        signals that are not assessed; every assessed signal is assessed relative to at least `KIN_SHARE` of the largest
        of them. `jitter` [rad] is the wander of a phase due to a sensor's free-running clock.
        """
        self._tolerance = tolerance
        self._columns = slice(None) if columns is None else list(columns)
        self._kin = list(kin)
        self._jitter = jitter
        self._reference, self._floor = list(reference), 1e-12
        self._cycles: deque[Cycle] = deque(maxlen=2 * WINDOW)

    def push(self, cycle: Cycle) -> None:
        """Add the next cycle."""
        self._cycles.append(cycle)

    def restart(self) -> None:
        """Discard all cycles after a change of the drive."""
        self._cycles.clear()

    def judge(self, allowance: float = 1.0) -> Steadiness:
        """Steadiness of the dwell at `allowance` times the tolerance; never steady before two windows are full."""
        if len(self._cycles) < 2 * WINDOW:
            return Steadiness(False, float("nan"), float("nan"), 0)
        cycles = list(self._cycles)
        amplitudes = np.array([cycle.fundamental[self._columns] for cycle in cycles])
        peaks = np.array([cycle.peak[self._columns] for cycle in cycles])
        if self._reference:
            others = np.mean([cycle.fundamental[self._reference] for cycle in cycles[WINDOW:]], axis=0)
            self._floor = max(KIN_SHARE * float(np.abs(others).max()), 1e-12)
        noise = [cycle.noise[self._columns] * np.sqrt(2.0 / cycle.samples) for cycle in cycles]
        sigma = np.array(noise).mean(axis=0)
        spreads, drifts = zip(self._compare(amplitudes, sigma), self._compare(peaks, 2.0 * sigma), strict=True)
        spread, drift = float(np.max(spreads)), float(np.max(drifts))
        tolerance = allowance * self._tolerance
        steady = spread <= SPREAD * tolerance and drift <= tolerance / 3.0
        return Steadiness(steady, spread, drift, 1 if steady else self._repeats(amplitudes, sigma))

    def _compare(
        self, series: NDArray[np.complex128] | NDArray[np.float64], sigma: NDArray[np.float64]
    ) -> tuple[float, float]:
        """Largest relative spread within the last window, and largest relative drift between the windows, in excess of
        the noise.
        """
        before, last = series[:WINDOW].mean(axis=0), series[WINDOW:].mean(axis=0)
        size = self._size(last)
        spread = np.max(self._distance(series[WINDOW:], last), axis=0) - 4.0 * sigma
        drift = self._distance(before, last) - 4.0 * sigma * np.sqrt(2.0 / WINDOW)
        return float(np.max(spread / size)), float(np.max(drift / size))

    def _distance(
        self,
        these: NDArray[np.complex128] | NDArray[np.float64],
        those: NDArray[np.complex128] | NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Distance between amplitudes: the larger of the difference in magnitude and the phase difference beyond the
        jitter [rad], multiplied by the magnitude.
        """
        size = np.abs(those)
        turned = np.abs(np.angle(these * np.conj(those))) * size
        return np.maximum(np.abs(np.abs(these) - size), turned - self._jitter * size)

    def _size(self, mean: NDArray[np.complex128] | NDArray[np.float64]) -> NDArray[np.float64]:
        size = np.maximum(np.abs(mean), self._floor)
        if self._kin:
            size[self._kin] = np.maximum(size[self._kin], KIN_SHARE * size[self._kin].max())
        return size

    def _repeats(self, amplitudes: NDArray[np.complex128], sigma: NDArray[np.float64]) -> int:
        size = self._size(amplitudes.mean(axis=0))
        for period in range(2, LONGEST_SUBHARMONIC + 1):
            change = np.max(self._distance(amplitudes[period:], amplitudes[:-period]), axis=0) - 6.0 * sigma
            if float(np.max(change / size)) <= self._tolerance:
                return period
        return 0
