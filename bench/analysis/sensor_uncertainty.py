"""Uncertainty of the sensors from data sheets and calibration, and its effect on the peak of a drift.

Two tests use the same sensors, so every draw has the same pair of lasers for both tests (GUM Supplement 1): common
errors cancel in the ratio of their drifts to the extent that they are equal.

The shape of a laser's linearity error is unknown (`bench.analysis.linearity`); the test of the bare frame checks it, or
the motions of a record reveal it (`bench.analysis.laser_curves`).
For a calibrated laser, the uncertainty of the calibration applies to the covered readings. Beyond them, corrected
readings have the uncertainty of the continued curve, and others that of the data sheet.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.bare_harmonics import Both
from bench.analysis.curve_posterior import LaserCurves
from bench.analysis.draws import Draws
from bench.analysis.error_curve import CAUTION, Checks, Harmonics, widest
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.laser_curves import laser_curves
from bench.analysis.linearity import SMOOTH, Effect, LinearFrame, LinearityErrors, linearity_errors
from bench.analysis.output_errors import late, steps
from bench.analysis.peak_readings import PeakReadings, Shapes, beyond, shares_of
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.steady_curves import StoreyTest, bare_curves, steady_curves

Array = NDArray[np.float64]

EXCESS = 1.5
"""Ratio to the data sheet above which a linearity error that was found is remarked on: the straight line of least
squares is not the one with the smallest error.
"""

LINEARITY, SCALES, TIMING, STEPS = (
    "linearity of the lasers",
    "scales of the lasers",
    "timing of the lasers",
    "steps of the lasers",
)
"""Names of the contributions in a budget."""


@dataclass(frozen=True, eq=False)
class SensorUncertainty:
    """Uncertainty of the sensors from data sheets or a calibration.

    `ranges` are the lasers' measuring ranges [m]; `checks` are the harmonics of their readings in tests of the bare
    frame; `corrected` states whether the readings are corrected for the errors that the checks, or the calibration
    beyond its readings, lead to expect (`bench.analysis.reading_correction`). `curves` are errors found in the tests
    themselves, which replace the checks and the data sheet.
    """

    accuracy: SensorAccuracy
    ranges: tuple[float, float]
    calibration: LaserCalibration | None = None
    checks: tuple[Checks, ...] = ()
    corrected: bool = False
    curves: LaserCurves | None = None

    @property
    def table_scale(self) -> float:
        """Relative standard uncertainty of the scales of the table's sensors."""
        return self.accuracy.table_scale if self.calibration is None else self.calibration.table_uncertainty

    @property
    def mismatch(self) -> float:
        """Standard uncertainty of the ratio of the lasers' scales."""
        return self.accuracy.laser_mismatch if self.calibration is None else self.calibration.differential_uncertainty

    @property
    def shapes_known(self) -> bool:
        """Whether the shapes of the lasers' linearity errors were calibrated, checked or found."""
        return self.calibration is not None or self.curves is not None or bool(self.checks)

    def linearity_amplitude(self, laser: int, displacements: Array) -> float:
        """Amplitude [m] of the linearity error of laser 0 or 1 at `displacements` from rest [m], NaN where missing.

        If a calibration covers all of them, it is that of a sine wave with the standard uncertainty of the calibration,
        and of the error of its reference sensor; otherwise that of the data sheet.
        """
        limit = self.accuracy.laser_linearity * self.ranges[laser]
        if self.calibration is None:
            return limit
        found = self.calibration.lasers[laser]
        if not found.covers(displacements):
            return limit
        return min(limit, hypot(sqrt(2.0) * found.uncertainty, self.calibration.common_linearity))

    def checked_by(self, checks: Checks | None) -> "SensorUncertainty":
        """A copy with `checks` from one test of the bare frame; the same object if it already has checks or `checks` is
        None.
        """
        return self if self.checks or checks is None else replace(self, checks=(checks,))

    def corrected_by(self, checks: Checks | None) -> "SensorUncertainty":
        """A copy for corrected readings, with `checks` from one test of the bare frame or none. The same object if
        there is neither a check nor a calibration.
        """
        if checks is None and self.calibration is None:
            return self
        return replace(self, checks=() if checks is None else (checks,), corrected=True)

    def found_in(
        self,
        tests: Sequence[Array],
        frame: LinearFrame,
        sample_rate: float,
        block: float,
        caution: float = CAUTION,
        *,
        checked: bool = False,
    ) -> "SensorUncertainty":
        """A copy for readings corrected for the errors that the signals of `tests` reveal, with residuals that may be
        correlated for `block` seconds (`bench.analysis.laser_curves`); the same object if `block` is zero, or if the
        tests reveal none. What is left of the errors of calibrated lasers, also beyond the calibrated readings, is
        found in the same way. Possible shapes are weighted by the power `caution` of their evidence; `checked` states
        whether the checks contribute.
        """
        if not block:
            return self
        first, second = (self.accuracy.laser_linearity * whole for whole in self.ranges)
        checks = self._evaluated if checked else ((), ())
        limits = first, second
        curves = laser_curves(tests, frame, sample_rate, limits, self.ranges, self.mismatch, block, caution, checks)
        return self if curves is None else replace(self, checks=(), corrected=True, curves=curves)

    def found_by_harmonics(
        self, test: StoreyTest | None = None, seen: Sequence[PeakReadings] = ()
    ) -> "SensorUncertainty":
        """A copy for steady peaks corrected for the errors that the checks reveal (`bench.analysis.steady_curves`), for
        any reading; or those that the second storey in a `test` reveals as well, for its readings, those of the checks
        and the ones `seen`. The same object without checks, and for calibrated lasers.
        """
        if self.calibration is not None or not self.checks:
            return self
        first, second = (self.accuracy.laser_linearity * whole for whole in self.ranges)
        limits, checks = (first, second), self._evaluated
        if test is None:
            curves = bare_curves(checks, limits, self.ranges, self.mismatch)
        else:
            one, other = (np.concatenate([[0.0], *(each.effect(laser).places for each in seen)]) for laser in (0, 1))
            curves = steady_curves(checks, test, limits, self.ranges, self.mismatch, (one, other))
        return self if curves is None else replace(self, checks=(), corrected=True, curves=curves)

    @property
    def _evaluated(self) -> Both:
        return tuple(self.checks_of(0)), tuple(self.checks_of(1))

    def checks_of(self, laser: int) -> list[Harmonics]:
        """The checks of laser 0 or 1 that are evaluated, with the uncertainty due to its resolution."""
        step = self.accuracy.laser_resolution
        return [each.rounded(step) for each in widest([both[laser] for both in self.checks])]

    def drift_errors(
        self, seen: Sequence[PeakReadings], draws: Draws, shapes: Shapes | None = None
    ) -> dict[str, Array]:
        """Errors [m] of the peaks in tests with the same lasers, by contribution, shape (tests, n) each.

        `shapes` are the linearity errors of `seen`, or of motions that hardly differ; by default they are
        computed.
        """
        if self.curves is not None:
            # the difference between the scales is one of the errors found
            effects = [(each.effect(0).reversed, each.effect(1)) for each in seen]
            errors = {LINEARITY: self.curves.errors(effects).draws(draws.normal(len(seen)))}
        else:
            errors = self._shaped(seen, draws, self.shapes(seen) if shapes is None else shapes)
        errors[TIMING] = np.array(
            [late(each, 1, self.accuracy, draws) - late(each, 0, self.accuracy, draws) for each in seen]
        )
        errors[STEPS] = np.array(
            [steps(each, 0, self.accuracy, draws) + steps(each, 1, self.accuracy, draws) for each in seen]
        )
        sides = np.array([[each.sign] for each in seen])
        return {name: sides * each for name, each in errors.items()}

    def _shaped(self, seen: Sequence[PeakReadings], draws: Draws, shapes: Shapes) -> dict[str, Array]:
        """Errors [m] due to linearity, according to `shapes`, and due to the difference between the scales."""
        first, second = (self._linearity(laser, shapes.lasers[laser], seen, draws) for laser in (0, 1))
        common = 0.0 if shapes.common is None else shapes.common.draws(draws.normal(len(seen)))
        means = np.array(
            [[0.5 * sum(each.lasers) - 0.5 * each.sides * float(each.zero.mean(axis=1).sum())] for each in seen]
        )
        return {LINEARITY: second - first + common, SCALES: means * self.mismatch * draws.normal()}

    def linearity(self, laser: int, seen: Sequence[PeakReadings], draws: Draws) -> Array:
        """Errors [m] of the peaks due to the linearity of laser 0 or 1, in each test, shape (tests, n)."""
        if self.curves is not None:
            effects = [each.effect(laser) for each in seen]
            pairs = [(effect, None) if laser == 0 else (None, effect) for effect in effects]
            return self.curves.errors(pairs).draws(draws.normal(len(seen)))
        return self._linearity(laser, self._shape(laser, seen), seen, draws)

    def u1_linearity(self, seen: Sequence[PeakReadings], table: Sequence[float], draws: Draws) -> Array:
        """Errors [m] of the peaks of u1 due to the linearity of laser 0 and, if it is calibrated, of the calibration's
        reference sensor, shape (tests, n). The reference sensor also measures the displacements `table` [m] at the
        peaks, which are zero if the lasers are on the table.
        """
        errors = self.linearity(0, seen, draws)
        # errors that were found contain that of the reference sensor in the lasers
        read = [(0.0 if self.curves is not None else each.lasers[0], x) for each, x in zip(seen, table, strict=True)]
        effects = [Effect(np.array(both), np.array([1.0, -1.0])) for both in read]
        common = self._common(effects, shares_of(seen))
        return errors if common is None else errors + common.draws(draws.normal(len(seen)))

    def _linearity(
        self, laser: int, shape: LinearityErrors | None, seen: Sequence[PeakReadings], draws: Draws
    ) -> Array:
        normal = draws.normal(len(seen))
        if self.calibration is None:
            assert shape is not None
            return shape.draws(normal)
        # a zero at rest has the error of the curve there; that of a cycle is its mean, which the calibration removes
        readings = np.array([[2.0 if each.at_rest else 1.0] for each in seen])
        errors = np.sqrt(readings) * self.calibration.lasers[laser].uncertainty * draws.normal(len(seen))
        return errors if shape is None else errors + shape.draws(normal)

    def shapes(self, seen: Sequence[PeakReadings]) -> Shapes:
        """Errors of the peaks due to the unknown shapes of the linearity errors; none if the curves were found."""
        if self.curves is not None:
            return Shapes((None, None))
        lasers = self._shape(0, seen), self._shape(1, seen)
        if self.calibration is None:
            return Shapes(lasers)
        effects = list[Effect]()
        for each in seen:
            first, second = each.effect(0), each.effect(1)
            places = np.append(first.places, second.places)
            effects.append(Effect(places, np.append(-first.weights, second.weights)))
        return Shapes(lasers, self._common(effects, shares_of(seen)))

    def _shape(self, laser: int, seen: Sequence[PeakReadings]) -> LinearityErrors | None:
        """Linearity errors of laser 0 or 1; for a calibrated laser, only those outside the calibrated range, None if no
        reading is outside it.
        """
        whole = self.ranges[laser]
        limit = self.accuracy.laser_linearity * whole
        effects = [each.effect(laser) for each in seen]
        if self.calibration is None:
            return linearity_errors(effects, shares_of(seen), limit, whole, self.checks_of(laser), self.corrected)
        found = self.calibration.lasers[laser]
        low, high = found.lowest - found.rest, found.highest - found.rest
        outside = [beyond(each, low, high) for each in effects]
        if not any(each.weights.size for each in outside):
            return None
        checks = [found.harmonics] if self.corrected else []
        return linearity_errors(outside, shares_of(seen), limit, whole, checks, self.corrected)

    def rough(self, shapes: Shapes) -> tuple[str, ...]:
        """Remark on each laser whose linearity error, according to the tests of the bare frame, is not smooth, or as
        found in the tests themselves is larger than its data sheet states.
        """
        if self.curves is not None:
            limits = [self.accuracy.laser_linearity * whole for whole in self.ranges]
            bends = [self.curves.bend(laser) for laser in (0, 1)]
            again = "measure it with" if self.calibration is None else "repeat"
            return tuple(
                f"the linearity error of laser_{laser} is {1e3 * bend:.2f} mm; its data sheet allows {1e3 * limit:.2f} "
                f"mm (analysis.laser_linearity): check its mount, or {again} `rockbench run laser-calibration`"
                for laser, (bend, limit) in enumerate(zip(bends, limits, strict=True), 1)
                if bend > EXCESS * limit
            )
        if self.calibration is not None or not self.checks or self.accuracy.laser_linearity == 0.0:
            return ()
        return tuple(
            f"the linearity error of laser_{laser} is not smooth: it has about {each.waves:.1f} waves over the range, "
            "which `rockbench run laser-calibration` measures"
            for laser, each in enumerate(shapes.lasers, 1)
            if each is not None and each.waves > SMOOTH
        )

    def _common(self, effects: Sequence[Effect], shares: Array) -> LinearityErrors | None:
        """Errors due to the reference sensor of the calibration, whose error curve is common to both lasers; None
        without a calibration. For `shares` see `linearity_errors`.
        """
        if self.calibration is None:
            return None
        # the harmonics that remain in the corrected readings of the bare frame check the reference sensor
        kept = [self.checks_of(laser) for laser in (0, 1)]
        checks = [
            each.with_uncertainty(curve.uncertainty)
            for test in zip(*kept, strict=True)
            for each, curve in zip(test, self.calibration.lasers, strict=True)
        ]
        limit = self.calibration.common_linearity
        return linearity_errors(effects, shares, limit, min(self.ranges), checks)
