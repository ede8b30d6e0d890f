"""Predicted multipliers of a stability test, and the boundaries where the predicted or measured modulus crosses 1."""

from cmath import phase
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, hypot, nan, sqrt
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bench.analysis.uncertainty import COVERAGE
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, rocking_orbit
from sim.table_orbit import table_orbit

Array = NDArray[np.float64]

STEP = 0.002
"""Relative change of the amplitude in the finite difference for the sensitivity."""

NEAR = 0.1
"""Deviation of specimens for the spread of the sensitivity, in standard uncertainties. It is small, so that no other
pair of multipliers becomes the dominant one.
"""

CLOSE = 0.02
"""Difference between the moduli of two pairs of multipliers up to which either may dominate in the actual specimen."""


@dataclass(frozen=True)
class Predicted:
    """Dominant multiplier of an orbit: on `fixed` ground and, if the shaker is known, on the `table`. On fixed ground,
    `uncertainty` is the standard uncertainty of the modulus due to the specimen, and `slope` and `turn` [rad] are the
    derivatives of modulus and angle with respect to the logarithm of the amplitude. `slope_spread` and `turn_spread`
    are the standard uncertainties of these derivatives due to the specimen, and `slope_tie` and `turn_tie` [rad] their
    covariances with the modulus of the same pair, whose variance is `variance`, to first order.
    """

    fixed: complex
    table: complex | None
    uncertainty: float
    slope: float
    turn: float
    slope_spread: float
    turn_spread: float
    slope_tie: float = 0.0
    turn_tie: float = 0.0
    variance: float = 0.0

    def given(self, modulus: float, uncertainty: float) -> Self:
        """The prediction with the slopes that are expected after `modulus` was measured with the standard
        `uncertainty`, and with their remaining spread: the specimens for which the prediction is off by this much are
        those with other slopes (normal distribution, to first order). Without a prediction on the table it is the same,
        because the table changes the modulus as well.
        """
        total = self.variance + uncertainty**2
        if self.table is None or not total > 0.0:
            return self
        off = (modulus - abs(self.multiplier)) / total
        return replace(
            self,
            slope=self.slope + self.slope_tie * off,
            turn=self.turn + self.turn_tie * off,
            slope_spread=sqrt(max(self.slope_spread**2 - self.slope_tie**2 / total, 0.0)),
            turn_spread=sqrt(max(self.turn_spread**2 - self.turn_tie**2 / total, 0.0)),
        )

    @property
    def multiplier(self) -> complex:
        """Multiplier on the table if it is known, otherwise on fixed ground."""
        return self.fixed if self.table is None else self.table


def rocking(specimen: Specimen, omega: float, amplitude: float) -> Orbit | None:
    """The rocking orbit at `omega` [rad/s] and `amplitude` [m/s2]; None if there is none."""
    branch = predict_gain(specimen, omega, amplitude).rocking
    return None if branch is None else branch.orbit


def close_pair(orbit: Orbit) -> str:
    """Remark on a second pair of multipliers on fixed ground whose modulus differs by at most `CLOSE` from that of the
    dominant pair; empty if there is none.
    """
    slowest = orbit.slowest
    others = [complex(each) for each in orbit.multipliers if each.imag > 0.0 and abs(each - slowest) > 1e-9]
    if not others or abs(second := max(others, key=abs)) < abs(slowest) - CLOSE:
        return ""
    return (
        f"the model has a second pair of multipliers, modulus {abs(second):.4f} at {degrees(phase(second)):.1f} "
        "degrees, which was not deflected but may be the dominant one of the actual specimen"
    )


def on_table(orbit: Orbit, shaker: Shaker | None, harmonics: int) -> complex | None:
    """Dominant multiplier on the table of `shaker`; None without a shaker or an orbit on its table."""
    if shaker is None:
        return None
    try:
        return table_orbit(orbit, shaker, harmonics).slowest
    except NoOrbit:
        return None


def predicted(orbit: Orbit, known: SpecimenKnowledge, shaker: Shaker | None, harmonics: int) -> Predicted:
    """Multiplier of `orbit`; its uncertainty is propagated to first order (GUM 5.1.4, note 2)."""
    sides = [(_slowest(more, orbit), _slowest(less, orbit)) for more, less in known.deviations(orbit.specimen)]
    near = known.deviations(orbit.specimen, NEAR)
    changes = np.array([_local(more, orbit) - _local(less, orbit) for more, less in near]).reshape(-1, 3)
    of_modulus, of_slope, of_turn = (changes / (2.0 * NEAR)).T
    _, slope, turn = _local(orbit.specimen, orbit)
    return Predicted(
        fixed=orbit.slowest,
        table=on_table(orbit, shaker, harmonics),
        uncertainty=hypot(*(0.5 * (abs(one) - abs(other)) for one, other in sides)),
        slope=float(slope),
        turn=float(turn),
        slope_spread=float(np.linalg.norm(of_slope)),
        turn_spread=float(np.linalg.norm(of_turn)),
        slope_tie=float(of_modulus @ of_slope),
        turn_tie=float(of_modulus @ of_turn),
        variance=float(of_modulus @ of_modulus),
    )


def _local(specimen: Specimen, orbit: Orbit) -> Array:
    """Modulus of the dominant multiplier of `specimen`, and the derivatives of its modulus and angle [rad] with respect
    to the logarithm of the amplitude, shape (3,). They are NaN if no orbit is found.
    """
    more, less = (_moved(specimen, orbit, 1.0 + step) for step in (STEP, -STEP))
    if more is None or less is None:
        return np.full(3, nan)
    # the same pair at both amplitudes, even if two pairs exchange dominance between them
    same = min((complex(each) for each in less.multipliers), key=lambda each: abs(each - more.slowest))
    moduli, turned = np.array([abs(more.slowest), abs(same)]), phase(more.slowest) - phase(same)
    return np.array([moduli.mean(), (moduli[0] - moduli[1]) / (2.0 * STEP), turned / (2.0 * STEP)])


def _slowest(specimen: Specimen, orbit: Orbit) -> complex:
    """Dominant multiplier of `specimen` on fixed ground with the drive of `orbit`; NaN if no orbit is found."""
    found = _moved(specimen, orbit)
    return complex(nan, nan) if found is None else found.slowest


def _moved(specimen: Specimen, orbit: Orbit, factor: float = 1.0) -> Orbit | None:
    """Orbit of `specimen` on fixed ground, near `orbit`, at `factor` times its amplitude; None if there is none."""
    try:
        return rocking_orbit(specimen, orbit.omega, factor * orbit.amplitude, guess=orbit)
    except NoOrbit:
        return None


@dataclass(frozen=True)
class Boundary:
    """A frequency or amplitude `place` at which the modulus of the dominant multiplier crosses 1, with its expanded
    uncertainty (k = 2), between the adjacent points `low` and `high`.
    """

    place: float
    uncertainty: float
    low: float
    high: float


def boundaries(places: Sequence[float], moduli: Sequence[float], uncertainties: Sequence[float]) -> list[Boundary]:
    """Boundaries between adjacent `places`, ascending, by linear interpolation of the moduli with their standard
    `uncertainties`; NaN moduli are omitted.

    The errors of the moduli are regarded as fully correlated. The uncertainty includes half the difference between
    linear and quadratic interpolation (through the nearest third point).
    """
    known = [k for k in sorted(range(len(places)), key=places.__getitem__) if moduli[k] == moduli[k]]
    x, y, u = (
        np.array([float(values[k]) for k in known], dtype=np.float64) for values in (places, moduli, uncertainties)
    )
    found = list[Boundary]()
    for k in range(len(known) - 1):
        if (y[k] < 1.0) == (y[k + 1] < 1.0):
            continue
        slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
        share = (1.0 - y[k]) / (y[k + 1] - y[k])
        place = float(x[k] + share * (x[k + 1] - x[k]))
        # a scale error of the accelerometer is common to all points
        shifted = ((1.0 - share) * u[k] + share * u[k + 1]) / abs(slope)
        bent = 0.5 * abs(_bend(x, y, k, place)) / abs(slope)
        found.append(Boundary(place, COVERAGE * hypot(shifted, bent), float(x[k]), float(x[k + 1])))
    return found


def _bend(x: Array, y: Array, k: int, place: float) -> float:
    """Quadratic minus linear interpolation at `place`, between x[k] and x[k + 1]; 0 without a third point."""
    others = [j for j in range(x.size) if j not in (k, k + 1)]
    if not others:
        return 0.0
    third = min(others, key=lambda j: abs(x[j] - place))
    linear = y[k] + (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (x[third] - x[k])
    second = (y[third] - linear) / ((x[third] - x[k]) * (x[third] - x[k + 1]))
    return float(second * (place - x[k]) * (place - x[k + 1]))
