"""Fit of the exact nonlinear motion to the laser signal, from shortly after the release to the last usable impact.

Six values describe the motion: alpha, p and r of `sim.free_rocking`, the tilt (as a fraction of alpha) and instant of
an equivalent release from rest, and the laser's reading when the block is at rest. A release by hand is neither
instantaneous nor free of a push: tilt and instant account for its energy and phase, and the samples until the block is
free are excluded. Two more describe the laser: at the displacement D its reading is D + c_2 D^2 + c_3 D^3, which
includes the smooth part of its linearity error. The laser's scale is not fitted: a scale factor s multiplies alpha and
tilt by s and does not affect r and p, which depend on the times of the impacts.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.points import AFTER, BEFORE, Points
from bench.analysis.free_rocking.swings import NotRocking, Recording, Swings
from sim import block_face
from sim.free_rocking import FreeRocking, energy
from sim.specimen import Block

Array = NDArray[np.float64]

NAMES = ("alpha", "p", "restitution", "share", "start", "zero", "bend_2", "bend_3")
ALPHA, P, R, SHARE, START, ZERO, BEND_2, BEND_3 = range(len(NAMES))

FREE = 0.9
"""Fraction of the initial tilt below which the block counts as released."""

FEWEST = 12
"""Minimum number of impacts for a fit."""

_RATE = 250.0
"""Approximate sample rate of the fit [1/s], to which the laser's samples are averaged."""

_IMPACT, _ANGLE = 1e-4, 1e-4
"""Standard uncertainties of single impacts [s] and turning points [rad] in the preliminary fit."""

_STEP = 1e-5
"""Step of the finite difference with respect to the trend."""


@dataclass(frozen=True, eq=False)
class RockingFit:
    """Result of a fit: `values`, shape (8,), in the order of `NAMES`, in SI units, for `block` measured at `height`
    [m].

    `times` [s], `displacement` [m] and `swing` (the number of earlier impacts), all of shape (n,), are the data,
    `fitted` [m] is the displacement of the model; `jacobian`, shape (n, 9), holds the derivatives with respect to the
    values and, last, to the trend of r with impact velocity about its mean.
    """

    values: Array
    block: Block
    height: float
    times: Array
    displacement: Array
    swing: NDArray[np.intp]
    fitted: Array
    jacobian: Array

    @property
    def motion(self) -> FreeRocking:
        """The fitted motion, which begins on the side of the recorded tilt."""
        return _motion(self.values, float(np.sign((self.displacement - self.values[ZERO])[0])))

    @property
    def residual(self) -> Array:
        """Residual of the fit, measured minus fitted displacement [m], shape (n,)."""
        return self.displacement - self.fitted

    @property
    def rms(self) -> float:
        """Root mean square residual [m]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def impacts(self) -> int:
        """Number of impacts within the fitted data, including the impact at the end of the data."""
        return int(self.swing[-1]) + 1

    @cached_property
    def gain(self) -> Array:
        """Sensitivities of the values to errors of the displacement, shape (8, n) [unit/m]."""
        return np.asarray(np.linalg.pinv(self.jacobian[:, :-1]), dtype=np.float64)

    @cached_property
    def trend_gain(self) -> Array:
        """Sensitivity of the trend, which is fitted jointly with the values, to errors of the displacement, shape (n,)
        [1/m].
        """
        return np.asarray(np.linalg.pinv(self.jacobian)[-1], dtype=np.float64)

    @property
    def trend(self) -> float:
        """Change of r from zero impact speed to that of a fall from alpha, by one linearised step from zero trend."""
        return float(self.trend_gain @ self.residual)

    def carried(self, errors: Array) -> Array:
        """Changes of values and trend, shape (9, k), due to `errors` of the displacement [m], shape (n, k)."""
        return np.vstack((self.gain @ errors, self.trend_gain @ errors))

    def variances(self, residuals: Array) -> Array:
        """Variances of the values and of the trend, shape (9, k), due to errors that leave `residuals` [m], shape (n,
        k), and are correlated only within a half swing: the cluster sum of Liang and Zeger (1986), with the usual
        factor for few clusters.
        """
        starts = np.flatnonzero(np.diff(self.swing, prepend=-1))
        gains = np.vstack((self.gain, self.trend_gain))
        sums = np.array([np.add.reduceat(gain[:, None] * residuals, starts, axis=0) for gain in gains])
        count, parameters = starts.size, len(NAMES)
        return np.sum(sums**2, axis=1) * (count / (count - parameters))

    def left_by(self, errors: Array) -> Array:
        """Residuals that `errors` of the displacement [m] leave, both of shape (n, k)."""
        return errors - self.jacobian[:, :-1] @ (self.gain @ errors)

    def straightened(self, displacement: Array) -> Array:
        """A laser signal [m], any shape, relative to its value for the block at rest and without the fitted
        curvature.
        """
        seen = displacement - self.values[ZERO]
        return seen - self.values[BEND_2] * seen**2 - self.values[BEND_3] * seen**3


def fit_rocking(seen: Recording, swings: Swings, points: Points, alpha: float, p: float) -> RockingFit:
    """Fit the motion, starting from the geometry's `alpha` [rad] and `p` [rad/s].

    Raises NotRocking if there are too few impacts, or if no motion of a rocking block fits.
    """
    size = max(round(seen.sample_rate / _RATE), 1)
    times, displacement = _block_means(seen.times, size), _block_means(seen.displacement, size)
    # mean over a bin = value at the centre of the bin + spread * second derivative
    spread = (size**2 - 1) / (24.0 * seen.sample_rate**2)
    swing = np.searchsorted(swings.crossings, times)
    since = times - np.append(-np.inf, swings.crossings)[swing]
    until = np.append(swings.crossings, np.inf)[swing] - times
    used = (times > _freed(seen, swings)) & (swing < swings.crossings.size) & (since > AFTER) & (until > BEFORE)
    times, displacement, swing = times[used], displacement[used], swing[used]
    side = float(np.sign(swings.held))

    def model(values: Array, trend: tuple[float, float] = (0.0, 0.0)) -> Array:
        motion = _motion(values, side, *trend)
        angle = motion.angle(times)
        moved = block_face.displacement(angle, seen.height, seen.block)
        moved += spread * block_face.displacement_rate(angle, seen.height, seen.block) * motion.acceleration(angle)
        return values[ZERO] + moved + values[BEND_2] * moved**2 + values[BEND_3] * moved**3

    scale = np.array([alpha, p, 1.0, 1.0, 0.1, 1e-3, 0.1, 10.0])

    def misfit(x: Array) -> Array:
        return model(x * scale) - displacement

    lowest, highest = _bounds(alpha, p)
    found = _least_squares(misfit, _from_points(swings, points, alpha, p) / scale, lowest / scale, highest / scale)
    values = np.asarray(found.x) * scale
    fitted, speed = model(values), float(np.mean(np.sqrt(_motion(values, side).energies[: swings.crossings.size])))
    trend = (model(values, (_STEP, speed)) - fitted) / _STEP
    jacobian = np.column_stack((np.asarray(found.jac) / scale, trend))
    return RockingFit(values, seen.block, seen.height, times, displacement, swing, fitted, jacobian)


def _motion(values: Array, side: float, trend: float = 0.0, trend_at: float = 0.0) -> FreeRocking:
    alpha, p, r, share, start = (float(value) for value in values[:ZERO])
    return FreeRocking(alpha, p, r, side * share * alpha, start, trend, trend_at)


def _freed(seen: Recording, swings: Swings) -> float:
    """Time [s] after which the block is free; until then, the operator's hand may still disturb it."""
    before = seen.angle(swings.zero)[: int(swings.crossings[0] * seen.sample_rate)]
    return float(np.flatnonzero(np.abs(before) >= FREE * abs(swings.held))[-1]) / seen.sample_rate


def _block_means(samples: Array, size: int) -> Array:
    """Means of `size` consecutive samples each."""
    return samples[: samples.size // size * size].reshape(-1, size).mean(axis=1)


def _bounds(alpha: float, p: float) -> tuple[Array, Array]:
    """Lower and upper bounds of the values: alpha and p within a factor of two of those from the geometry, r and the
    ratio of tilt to alpha within the range in which a motion exists; the other bounds are wide.
    """
    lowest = np.array([0.5 * alpha, 0.5 * p, 0.05, 1e-3, -1e4, -1.0, -10.0, -1e3])
    return lowest, np.array([2.0 * alpha, 2.0 * p, 0.9999, 0.999, 1e4, 1.0, 10.0, 1e3])


def _from_points(swings: Swings, points: Points, alpha: float, p: float) -> Array:
    """Initial values: the motion closest to the estimated impacts and turning points."""
    known = np.isfinite(points.impacts) & np.isfinite(points.amplitudes)
    count = known.size if known.all() else int(np.argmin(known))
    if count < FEWEST:
        few = f"number of sufficiently large impacts: {count}, at least {FEWEST} required"
        raise NotRocking(f"{few}; tilt the block farther, or mount the laser higher")
    instants, sizes = points.impacts[:count], np.abs(points.amplitudes[:count])
    side = float(np.sign(swings.held))
    left = np.log(energy(np.minimum(sizes, 0.99 * alpha), alpha))
    r = float(np.clip(np.exp(0.5 * np.polyfit(np.arange(count), left, 1)[0]), 0.06, 0.999))
    share = float(np.clip(abs(swings.held) / alpha, 2e-3, 0.98))
    fall = FreeRocking(alpha, p, r, share * alpha).impacts[0]

    def misfit(x: Array) -> Array:
        motion = _motion(np.append(x, 0.0), side)
        if motion.impacts.size <= count:
            return np.full(2 * count, 1e3)
        late = (motion.impacts[:count] - instants) / _IMPACT
        return np.concatenate((late, (motion.amplitudes[1 : count + 1] - sizes) / _ANGLE))

    lowest, highest = _bounds(alpha, p)
    guess = np.array([alpha, p, r, share, instants[0] - fall])
    found = _least_squares(misfit, guess, lowest[:ZERO], highest[:ZERO])
    return np.concatenate((np.asarray(found.x), [swings.zero, 0.0, 0.0]))


def _least_squares(function: Callable[[Array], Array], start: Array, lowest: Array, highest: Array) -> Any:
    from scipy.optimize import least_squares

    found: Any = least_squares(function, start, bounds=(lowest, highest), x_scale="jac", max_nfev=60)
    if not found.success:
        raise NotRocking(
            "the fit of a rocking motion to the signal did not converge: check the laser and the block's base and sides"
        )
    return found
