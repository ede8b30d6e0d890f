"""Results of several tilts with their uncertainties: restitution, its trend, critical angle and frequency parameter.
The errors of the laser are modelled as follows.

Linearity: a smooth error, size sin(2 pi n x / range + phase), with `size` from the data sheet, and with uniformly
distributed phase and number n of periods within the measuring range; it is common to all tilts. The fitted curvature
absorbs its smooth part. Averaged over the phase, its mean square is that of two components, proportional to sin and cos
- 1 of the displacement from the rest position, each of size / sqrt(2).

Timing: a laser with a free-running clock delays its values by up to one measuring period. The delay grows with the
difference between the clocks and may jump back at any moment of a recording.

Noise and resolution are contained in the residual of a fit, as is a part of the errors of timing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.analysis.free_rocking.fit import ALPHA, BEND_3, START, ZERO, P, R, RockingFit, fit_rocking
from bench.analysis.free_rocking.points import Points, Relation, amplitude_relation, find_points
from bench.analysis.free_rocking.swings import NotRocking, Recording, Swings, find_swings, without_gaps
from bench.analysis.gain import SensorAccuracy
from bench.analysis.uncertainty import mean_of_repeats
from sim import block_face
from sim.free_rocking import critical_angle, frequency_parameter
from sim.specimen import Specimen

Array = NDArray[np.float64]

POOR = 0.2
"""Ratio of the rms residual to the mean peak displacement above which a tilt is rejected.

Impacts whose restitution differs by 1 % cause a ratio of about 0.1.
"""

PUSH = 0.03
"""Relative difference between the fitted and the initial tilt up to which the block counts as released from rest."""


@dataclass(frozen=True, eq=False)
class Tilt:
    """Result of one tilt. The `relation` uses the critical angle from the geometry, while the `fit` identifies it."""

    recording: Recording
    swings: Swings
    points: Points
    relation: Relation
    fit: RockingFit

    @property
    def push(self) -> float:
        """Excess of the tilt of the equivalent release from rest over the initial tilt, relative to the latter."""
        return abs(self.fit.motion.tilt / self.swings.held) - 1.0


def analyse_tilt(recording: Recording, specimen: Specimen, least: float) -> Tilt:
    """Analyse a recording up to the first half swing whose largest angle is below `least` [rad].

    Raises NotRocking, with a remedy, if the recording does not show free rocking.
    """
    alpha = critical_angle(specimen.block)
    recording = without_gaps(recording)
    swings = find_swings(recording, least)
    # the laser's resolution limits the reading at rest, so the motion to both sides gives a better zero
    fit = fit_rocking(
        recording,
        swings,
        find_points(recording, swings, swings.zero),
        alpha,
        frequency_parameter(specimen.block, specimen.g),
    )
    mean = float(abs(recording.height * swings.peaks).mean())
    if fit.rms > POOR * mean:
        raise NotRocking(
            f"the fit of the exact motion leaves an rms residual of {1e3 * fit.rms:.2g} mm, while the mean peak is "
            f"{1e3 * mean:.3g} mm: check that the block rocks on its two edges without yawing or sliding, then "
            "repeat the tilt"
        )
    straight = replace(recording, displacement=fit.straightened(recording.displacement))
    points = find_points(straight, swings, 0.0)
    return Tilt(recording, swings, points, amplitude_relation(points, alpha), fit)


WAVES = (0.5, 3.0)
"""Minimum and maximum number of periods of the linearity error in the measuring range: an error with fewer periods acts
as a scale error, one with more is not smooth.
"""

CLOCK = 50e-6
"""Assumed largest relative difference between the rates of the laser's clock and the sample clock, as of two quartz
clocks.
"""

_NUMBERS, _RATES, _PHASES = 24, 12, 12
"""Numbers of equally likely values over which the errors are averaged: of periods, of clock differences and of initial
delays.
"""


@dataclass(frozen=True, eq=False)
class LaserErrors:
    """Errors of a laser with the specified `accuracy`; `measuring_range` is in m."""

    accuracy: SensorAccuracy
    measuring_range: float

    def linearity(self, fit: RockingFit) -> Array:
        """Shifts of the values and of the trend due to the components of the linearity error, shape (9, components)."""
        return fit.carried(self._components(fit.fitted - fit.values[ZERO]))

    def noise_and_timing(self, fit: RockingFit) -> Array:
        """Standard uncertainties of the values and of the trend due to noise and to the laser's free-running clock,
        shape (2, 9).

        Variances of the residual above those that the clock is expected to leave there are noise. Where they are below,
        the clock has wandered less, and its contribution is smaller in the same proportion.
        """
        delayed = self._delayed(fit)
        found = fit.variances(fit.residual[:, None])[:, 0]
        expected = np.mean(fit.variances(fit.left_by(delayed)), axis=1)
        share = np.minimum(found, expected) / np.maximum(expected, np.finfo(np.float64).tiny)
        timing = share * np.mean(fit.carried(delayed) ** 2, axis=1)
        return np.sqrt(np.array([np.maximum(found - expected, 0.0), timing]))

    def _delayed(self, fit: RockingFit) -> Array:
        """Equally likely errors of the displacement [m] due to the laser's free-running clock, shape (n, k)."""
        longest = self.accuracy.laser_timing
        if longest == 0.0:
            return np.zeros((fit.times.size, 1))
        rate, phase = np.meshgrid(CLOCK / longest * _middles(-1.0, 1.0, _RATES), _middles(0.0, 1.0, _PHASES))
        delay = longest * ((rate.ravel() * fit.times[:, None] + phase.ravel()) % 1.0)
        # a delayed signal is equivalent to a later release
        return fit.jacobian[:, [START]] * delay

    def of_relation(self, relation: Relation, fit: RockingFit) -> Array:
        """Shifts of r, as determined by the amplitude relation, due to the components of the linearity error, shape
        (components,).
        """
        seen = block_face.displacement(relation.angles, fit.height, fit.block)
        rate = block_face.displacement_rate(relation.angles, fit.height, fit.block)
        # the fit has removed the zero and the curvature of this error from the relation's angles
        found = np.column_stack((np.ones(seen.size), seen**2, seen**3)) @ self.linearity(fit)[ZERO : BEND_3 + 1]
        return np.asarray(relation.weights @ ((self._components(seen) - found) / rate[:, None]))

    def _components(self, displacement: Array) -> Array:
        """Components of the error [m], shape (n, components), at displacements from the rest position, shape (n,)."""
        size = self.accuracy.laser_linearity * self.measuring_range / np.sqrt(2.0 * _NUMBERS)
        turned = 2.0 * np.pi / self.measuring_range * displacement[:, None] * _middles(*WAVES, _NUMBERS)
        return size * np.concatenate((np.sin(turned), np.cos(turned) - 1.0), axis=1)


def _middles(low: float, high: float, count: int) -> Array:
    """The midpoints of `count` equal parts of the range from `low` to `high`, shape (count,)."""
    return low + (high - low) * (np.arange(count) + 0.5) / count


@dataclass(frozen=True)
class Combined:
    """A value and the contributions to its standard uncertainty: `noise` and `timing` differ between tilts, `linearity`
    and `scale` are due to the laser, and `scatter` is due to the excess scatter of the tilts, with Student's t.

    `birge` is the ratio of the tilts' scatter to the expected scatter; NaN for a single tilt.
    """

    value: float
    noise: float
    timing: float
    linearity: float
    scale: float
    scatter: float
    birge: float

    @property
    def uncertainty(self) -> float:
        """Combined standard uncertainty."""
        return hypot(self.noise, self.timing, self.linearity, self.scale, self.scatter)

    def parts(self) -> dict[str, float]:
        """Contributions to the standard uncertainty, by name."""
        names = ("noise", "timing", "linearity", "scale", "scatter")
        return {name: float(getattr(self, name)) for name in names}


def combined(values: ArrayLike, noise: ArrayLike, timing: ArrayLike, linearity: Array, scale: float) -> Combined:
    """Mean of n `values`, weighted by their independent standard uncertainties `noise` and `timing`.

    `linearity`, shape (n, components), holds the shifts due to errors common to all values, component by component, and
    `scale` is a common standard uncertainty. Scatter beyond the independent uncertainties increases the uncertainty of
    the mean and makes the weights more equal (`bench.analysis.uncertainty`).
    """
    found, own, wander = (np.asarray(each, dtype=np.float64) for each in (values, noise, timing))
    repeats = mean_of_repeats(found[:, None], (own**2 + wander**2)[:, None])
    weights = repeats.weights[:, 0]
    return Combined(
        value=float(repeats.values[0]),
        noise=float(np.linalg.norm(weights * own)),
        timing=float(np.linalg.norm(weights * wander)),
        linearity=float(np.linalg.norm(weights @ linearity)),
        scale=scale,
        scatter=float(repeats.scatter[0]),
        birge=float(repeats.birge[0]),
    )


_TREND = -1
"""Index of the trend, which follows the values."""


SCATTERED = 2.0
"""Birge ratio of the fits above which the restitution is taken from the amplitudes. A deviating impact shifts the times
of all later impacts, so the error of a fit exceeds the scatter of the impacts; the amplitudes do not accumulate that
error.
"""


@dataclass(frozen=True)
class Findings:
    """Combined results of all tilts: `motion` is the restitution from the fits, `trend` its change with the impact
    speed, and `relation` the restitution from the amplitudes alone.

    `alpha` [rad] and `p` [rad/s] are the identified critical angle and frequency parameter; `impacts` is the number of
    impacts.
    """

    motion: Combined
    trend: Combined
    relation: Combined
    alpha: Combined
    p: Combined
    impacts: int

    @property
    def by_amplitudes(self) -> bool:
        """Whether the impacts differ so much that the amplitudes give the better estimate."""
        return self.motion.birge > SCATTERED

    @property
    def restitution(self) -> Combined:
        """The better of the two estimates of the restitution."""
        return self.relation if self.by_amplitudes else self.motion


def findings(tilts: Sequence[Tilt], laser: LaserErrors, height: float, height_uncertainty: float) -> Findings:
    """Combine the tilts. For a single tilt, the uncertainty has no contribution from the scatter between tilts.

    Errors of the laser beam's `height` [m] and of the laser's scale affect the conversion to an angle. They affect
    alpha fully, the amplitude relation slightly, and r and p, which depend on time, not at all. The error of the sample
    clock affects p.
    """
    fits = [tilt.fit for tilt in tilts]
    linearity = np.array([laser.linearity(fit) for fit in fits])
    noise, timing = np.array([laser.noise_and_timing(fit) for fit in fits]).transpose(1, 0, 2)
    values = np.array([np.append(fit.values, fit.trend) for fit in fits])
    scale = hypot(laser.accuracy.laser_slope, height_uncertainty / height)

    def of(row: int, common: float = 0.0) -> Combined:
        return combined(values[:, row], noise[:, row], timing[:, row], linearity[:, row], common)

    relations = [tilt.relation for tilt in tilts]
    by_scale = np.mean([relation.weights @ relation.angles for relation in relations]) * scale
    return Findings(
        motion=of(R),
        trend=of(_TREND),
        relation=combined(
            [relation.restitution for relation in relations],
            [relation.uncertainty for relation in relations],
            [0.0] * len(relations),
            np.array([laser.of_relation(relation, fit) for relation, fit in zip(relations, fits, strict=True)]),
            abs(float(by_scale)),
        ),
        alpha=of(ALPHA, scale * float(np.mean(values[:, ALPHA]))),
        p=of(P, laser.accuracy.timebase * float(np.mean(values[:, P]))),
        impacts=sum(fit.impacts for fit in fits),
    )


def uncertainties(fit: RockingFit, laser: LaserErrors, height: float, height_uncertainty: float) -> Array:
    """Standard uncertainties of all values of one fit due to noise and the laser's errors, shape (8,)."""
    common = np.zeros(fit.values.size)
    common[ALPHA] = fit.values[ALPHA] * hypot(laser.accuracy.laser_slope, height_uncertainty / height)
    common[P] = fit.values[P] * laser.accuracy.timebase
    shifts = np.column_stack((laser.linearity(fit), laser.noise_and_timing(fit).T))
    return np.hypot(np.linalg.norm(shifts, axis=1)[:-1], common)
