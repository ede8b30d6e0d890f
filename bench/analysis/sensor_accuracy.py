"""Uncertainty of the sensors from data sheets and calibration, and its effect on the peak of a drift.

Two tests share their sensors, so every draw has one pair of lasers for both (GUM Supplement 1): common
errors cancel in the ratio of their drifts to the extent that they are equal.

A laser's linearity error is a smooth curve over its range R, of a few periods and at most `laser_linearity` R: it is
modelled as a sine of unknown phase. The error of a reading relative to a zero is the difference of two of its values.
The slope may therefore have a larger error over small motions than over large ones. For a calibrated laser the curve
applies beyond the covered readings; within them the uncertainty of the calibration applies.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from bench.analysis.laser_calibration import LaserCalibration
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]

WAVES = (0.5, 2.0)
"""Minimum and maximum number of periods of a linearity error within the range."""

LINEARITY, SCALES, TIMING, STEPS = (
    "linearity of the lasers",
    "scales of the lasers",
    "timing of the lasers",
    "steps of the lasers",
)
"""Names of the contributions in a budget."""


class SensorAccuracy(Parameters):
    """Standard uncertainties of the sensors from data sheets and calibrations."""

    laser_slope: float = quantity(
        0.003, "1", "relative error of one laser's slope over its motion (linearity)", ge=0, le=0.1
    )
    laser_mismatch: float = quantity(
        0.001, "1", "relative difference between the scales of the two lasers", ge=0, le=0.1
    )
    laser_resolution: float = quantity(5e-5, "m", "smallest step of a laser's output", ge=0, le=0.01)
    laser_timing: float = quantity(
        2.5e-4, "s", "wander of a laser's delay due to its free clock: one measuring period", ge=0, le=0.01
    )
    laser_linearity: float = quantity(
        0.0008, "1", "largest linearity error of a laser over its range, from its data sheet", ge=0, le=0.05
    )
    table_scale: float = quantity(
        0.005, "1", "relative error of the scales of the table's accelerometer and displacement sensor", ge=0, le=0.1
    )
    timebase: float = quantity(
        3e-5, "1", "relative error of the sample clock: limits of 50 ppm, divided by sqrt(3)", ge=0, le=0.01
    )


@dataclass(frozen=True, eq=False)
class PeakReadings:
    """Readings of both lasers at the peak of a drift, from the rest position of the storeys.

    drift, sign : the peak [m], and its side, 1 or -1. lasers, speeds : reading of each laser [m] and its rate [m/s].
    zero : readings [m] whose mean is the zero of the peak, shape (2, n): (0, 0) for a zero taken at rest. swings : span
    of each laser's readings [m] in the fit of the peak; `terms`: number of independent rounding errors in the peak, 1
    for a mean. at_rest : whether the zero was taken at rest, where the rounding is not averaged.
    """

    drift: float
    sign: float
    lasers: tuple[float, float]
    speeds: tuple[float, float]
    zero: Array
    swings: tuple[float, float]
    terms: float
    at_rest: bool


@dataclass(frozen=True, eq=False)
class SensorUncertainty:
    """Uncertainty of the sensors from data sheets or a calibration.

    `ranges` are the lasers' measuring ranges [m].
    """

    accuracy: SensorAccuracy
    ranges: tuple[float, float]
    calibration: LaserCalibration | None = None

    @property
    def table_scale(self) -> float:
        """Relative standard uncertainty of the scales of the table's sensors."""
        return self.accuracy.table_scale if self.calibration is None else self.calibration.table_uncertainty

    def drift_errors(self, seen: Sequence[PeakReadings], draws: "Draws") -> dict[str, Array]:
        """Errors [m] of the peaks in tests with the same lasers, by contribution, shape (tests, n) each."""
        first, second = (self.linearity(k, seen, draws) for k in range(2))
        errors = {LINEARITY: second - first + self._common(seen, draws)}
        mismatch = self.accuracy.laser_mismatch
        if self.calibration is not None:
            mismatch = self.calibration.differential_uncertainty
        means = np.array([[0.5 * sum(each.lasers) - 0.5 * float(each.zero.mean(axis=1).sum())] for each in seen])
        errors[SCALES] = means * mismatch * draws.normal()
        errors[TIMING] = np.array([self.late(each, 1, draws) - self.late(each, 0, draws) for each in seen])
        errors[STEPS] = np.array([self.steps(each, 0, draws) + self.steps(each, 1, draws) for each in seen])
        sides = np.array([[each.sign] for each in seen])
        return {name: sides * each for name, each in errors.items()}

    def linearity(self, laser: int, seen: Sequence[PeakReadings], draws: "Draws") -> Array:
        """Errors [m] of one laser, 0 or 1, in each test, shape (tests, n)."""
        whole = self.ranges[laser]
        curve = draws.curve(self.accuracy.laser_linearity * whole, whole)
        if self.calibration is None:
            return np.array([curve.between(each.zero[laser], each.lasers[laser]) for each in seen])
        found = self.calibration.lasers[laser]
        low, high = found.lowest - found.rest, found.highest - found.rest
        at, zero = ([each.lasers[laser] for each in seen], [each.zero[laser] for each in seen])
        beyond = np.array([curve.between(np.clip(a, low, high), a) for a in at])
        beyond -= np.array([curve.between(np.clip(z, low, high), z) for z in zero])
        return beyond + found.uncertainty * draws.normal(len(seen))

    def _common(self, seen: Sequence[PeakReadings], draws: "Draws") -> Array | float:
        """Error of the reference sensor of the calibration, common to both lasers [m], shape (tests, n)."""
        if self.calibration is None:
            return 0.0
        curve = draws.curve(self.calibration.common_linearity, min(self.ranges))
        return np.array(
            [curve.between(each.zero[1], each.lasers[1]) - curve.between(each.zero[0], each.lasers[0]) for each in seen]
        )

    def late(self, seen: PeakReadings, laser: int, draws: "Draws") -> Array:
        """Errors [m] due to the delay of a laser with a free clock, uniform within one measuring period; shape (n,)."""
        return seen.speeds[laser] * self.accuracy.laser_timing * draws.uniform(-0.5, 0.5)

    def steps(self, seen: PeakReadings, laser: int, draws: "Draws") -> Array:
        """Errors [m] due to a laser's resolution, shape (n,): averaged rounding errors of the fit, and one rounding
        error of a zero at rest.
        """
        step = self.accuracy.laser_resolution
        if step == 0.0:
            return np.zeros(draws.n)
        variance = seen.terms / (12.0 * (1.0 + 2.0 * seen.swings[laser] / step))
        zero = draws.uniform(-0.5, 0.5) if seen.at_rest else 0.0
        return step * (np.sqrt(variance) * draws.normal() + zero)


class Curve:
    """Smooth curves of a given height [m]: sines of `turns` [rad/m] and `phase` [rad], shape (n,) each."""

    def __init__(self, height: float, turns: Array, phase: Array) -> None:
        self._height, self._turns, self._phase = height, turns, phase

    def between(self, zero: Array, place: Array | float) -> Array:
        """Difference of each curve at `place` and its mean over `zero`, shape (n,); both [m]."""
        return self._mean(np.atleast_1d(place)) - self._mean(np.atleast_1d(zero))

    def _mean(self, places: Array) -> Array:
        return self._height * np.sin(np.outer(places, self._turns) + self._phase).mean(axis=0)


class Draws:
    """`n` draws of sensor errors from one generator, in the order of the calls."""

    def __init__(self, random: np.random.Generator, n: int) -> None:
        self._random, self.n = random, n

    def uniform(self, low: float, high: float) -> Array:
        """Uniform numbers, shape (n,)."""
        return self._random.uniform(low, high, self.n)

    def normal(self, *rows: int) -> Array:
        """Standard normal numbers, shape (*rows, n)."""
        return self._random.standard_normal((*rows, self.n))

    def curve(self, height: float, whole: float) -> Curve:
        """Smooth curves of a given height [m] over `whole` [m]."""
        turns = 2.0 * pi / whole * self.uniform(*WAVES)
        return Curve(height, turns, self.uniform(0.0, 2.0 * pi))


NODES = 24
"""Number of Chebyshev points in the range of WAVES. The mean of exp(i w x) over places x, all within the measuring
range of the zero, is interpolated at w with a relative error of 1e-14.
"""


class InterpolatedCurve(Curve):
    """Curves of `turns` between those of the WAVES over `whole` [m], shared by many peaks.

    The mean of sin(w x + phase) over places x is the imaginary part of exp(i phase) times the mean of exp(i w x). The
    latter is smooth in w: it is computed at a few w and interpolated at those of the draws.
    """

    def __init__(self, height: float, turns: Array, phase: Array, whole: float) -> None:
        super().__init__(height, turns, phase)
        least, most = (2.0 * pi / whole * each for each in WAVES)
        points = np.cos(pi * (np.arange(NODES) + 0.5) / NODES)
        self._at = 0.5 * (least + most) + 0.5 * (most - least) * points
        share = (2.0 * turns - least - most) / (most - least)
        weights = np.linalg.solve(chebvander(points, NODES - 1).T, chebvander(share, NODES - 1).T).T
        self._weights = height * np.hstack((np.sin(phase)[:, None] * weights, np.cos(phase)[:, None] * weights))

    def between(self, zero: Array, place: Array | float) -> Array:
        waves = self._waves(np.atleast_1d(place)) - self._waves(np.atleast_1d(zero))
        return self._weights @ np.concatenate((waves.real, waves.imag))

    def _waves(self, places: Array) -> NDArray[np.complex128]:
        return np.exp(1j * np.outer(self._at, places)).mean(axis=1)


class SharedDraws(Draws):
    """Identical draws for every pair of peaks, made once by a new generator; curves are interpolated."""

    def __init__(self, seed: int, n: int) -> None:
        super().__init__(np.random.default_rng(seed), n)
        self._seed = seed
        self._asked: tuple[tuple[str, tuple[Any, ...]], ...] = ()
        self._kept: dict[object, Array] = {}
        self._curves: dict[object, Curve] = {}

    def again(self) -> "SharedDraws":
        """These draws, restarted from the first one."""
        self._asked = ()
        return self

    def uniform(self, low: float, high: float) -> Array:
        return self._repeated("uniform", low, high, self.n)

    def normal(self, *rows: int) -> Array:
        return self._repeated("standard_normal", (*rows, self.n))

    def curve(self, height: float, whole: float) -> Curve:
        turns, phase = 2.0 * pi / whole * self.uniform(*WAVES), self.uniform(0.0, 2.0 * pi)
        key = self._asked, height, whole
        if key not in self._curves:
            self._curves[key] = InterpolatedCurve(height, turns, phase, whole)
        return self._curves[key]

    def _repeated(self, kind: str, *arguments: Any) -> Array:
        self._asked += ((kind, arguments),)
        if self._asked not in self._kept:
            # a new order of calls: a zero at rest, for example, needs draws that a mean over a cycle does not
            random = np.random.default_rng(self._seed)
            self._kept[self._asked] = [getattr(random, name)(*given) for name, given in self._asked][-1]
        return self._kept[self._asked]
