"""Least squares of what the lasers would show of a frame (`shown`) to what they showed.

Gains and delays that the motion does not tell (a released frame on a locked table says nothing of the common gain) stay
where they are expected, with the uncertainty that is expected.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.response import Constants, Response, response
from bench.analysis.free_decay.shown import BENDS, CONSTANTS, COUNT, DELAYS, GAINS, OFFSETS, STATE, Shown
from bench.analysis.free_decay.start import constants_of, modes_of
from bench.analysis.free_decay.stretch import Stretch, Unusable

Array = NDArray[np.float64]

GAIN_DOUBT, DELAY_DOUBT = 0.01, 2e-3
"""Standard uncertainties of what is expected of the lasers: gain 1, and delay 0 [s] after the table's sensor."""

BEND_DOUBT = 1e-3
"""Standard uncertainty of the bend's terms at the largest motion [m]: several times what a data sheet allows."""

NOISE = 2e-5
"""What weighs the expectations against the samples [m]: the noise of a laser."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What was found: `values`, shape (COUNT,), in SI units, k1 to c2 first.

    `jacobian`, shape (COUNT, 2, n), are the derivatives of what the lasers show, zero where a sample is missing;
    `mass_jacobian`, shape (2, 2, n), those to the masses; `residual` [m], shape (2, n), measured less fitted, zero
    where missing; `expected`, shape (COUNT, COUNT), is what the expectations add to the normal matrix, and `inverse`
    that of their sum.
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
        """The frame that was found."""
        return Constants(*self.masses, *self.values[:4].tolist())

    @property
    def response(self) -> Response:
        """Its response at the samples of the stretch."""
        return response(self.constants, self.stretch.step)

    def moved(self, error: Array) -> Array:
        """How far `error`s of what the lasers show [m], shape (..., 2, n), move the values: shape (..., count)."""
        return np.tensordot(error, self.jacobian, ([-2, -1], [-2, -1])) @ self.inverse


def fit(stretch: Stretch, masses: tuple[float, float], start: Constants) -> Fit:
    """Fit the stretch from the frame `start` on. Raises Unusable when it comes to nothing."""
    from scipy.optimize import least_squares

    there = np.isfinite(stretch.seen)
    seen = np.where(there, stretch.seen, 0.0)
    reach = np.maximum(np.abs(seen).max(axis=1), 1e-6)
    model = Shown(stretch, masses, reach)
    expected, doubt = _expectations()
    begin = expected.copy()
    begin[CONSTANTS] = start[2:]
    # with a given frame its initial state and the offsets are linear
    linear = [*range(COUNT)[STATE], *range(COUNT)[OFFSETS]]
    left = (model.jacobian(begin)[linear] * there).reshape(len(linear), -1).T
    begin[linear] += np.linalg.lstsq(left, ((seen - model.shown(begin)) * there).ravel(), rcond=None)[0]
    rows = np.flatnonzero(np.isfinite(doubt))

    def residual(values: Array) -> Array:
        try:
            shown = model.shown(values)
        except ArithmeticError:
            # no frame: the solver takes a shorter step
            return np.full(seen.size + rows.size, np.inf)
        return np.concatenate((((shown - seen) * there).ravel() / NOISE, ((values - expected) / doubt)[rows]))

    def slopes(values: Array) -> Array:
        data = (model.jacobian(values) * there).reshape(COUNT, -1).T / NOISE
        return np.concatenate((data, np.diag(1.0 / doubt)[rows]))

    try:
        found: Any = least_squares(
            residual, begin, jac=slopes, x_scale="jac", method="trf", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=100
        )
    except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
        raise Unusable(f"the model of the frame could not be fitted to the decay ({error})") from None
    if found.status <= 0:
        raise Unusable("the model of the frame could not be fitted to the decay: it comes to no end")
    values: Array = found.x
    jacobian = model.jacobian(values) * there
    flat = jacobian.reshape(COUNT, -1)
    known = NOISE**2 * np.diag(np.where(np.isfinite(doubt), 1.0 / doubt**2, 0.0))
    normal = flat @ flat.T + known
    size = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    shown = model.shown(values)
    return Fit(
        stretch=stretch,
        masses=masses,
        values=values,
        fitted=shown,
        residual=np.where(there, stretch.seen - shown, 0.0),
        jacobian=jacobian,
        mass_jacobian=np.array([_mass_slope(model, values, which) * there for which in range(2)]),
        expected=known,
        inverse=inverse,
    )


def fit_from_scratch(stretch: Stretch, masses: tuple[float, float]) -> Fit:
    """Fit the stretch, from a first estimate that it gives itself. Raises Unusable when it comes to nothing."""
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
    """What is expected of the values, and its standard uncertainty, infinite where nothing is."""
    expected, doubt = np.zeros(COUNT), np.full(COUNT, np.inf)
    expected[GAINS] = 1.0
    doubt[GAINS], doubt[DELAYS], doubt[BENDS] = GAIN_DOUBT, DELAY_DOUBT, BEND_DOUBT
    return expected, doubt
