"""What several tilts come to: restitution and trend, slenderness and size, each with the parts of its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.analysis.birge import mean_of_repeats
from bench.analysis.free_rocking.fit import ALPHA, P, R, RockingFit
from bench.analysis.free_rocking.laser_errors import LaserErrors
from bench.analysis.free_rocking.tilt import Tilt

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Combined:
    """A value and its standard uncertainty with its parts: `noise` and `timing` differ between tilts, `linearity` and
    `scale` are the laser's own, `scatter` is what the tilts differ by beyond the first two, Student's t counted.

    `birge` is the ratio of the tilts' scatter to what is expected; NaN for a single tilt.
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
        """Standard uncertainty."""
        return hypot(self.noise, self.timing, self.linearity, self.scale, self.scatter)

    def parts(self) -> dict[str, float]:
        """The parts of the standard uncertainty."""
        names = ("noise", "timing", "linearity", "scale", "scatter")
        return {name: float(getattr(self, name)) for name in names}


def combined(values: ArrayLike, noise: ArrayLike, timing: ArrayLike, linearity: Array, scale: float) -> Combined:
    """Mean of n `values`, weighted by what is independent between them: standard uncertainties `noise` and `timing`.

    `linearity`, shape (n, components), are changes by errors that all values have in common, component by component,
    and `scale` is a standard uncertainty that they have in common. What the values scatter beyond their independent
    uncertainties widens the result and makes the weights more equal (`bench.analysis.birge`).
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
"""Row of the trend, after the six values."""


SCATTERED = 2.0
"""Birge ratio of the fits above which the amplitudes tell the restitution. A fit takes every impact after one that
differs from the others for too early or too late, so it errs by more than the impacts differ; amplitudes forget."""


@dataclass(frozen=True)
class Findings:
    """`motion` is the restitution of the fits and `trend` its change, `relation` that of the amplitudes alone.

    `alpha` [rad] and `p` [rad/s] are the critical angle and the frequency parameter that the motion shows.
    """

    motion: Combined
    trend: Combined
    relation: Combined
    alpha: Combined
    p: Combined
    impacts: int

    @property
    def by_amplitudes(self) -> bool:
        """Whether impacts differ so much that the amplitudes tell the restitution better."""
        return self.motion.birge > SCATTERED

    @property
    def restitution(self) -> Combined:
        """The restitution by the better of the two estimators."""
        return self.relation if self.by_amplitudes else self.motion


def findings(tilts: Sequence[Tilt], laser: LaserErrors, height: float, height_uncertainty: float) -> Findings:
    """The tilts together; one alone, with what it leaves as its only scatter.

    `height` of the beam [m] and its standard uncertainty make an angle of the displacement, as the laser's scale does:
    alpha has all of it; r and p, which time tells, have none. The amplitude relation has little of it. p has that of
    the clock which times the samples.
    """
    fits = [tilt.fit for tilt in tilts]
    linearity = np.array([laser.linearity(fit) for fit in fits])
    timing = np.array([laser.timing(fit) for fit in fits])
    noise = np.array([np.append(np.sqrt(np.diag(fit.covariance)), fit.trend_uncertainty) for fit in fits])
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
    """Standard uncertainties of all values of one fit, noise and all that the laser may have got wrong, shape (8,)."""
    common = np.zeros(fit.values.size)
    common[ALPHA] = fit.values[ALPHA] * hypot(laser.accuracy.laser_slope, height_uncertainty / height)
    common[P] = fit.values[P] * laser.accuracy.timebase
    carried = np.linalg.norm(laser.linearity(fit), axis=1) ** 2 + laser.timing(fit) ** 2
    return np.sqrt(np.diag(fit.covariance) + carried[:-1] + common**2)
