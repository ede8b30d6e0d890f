"""Steady peaks without the errors of the lasers that the harmonics of the tests reveal.

A known effect is corrected (GUM 3.2.4), and what remains of it is in the uncertainty. In steady tests, errors of lasers
are known from harmonics (`bench.analysis.steady_curves`): during a test with a block from those of the tests of the
bare frame, in the end also from its own.
"""

from dataclasses import dataclass, replace

from bench.analysis.curve_posterior import LaserCurves
from bench.analysis.gain import SteadyPeak
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady_curves import StoreyTest


@dataclass(frozen=True, eq=False)
class Corrected:
    """Corrected peaks of a steady motion with a block and of the `reference` without it, for `sensors` with the errors
    found.
    """

    peak: SteadyPeak
    reference: SteadyPeak
    sensors: SensorUncertainty


def corrected(
    peak: SteadyPeak, reference: SteadyPeak, sensors: SensorUncertainty, frame: LinearFrame, omega: float
) -> Corrected | None:
    """The peak of fitted cycles at `omega` [rad/s] of a `frame` with a block, corrected as its `reference` is. None for
    the peak of single cycles, for calibrated lasers, and without a check of the lasers.
    """
    if not peak.used or peak.readings.weights is None:
        return None
    test = StoreyTest.of(peak.used, omega, frame, sensors.accuracy)
    found = sensors.found_by_harmonics(test, (peak.readings, reference.readings))
    if found.curves is None:
        return None
    return Corrected(without_errors(peak, found.curves), without_errors(reference, found.curves), found)


def without_errors(peak: SteadyPeak, curves: LaserCurves) -> SteadyPeak:
    """A peak without the expected errors of its readings."""
    first, second = (peak.readings.effect(laser) for laser in (0, 1))
    error = second.weights @ curves.expected(1, second.places) - first.weights @ curves.expected(0, first.places)
    drift = peak.drift - peak.readings.sign * float(error)
    return replace(peak, drift=drift, readings=replace(peak.readings, drift=drift))
