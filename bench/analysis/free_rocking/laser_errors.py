"""What the laser itself may have got wrong, carried through to what was found.

Linearity: a smooth error, size sin(2 pi n x / range + phase), of the size that the data sheet allows, any phase and any
number n of waves within the measuring range being equally likely; it belongs to the laser, so to all tilts. What the
fitted bend takes of it is taken. Over the phase its mean square is that of two components, with sin and cos - 1 of the
displacement from the rest, each of size / sqrt(2).

Timing: a laser whose clock runs freely shows a value late by something between nothing and one of its measurements. Its
delay grows by the difference of the clocks and falls back, anywhere in each recording.

Noise and steps are not here: they show in what a fit leaves.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.fit import BEND_3, START, ZERO, RockingFit
from bench.analysis.free_rocking.relation import Relation
from bench.analysis.gain import SensorAccuracy
from sim import block_face

Array = NDArray[np.float64]

WAVES = (0.5, 3.0)
"""Least and most waves of the linearity error within the measuring range: fewer make its scale, more are not smooth."""

CLOCK = 50e-6
"""Largest relative difference between the laser's clock and that of the samples: two quartz clocks."""

_NUMBERS, _RATES, _PHASES = 24, 12, 12
"""Equally likely values that are taken of waves, of differences of the clocks, and of where the delay begins."""


@dataclass(frozen=True, eq=False)
class LaserErrors:
    """A laser as its data sheet has it; `measuring_range` in m."""

    accuracy: SensorAccuracy
    measuring_range: float

    def linearity(self, fit: RockingFit) -> Array:
        """What the components of the linearity error change of the values and the trend, shape (9, components)."""
        return _carried(fit, self._components(fit.fitted - fit.values[ZERO]))

    def timing(self, fit: RockingFit) -> Array:
        """Standard uncertainty of the values and the trend by the laser's free clock, shape (9,)."""
        longest = self.accuracy.laser_timing
        if longest == 0.0:
            return np.zeros(fit.values.size + 1)
        rate, phase = np.meshgrid(CLOCK / longest * _middles(-1.0, 1.0, _RATES), _middles(0.0, 1.0, _PHASES))
        delay = longest * ((rate.ravel() * fit.times[:, None] + phase.ravel()) % 1.0)
        # later by the delay is as released later by it
        changes = _carried(fit, fit.jacobian[:, [START]] * delay)
        return np.sqrt(np.mean(changes**2, axis=1))

    def of_relation(self, relation: Relation, fit: RockingFit) -> Array:
        """What the components of the linearity error change of the amplitude relation's r, shape (components,)."""
        seen = block_face.displacement(relation.angles, fit.height, fit.block)
        rate = block_face.displacement_rate(relation.angles, fit.height, fit.block)
        # the relation's angles are without the zero and the bend that the fit found of this very error
        found = np.column_stack((np.ones(seen.size), seen**2, seen**3)) @ self.linearity(fit)[ZERO : BEND_3 + 1]
        return np.asarray(relation.weights @ ((self._components(seen) - found) / rate[:, None]))

    def _components(self, displacement: Array) -> Array:
        """The error's components [m] at displacements from the rest, shape (n,); shape (n, components)."""
        size = self.accuracy.laser_linearity * self.measuring_range / np.sqrt(2.0 * _NUMBERS)
        turned = 2.0 * np.pi / self.measuring_range * displacement[:, None] * _middles(*WAVES, _NUMBERS)
        return size * np.concatenate((np.sin(turned), np.cos(turned) - 1.0), axis=1)


def _middles(low: float, high: float, count: int) -> Array:
    """The middles of `count` equal parts of a range."""
    return low + (high - low) * (np.arange(count) + 0.5) / count


def _carried(fit: RockingFit, error: Array) -> Array:
    return np.vstack((fit.gain @ error, fit.trend_gain @ error))
