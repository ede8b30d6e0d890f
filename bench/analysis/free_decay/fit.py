"""Model of the laser signals of a frame on a moving table, and its least-squares fit to a recording.

    laser_i = G_i z_i(t - tau_i) + o_i + sum_k a_ik (z_i / R_i)^k,    i = 1, 2

z is the response to the table's displacement from a free initial state (`response`). Gain, delay, offset and smooth
curvature of each laser are nuisance parameters, which are fitted as well, so that they do not bias the stiffness.
Parameters that the motion does not determine (such as the common gain for a released frame on a locked table) keep
their expected value and its uncertainty.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.prony import constants_of, modes_of
from bench.analysis.free_decay.response import Constants, Response, response
from bench.analysis.free_decay.stretch import Stretch, Unusable

Array = NDArray[np.float64]

BEND = (2, 3, 4, 5)
"""Exponents of the curvature terms of a laser's characteristic."""

CONSTANTS, STATE = slice(0, 4), slice(4, 8)
GAINS, DELAYS, OFFSETS = slice(8, 10), slice(10, 12), slice(12, 14)
BENDS = slice(14, 14 + 2 * len(BEND))
COUNT = BENDS.stop
"""Indices and number of the fitted values: k1, k2, c1, c2 of the frame, its initial state, the lasers' parameters."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Model of the laser signals as a function of the COUNT fitted values; `reach` [m], shape (2,), holds the R_i."""

    stretch: Stretch
    masses: tuple[float, float]
    reach: Array

    def parts(self, values: Array) -> tuple[Response, Array, Array]:
        """The response, and (z1, z2) [m] and their velocities [m/s], shape (2, n) each, delayed like laser 1."""
        found = response(Constants(*self.masses, *values[:4].tolist()), self.stretch.step)
        # a common delay is equivalent to a delay of the table's motion, since the initial state is free
        late, rate = self.stretch.driving(float(values[DELAYS][0]))
        q = found.forced(late) + (found.adjoint @ values[STATE])[:, None] * found.free(late.size)
        return found, self._relative(found.storeys(q), late), self._relative(found.velocities(q, late), rate)

    def _relative(self, absolute: Array, table: Array) -> Array:
        return absolute - table if self.stretch.on_table else absolute

    def shown(self, values: Array) -> Array:
        """The laser signals [m], shape (2, n)."""
        _, z, speed = self.parts(values)
        further = values[DELAYS][1] - values[DELAYS][0]
        z = z - np.array([[0.0], [further]]) * speed
        share = z / self.reach[:, None]
        bent = np.zeros_like(z)
        for term in values[BENDS].reshape(2, len(BEND)).T[::-1]:
            bent = (bent + term[:, None]) * share
        return values[GAINS][:, None] * z + values[OFFSETS][:, None] + bent * share

    def jacobian(self, values: Array) -> Array:
        """Derivatives of `shown` with respect to the values, shape (COUNT, 2, n)."""
        found, z, speed = self.parts(values)
        n = z.shape[1]
        further = values[DELAYS][1] - values[DELAYS][0]
        z = z - np.array([[0.0], [further]]) * speed
        share = z / self.reach[:, None]
        powers = np.cumprod(np.broadcast_to(share, (BEND[-1], 2, n)), axis=0)
        slope = np.tile(values[GAINS][:, None], (1, n))
        for power, term in zip(BEND, values[BENDS].reshape(2, len(BEND)).T, strict=True):
            slope += (power * term / self.reach)[:, None] * powers[power - 2]
        out = np.zeros((COUNT, 2, n))
        for place in (0, 1, 2, 3, DELAYS.start):
            out[place] = self._difference(values, place)
        free = found.free(n)
        for place in range(4):
            q = found.adjoint[:, place, None] * free
            change = found.storeys(q)
            change[1] -= further * found.velocities(q, np.zeros_like(self.stretch.time))[1]
            out[STATE.start + place] = slope * change
        for laser in range(2):
            out[GAINS.start + laser, laser] = z[laser]
            out[OFFSETS.start + laser, laser] = 1.0
            first = BENDS.start + laser * len(BEND)
            out[first : first + len(BEND), laser] = powers[1:, laser]
        out[DELAYS.start + 1, 1] = -slope[1] * speed[1]
        return out

    def _difference(self, values: Array, place: int) -> Array:
        step = np.zeros(COUNT)
        step[place] = 1e-5 * max(abs(values[place]), 1e-3 if place == DELAYS.start else 1e-2)
        return (self.shown(values + step) - self.shown(values - step)) / (2.0 * step[place])


GAIN_UNCERTAINTY, DELAY_UNCERTAINTY = 0.01, 2e-3
"""Standard uncertainties of the lasers' gain, expected to be 1, and of their delay relative to the table's sensor,
expected to be 0 [s].
"""

BEND_UNCERTAINTY = 1e-3
"""Standard uncertainty of the curvature terms at the largest motion [m]."""

NOISE = 2e-5
"""Noise of a laser [m], which determines the weight of the samples relative to that of the expected values."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit: `values`, shape (COUNT,), in SI units, beginning with k1, k2, c1, c2.

    `jacobian`, shape (COUNT, 2, n), holds the derivatives of the laser signals with respect to the values, zero where a
    sample is missing; `mass_jacobian`, shape (2, 2, n), those with respect to the masses; `residual` [m], shape (2, n),
    measured minus fitted, zero where missing; `expected`, shape (COUNT, COUNT), is the contribution of the expected
    values to the normal matrix, `inverse` the inverse of the total matrix; `fitted` [m], shape (2, n), is the model.
    """

    stretch: Stretch
    masses: tuple[float, float]
    values: Array
    fitted: Array
    residual: Array
    jacobian: Array
    mass_jacobian: Array
    expected: Array
    inverse: Array

    @property
    def constants(self) -> Constants:
        """The identified frame."""
        return Constants(*self.masses, *self.values[:4].tolist())

    @property
    def response(self) -> Response:
        """Modal response of the identified frame, for the sample interval of the section."""
        return response(self.constants, self.stretch.step)

    def moved(self, error: Array) -> Array:
        """Shifts of the values, shape (..., count), due to errors of the laser signals [m], shape (..., 2, n)."""
        return np.tensordot(error, self.jacobian, ([-2, -1], [-2, -1])) @ self.inverse


def fit(stretch: Stretch, masses: tuple[float, float], start: Constants) -> Fit:
    """Fit the section, starting from the frame `start`. Raises Unusable if the fit fails."""
    from scipy.optimize import least_squares

    there = np.isfinite(stretch.readings)
    seen = np.where(there, stretch.readings, 0.0)
    reach = np.maximum(np.abs(seen).max(axis=1), 1e-6)
    model = Shown(stretch, masses, reach)
    expected, uncertainty = _expectations()
    begin = expected.copy()
    begin[CONSTANTS] = start[2:]
    # for a given frame the signals are linear in the initial state and the offsets
    linear = [*range(COUNT)[STATE], *range(COUNT)[OFFSETS]]
    left = (model.jacobian(begin)[linear] * there).reshape(len(linear), -1).T
    begin[linear] += np.linalg.lstsq(left, ((seen - model.shown(begin)) * there).ravel(), rcond=None)[0]
    rows = np.flatnonzero(np.isfinite(uncertainty))

    def residual(values: Array) -> Array:
        try:
            shown = model.shown(values)
        except ArithmeticError:
            # the frame is invalid: an infinite residual makes the solver take a shorter step
            return np.full(seen.size + rows.size, np.inf)
        return np.concatenate((((shown - seen) * there).ravel() / NOISE, ((values - expected) / uncertainty)[rows]))

    def slopes(values: Array) -> Array:
        data = (model.jacobian(values) * there).reshape(COUNT, -1).T / NOISE
        return np.concatenate((data, np.diag(1.0 / uncertainty)[rows]))

    try:
        found: Any = least_squares(
            residual, begin, jac=slopes, x_scale="jac", method="trf", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=100
        )
    except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
        raise Unusable(f"the model of the frame could not be fitted to the decay ({error})") from None
    if found.status <= 0:
        raise Unusable("the model of the frame could not be fitted to the decay: the fit does not converge")
    values: Array = found.x
    jacobian = model.jacobian(values) * there
    flat = jacobian.reshape(COUNT, -1)
    known = NOISE**2 * np.diag(np.where(np.isfinite(uncertainty), 1.0 / uncertainty**2, 0.0))
    normal = flat @ flat.T + known
    size = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    shown = model.shown(values)
    return Fit(
        stretch=stretch,
        masses=masses,
        values=values,
        fitted=shown,
        residual=np.where(there, stretch.readings - shown, 0.0),
        jacobian=jacobian,
        mass_jacobian=np.array([_mass_slope(model, values, which) * there for which in range(2)]),
        expected=known,
        inverse=inverse,
    )


def fit_from_scratch(stretch: Stretch, masses: tuple[float, float]) -> Fit:
    """Fit the section, starting from Prony's estimate. Raises Unusable if the fit fails."""
    return fit(stretch, masses, constants_of(*modes_of(stretch), *masses))


def _mass_slope(model: Shown, values: Array, which: int) -> Array:
    sides: list[Array] = []
    step = 1e-5 * model.masses[which]
    for sign in (1.0, -1.0):
        masses = [*model.masses]
        masses[which] += sign * step
        sides.append(replace(model, masses=(masses[0], masses[1])).shown(values))
    return (sides[0] - sides[1]) / (2.0 * step)


def _expectations() -> tuple[Array, Array]:
    """Expected values and their standard uncertainties, which are infinite for values without an expected value."""
    expected, uncertainty = np.zeros(COUNT), np.full(COUNT, np.inf)
    expected[GAINS] = 1.0
    uncertainty[GAINS], uncertainty[DELAYS], uncertainty[BENDS] = GAIN_UNCERTAINTY, DELAY_UNCERTAINTY, BEND_UNCERTAINTY
    return expected, uncertainty
