"""What the operator is told while a record is played: alpha_2 so far, measured and predicted."""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DRIFT
from bench.analysis.transient_base import BaseMotion
from bench.analysis.transient_peak import RunningPeak, running_peak
from bench.control.starts import CATCH_ANGLE
from bench.events import RunningGain
from protocols.earthquake.uncertainty import TOLERANCE
from sim.rocking import simulate
from sim.specimen import Specimen

Array = NDArray[np.float64]

STEP = 0.01
"""Step of a predicted history [s]."""

AUDIBLE = 20.0
"""How many standard uncertainties of its peak the bare drift must have reached before a ratio is told."""


@dataclass(frozen=True, eq=False)
class History:
    """A predicted drift [m], shape (n,), every `STEP` seconds; it ends where the block topples."""

    drift: Array

    @staticmethod
    def of(specimen: Specimen, base: BaseMotion) -> "History":
        """The specimen as assumed under a motion of the table."""
        times = np.arange(0.0, base.record.duration, STEP)
        motion = simulate(
            specimen,
            base.record,
            sample_times=times,
            peaks_from=None,
            tolerance=TOLERANCE,
            overturning_angle=CATCH_ANGLE,
        )
        samples = np.empty((0, 6)) if motion.samples is None else motion.samples
        return History(samples[:, 1] - samples[:, 0])

    def padded(self, size: int) -> Array:
        """The drift with NaN after its end, shape (size,)."""
        return np.append(self.drift[:size], np.full(max(size - self.drift.size, 0), np.nan))


class Watch:
    """Makes a `RunningGain` of every block of signals while one record is played.

    `bare` is the measured drift of the bare frame at the same samples, `noise` [m] the uncertainty of its peak, and
    `expected` are the predicted histories of the bare and the coupled frame: absent while the bare frame is tested.
    """

    def __init__(
        self,
        record: str,
        beta: float | None,
        sample_rate: float,
        bare: Array | None = None,
        noise: float = 0.0,
        expected: tuple[History, History] | None = None,
    ) -> None:
        self._record, self._beta, self._rate = record, beta, sample_rate
        self._peak = RunningPeak()
        self._bare = None if bare is None else np.where((so_far := running_peak(bare)) > AUDIBLE * noise, so_far, nan)
        self._predicted = np.zeros(0) if expected is None else _running_gain(*expected)

    def __call__(self, signals: Array) -> RunningGain:
        peak = self._peak.push(signals[:, DRIFT])
        seconds = self._peak.samples / self._rate
        bare = nan if self._bare is None else float(self._bare[min(self._peak.samples, self._bare.size) - 1])
        place = round(seconds / STEP)
        return RunningGain(
            record=self._record,
            beta=self._beta,
            seconds=seconds,
            drift_peak=peak,
            alpha_2=peak / bare,
            predicted=float(self._predicted[place]) if place < self._predicted.size and bare == bare else nan,
        )


def _running_gain(bare: History, coupled: History) -> Array:
    """The gain up to each step; NaN from where the block topples on, or before anything moves."""
    size = bare.drift.size
    below = running_peak(bare.drift)
    gain = np.full(size, nan)
    # what has toppled has no peak any more, however large it was before
    np.divide(running_peak(coupled.padded(size)), below, out=gain, where=below > 0.0)
    return np.where(np.isnan(coupled.padded(size)), nan, gain)
