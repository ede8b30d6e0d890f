"""What the sensors' data sheets leave open, and what it comes to where a drift was greatest.

Two tests share their sensors, so every draw has one pair of lasers for both (GUM Supplement 1): what is off alike in
both cancels in the ratio of their drifts, in whatever share it does.

A laser's linearity error is a smooth curve over its range R, with a few waves and at most `laser_linearity` R high: a
sine of unknown phase stands for it. A reading that is counted from a zero is off by the difference of two of its
values. So the slope over small motions may be off by more than over large ones. Where a laser was calibrated, the curve
counts beyond the readings that were covered; within them only what the calibration leaves open does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from bench.analysis.laser_calibration import LaserCalibration
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]

WAVES = (0.5, 2.0)
"""How many waves a linearity error may have within the range."""

LINEARITY, SCALES, TIMING, STEPS = (
    "linearity of the lasers",
    "scales of the lasers",
    "timing of the lasers",
    "steps of the lasers",
)
"""The contributions, as a budget names them."""


class SensorAccuracy(Parameters):
    """What the sensors' data sheets and calibrations leave open: standard uncertainties."""

    laser_slope: float = quantity(
        0.003, "1", "relative error of one laser's slope over the motion it sees (linearity)", ge=0, le=0.1
    )
    laser_mismatch: float = quantity(
        0.001, "1", "relative difference between the scales of the two lasers", ge=0, le=0.1
    )
    laser_resolution: float = quantity(5e-5, "m", "smallest step of a laser's output", ge=0, le=0.01)
    laser_timing: float = quantity(
        2.5e-4, "s", "how far a laser's delay wanders because it runs free: one of its measurements", ge=0, le=0.01
    )
    laser_linearity: float = quantity(
        0.0008, "1", "largest linearity error of a laser over its measuring range, as on its data sheet", ge=0, le=0.05
    )
    table_scale: float = quantity(
        0.005, "1", "relative error of the scales of the table's accelerometer and displacement sensor", ge=0, le=0.1
    )
    timebase: float = quantity(
        3e-5, "1", "relative error of the clock that times the samples: 50 ppm as limits, over root 3", ge=0, le=0.01
    )


@dataclass(frozen=True, eq=False)
class Sighting:
    """What both lasers showed when the magnitude of a drift was greatest, from where the storeys rest.

    drift, sign : the peak [m], and its side, 1 or -1.
    lasers, speeds : what each laser showed [m], and how fast that changed [m/s].
    zero : readings [m] whose mean is the zero that the peak is counted from, shape (2, n): (0, 0) for a zero at rest.
    swings : how far each laser moved [m] within what was fitted for the peak, and `terms` how many rounding errors of
    samples scattered over it the peak takes: 1 for a mean.
    at_rest : whether the zero was taken at rest, where nothing averages the rounding.
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
class SensorDoubt:
    """All that is left open of the sensors: by their data sheets alone, or by a calibration where there is one.

    `ranges` are the lasers' measuring ranges [m].
    """

    accuracy: SensorAccuracy
    ranges: tuple[float, float]
    calibration: LaserCalibration | None = None

    @property
    def table_scale(self) -> float:
        """Standard relative uncertainty of the scales of the table's sensors."""
        return self.accuracy.table_scale if self.calibration is None else self.calibration.table_uncertainty

    def drift_errors(self, seen: Sequence[Sighting], random: np.random.Generator, n: int) -> dict[str, Array]:
        """Errors [m] of the peaks of tests with the same lasers, by contribution, shape (tests, n) each."""
        first, second = (self.linearity(k, seen, random, n) for k in range(2))
        errors = {LINEARITY: second - first + self._common(seen, random, n)}
        mismatch = self.accuracy.laser_mismatch
        if self.calibration is not None:
            mismatch = self.calibration.differential_uncertainty
        means = np.array([[0.5 * sum(each.lasers) - 0.5 * float(each.zero.mean(axis=1).sum())] for each in seen])
        errors[SCALES] = means * mismatch * random.standard_normal(n)
        errors[TIMING] = np.array([self.late(each, 1, random, n) - self.late(each, 0, random, n) for each in seen])
        errors[STEPS] = np.array([self.steps(each, 0, random, n) + self.steps(each, 1, random, n) for each in seen])
        sides = np.array([[each.sign] for each in seen])
        return {name: sides * each for name, each in errors.items()}

    def linearity(self, laser: int, seen: Sequence[Sighting], random: np.random.Generator, n: int) -> Array:
        """Errors [m] of what one laser, 0 or 1, showed in each test, shape (tests, n)."""
        whole = self.ranges[laser]
        curve = _Curve(self.accuracy.laser_linearity * whole, whole, random, n)
        if self.calibration is None:
            return np.array([curve.between(each.zero[laser], each.lasers[laser]) for each in seen])
        found = self.calibration.lasers[laser]
        low, high = found.lowest - found.rest, found.highest - found.rest
        at, zero = ([each.lasers[laser] for each in seen], [each.zero[laser] for each in seen])
        beyond = np.array([curve.between(np.clip(a, low, high), a) for a in at])
        beyond -= np.array([curve.between(np.clip(z, low, high), z) for z in zero])
        return beyond + found.uncertainty * random.standard_normal((len(seen), n))

    def _common(self, seen: Sequence[Sighting], random: np.random.Generator, n: int) -> Array | float:
        """What both lasers took from the sensor that they were calibrated against [m], shape (tests, n)."""
        if self.calibration is None:
            return 0.0
        curve = _Curve(self.calibration.common_linearity, min(self.ranges), random, n)
        return np.array(
            [curve.between(each.zero[1], each.lasers[1]) - curve.between(each.zero[0], each.lasers[0]) for each in seen]
        )

    def late(self, seen: Sighting, laser: int, random: np.random.Generator, n: int) -> Array:
        """Errors [m] by how late a free-running laser is: somewhere within one of its measurements; shape (n,)."""
        return seen.speeds[laser] * self.accuracy.laser_timing * random.uniform(-0.5, 0.5, n)

    def steps(self, seen: Sighting, laser: int, random: np.random.Generator, n: int) -> Array:
        """Errors [m] from a laser's steps, shape (n,): of the fit, the roundings of the steps that were passed; and of
        a zero at rest, one rounding.
        """
        step = self.accuracy.laser_resolution
        if step == 0.0:
            return np.zeros(n)
        variance = seen.terms / (12.0 * (1.0 + 2.0 * seen.swings[laser] / step))
        zero = random.uniform(-0.5, 0.5, n) if seen.at_rest else 0.0
        return step * (np.sqrt(variance) * random.standard_normal(n) + zero)


class _Curve:
    """Smooth curves of a given height [m] over `whole` [m], `n` of them."""

    def __init__(self, height: float, whole: float, random: np.random.Generator, n: int) -> None:
        self._height = height
        self._turns = 2.0 * pi / whole * random.uniform(*WAVES, n)
        self._phase = random.uniform(0.0, 2.0 * pi, n)

    def between(self, zero: Array, place: Array | float) -> Array:
        """By how much each curve is higher at `place` than in the mean over `zero`, shape (n,); both [m]."""
        return self._mean(np.atleast_1d(place)) - self._mean(np.atleast_1d(zero))

    def _mean(self, places: Array) -> Array:
        return self._height * np.sin(np.outer(places, self._turns) + self._phase).mean(axis=0)
