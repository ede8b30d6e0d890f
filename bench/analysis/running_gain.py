"""Gain coefficient alpha_2 during a test, evaluated whenever the motion is checked for steadiness."""

from dataclasses import replace

import numpy as np

from bench.analysis.draws import SharedDraws
from bench.analysis.gain import DRAWS, SEED, Gain, SteadyPeak, gain
from bench.analysis.peak_readings import PeakReadings, Shapes
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady_correction import without_errors

CHANGED = 0.003
"""Change of a reading, relative to the swing of its laser, below which a running gain keeps the lasers' errors."""


class RunningGain:
    """alpha_2 during a test, with the budget of `gain` except the contribution of the table's amplitude, whose slope is
    not yet known.

    The errors due to linearity and resolution of the lasers, which take most of the computing time, are evaluated again
    when a reading has changed by more than `CHANGED`. Until then, those of the earlier motion are used; linearity
    errors are scaled with the drift.
    """

    def __init__(self, bare: SteadyPeak, sensors: SensorUncertainty, shared: SharedDraws) -> None:
        self._shared = shared
        self._sensors = sensors.checked_by(bare.checks)
        self._bare = self._corrected(bare)
        self._kept: tuple[PeakReadings, Shapes] | None = None

    def of(self, coupled: SteadyPeak) -> Gain:
        """Gain for the drift peak `coupled` measured so far."""
        coupled = self._corrected(coupled)
        shapes: Shapes | None = None
        if self._kept is not None and not _changed(self._kept[0], coupled.readings):
            at, kept = self._kept
            shapes = kept.scaled((1.0, coupled.readings.drift / at.drift))
            coupled = replace(coupled, readings=replace(coupled.readings, fitted=at.fitted))
        found = gain(coupled, self._bare, self._sensors, shared=self._shared.again(), shapes=shapes)
        if shapes is None:
            self._kept = coupled.readings, found.shapes
        return found

    def _corrected(self, peak: SteadyPeak) -> SteadyPeak:
        """The peak without the errors of the lasers that are already known."""
        curves = self._sensors.curves
        return peak if curves is None else without_errors(peak, curves)


def _changed(before: PeakReadings, after: PeakReadings) -> bool:
    if before.zero.shape != after.zero.shape or before.sign != after.sign:
        return True
    allowed = CHANGED * np.array(after.swings)
    moved = np.maximum(np.abs(after.zero - before.zero).max(axis=1), np.abs(np.subtract(after.lasers, before.lasers)))
    return not bool((moved <= allowed).all())


def shared_draws() -> SharedDraws:
    """Random draws for `gain`, generated once for all values of a running gain."""
    return SharedDraws(SEED, DRAWS)
