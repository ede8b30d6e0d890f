"""Peaks of an unsteady motion without the errors of the lasers that it reveals.

The motion of the second storey gives equations for the errors of both lasers (`bench.analysis.laser_curves`). Like that
under a record, an unsteady motion passes many readings of both lasers in many combinations, and so does not need a
calibration. The harmonics of the bare frame tell further errors of lasers that are not calibrated
(`bench.analysis.bare_harmonics`); its steady test is corrected as well. In the corrected motion the zero of the drift
follows from momentum (`bench.analysis.drift_zero`), without the rounding errors of the readings at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import TRACES, Cycle, extremes
from bench.analysis.drift_zero import DriftZero, drift_zero
from bench.analysis.gain import SteadyPeak, gain
from bench.analysis.linearity import LinearFrame
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import DRIFT, SIGNALS
from bench.analysis.steady_correction import without_errors
from bench.analysis.unsteady_peaks import UnsteadyPeaks, uninterrupted, unsteady_peaks

Array = NDArray[np.float64]

CAUTION = 1.0
"""Power of the evidence by which the shapes of error curves are weighted. The residuals of a long motion near one
frequency are mostly noise and rounding. Under records, they are due to the clocks of the lasers, and evidence
is worth less.
"""


@dataclass(frozen=True, eq=False)
class Revealed:
    """Corrected `peaks` of an unsteady motion and of the steady `reference`, for `sensors` with the errors found."""

    peaks: UnsteadyPeaks
    reference: SteadyPeak
    sensors: SensorUncertainty


def revealed(
    peaks: UnsteadyPeaks,
    reference: SteadyPeak,
    sensors: SensorUncertainty,
    frame: LinearFrame,
    omega: float,
    block: float,
) -> Revealed | None:
    """Corrected peaks of a motion at `omega` [rad/s] of a `frame` with a block, relative to a `reference` without it.

    Residuals of the equations may be correlated within `block` seconds; zero corrects nothing. None if the gain of the
    greatest peak would not have a smaller uncertainty, as after a weak motion, if cycles are missing, or for lasers on
    the table, whose equations need its acceleration.
    """
    if not (block and frame.grounded and peaks.used and reference.used) or len(uninterrupted(peaks.used)) > 1:
        return None
    tests = [_signals(each) for each in (peaks.used, reference.used)]
    sample_rate = len(tests[0]) / len(peaks.used) * omega / tau
    found = sensors.found_in(tests, frame, sample_rate, block, CAUTION, checked=sensors.calibration is None)
    if found.curves is None:
        return None
    signals = ReadingCorrection(found)(tests[0])
    zero = drift_zero(signals, frame, sample_rate)
    if zero is None:
        return None
    signals[:, DRIFT] -= zero.drift
    corrected = _relative_to(zero, unsteady_peaks(_with(peaks.used, signals), omega, sensors.accuracy))
    moved = without_errors(reference, found.curves)
    if gain(corrected.greatest, moved, found).uncertainty >= gain(peaks.greatest, reference, sensors).uncertainty:
        return None
    return Revealed(corrected, moved, found)


def _signals(cycles: Sequence[Cycle]) -> Array:
    """Drift and lasers of the samples of `cycles`, shape (n, len(SIGNALS)); the other signals are zero."""
    traces = np.concatenate([cycle.traces for cycle in cycles])
    signals = np.zeros((len(traces), len(SIGNALS)))
    signals[:, TRACES] = traces
    return signals


def _with(cycles: Sequence[Cycle], signals: Array) -> list[Cycle]:
    """The `cycles` with the samples and the largest drifts of `signals`, shape (n, len(SIGNALS))."""
    ends = np.cumsum([len(cycle.traces) for cycle in cycles])[:-1]
    found = list[Cycle]()
    for cycle, samples in zip(cycles, np.split(signals[:, TRACES], ends), strict=True):
        extreme = cycle.extreme.copy()
        extreme[DRIFT] = extremes(samples[:, :1])[0]
        found.append(replace(cycle, extreme=extreme, traces=samples.astype(np.float32)))
    return found


def _relative_to(zero: DriftZero, peaks: UnsteadyPeaks) -> UnsteadyPeaks:
    """The peaks, which are relative to a `zero` from momentum instead of one at rest."""
    least, mean, greatest = (
        replace(each, readings=replace(each.readings, zero=zero.readings, at_rest=False))
        for each in (peaks.least, peaks.mean, peaks.greatest)
    )
    return replace(peaks, least=least, mean=mean, greatest=greatest)
