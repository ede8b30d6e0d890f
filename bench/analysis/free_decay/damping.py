"""Dependence of a mode's damping on its amplitude.

With a damping ratio xi + s A, where A is the amplitude of the drift in the mode, the mode's coordinate q changes by

    - s omega q integral of A dt

to first order. These changes are additional columns of the linearised fit: one for the slope s of each mode, or one for
each of several time windows with a damping ratio different from that of the whole decay.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.covariance import Errors, covariances
from bench.analysis.free_decay.fit import COUNT, DELAYS, GAINS, OFFSETS, STATE, Fit

Array = NDArray[np.float64]

WINDOWS = 5
"""Number of windows in which a mode's damping is evaluated; the amplitude decreases by the same factor in each
window.
"""

FLOOR = 0.03
"""Fraction of a mode's largest amplitude down to which the mode is evaluated."""

_DAMPING = slice(2, 4)


@dataclass(frozen=True, eq=False)
class DampingCourse:
    """Damping of one mode as a function of its amplitude.

    `slope` [1/m] is the change of the damping ratio with the amplitude of the drift, `own` and `common` [1/m2] are the
    variances of the slope due to errors that are independent between decays and to errors common to all decays.
    `amplitude` [m], shape (WINDOWS,), is the mean amplitude in each window, `damping` the damping ratio in it and
    `uncertainty` the standard uncertainty of that ratio, without the common part.
    """

    slope: float
    own: float
    common: float
    amplitude: Array
    damping: Array
    uncertainty: Array


def damping_courses(
    fit: Fit, errors: Errors, begin: float, ratios: Array, omegas: Array
) -> tuple[DampingCourse, DampingCourse]:
    """The damping of both modes against amplitude, from the end of the excitation at `begin` [s].

    `ratios` and `omegas` [rad/s], shape (2,), are the damping ratios and undamped frequencies as fitted.
    """
    modes = [_mode(fit, which, begin, float(omegas[which])) for which in range(2)]
    slopes = _extended(fit, [mode.column(mode.amplitude) for mode in modes], keep_damping=True)
    found, slopes = _stepped(slopes)
    own, common = (np.diag(part)[-2:] for part in covariances(slopes, errors))
    columns = [mode.column(inside) for mode in modes for inside in mode.windows]
    pieces = _extended(fit, columns, keep_damping=False)
    moved, pieces = _stepped(pieces)
    off = moved[-len(columns) :].reshape(2, WINDOWS)
    uncertainties = np.sqrt(np.diag(covariances(pieces, errors)[0])[-len(columns) :]).reshape(2, WINDOWS)
    first, second = (
        DampingCourse(
            slope=float(found[which - 2]),
            own=float(own[which]),
            common=float(common[which]),
            amplitude=np.array([float(mode.amplitude[inside].mean()) for inside in mode.windows]),
            damping=ratios[which] + off[which],
            uncertainty=uncertainties[which],
        )
        for which, mode in enumerate(modes)
    )
    return first, second


@dataclass(frozen=True, eq=False)
class _Mode:
    """One mode: its circular frequency, the amplitude of its drift, shape (n,), and its part of the laser signals,
    shape (2, n).

    `windows` holds the samples of each window.
    """

    omega: float
    step: float
    amplitude: Array
    shown: Array
    windows: list[NDArray[np.bool_]]

    def column(self, more: Array | NDArray[np.bool_]) -> Array:
        """Change of the laser signals, shape (2, n), due to an increase of the damping ratio by `more`, shape (n,)."""
        return -self.omega * np.cumsum(more.astype(np.float64)) * self.step * self.shown


def _mode(fit: Fit, which: int, begin: float, omega: float) -> _Mode:
    found, stretch = fit.response, fit.stretch
    table, _ = stretch.driving(float(fit.values[DELAYS][0]))
    q = found.forced(table) + (found.adjoint @ fit.values[STATE])[:, None] * found.free(table.size)
    q[1 - which] = 0.0
    drift = found.shapes[1, which] - found.shapes[0, which]
    amplitude = 2.0 * np.abs(drift) * np.abs(q[which])
    after = stretch.time >= begin
    largest = float(amplitude[after].max())
    # the windows follow the decay of the model, because the measured amplitudes become noise
    rate = -float(found.poles[which].real)
    last = min(np.log(1.0 / FLOOR) / rate, float(stretch.time[-1]) - begin)
    edges = [begin + last * share for share in np.linspace(0.0, 1.0, WINDOWS + 1).tolist()]
    windows = [(stretch.time >= low) & (stretch.time < high) for low, high in pairwise(edges)]
    return _Mode(
        omega=omega,
        step=stretch.step,
        amplitude=np.where(after, np.minimum(amplitude, largest), 0.0),
        shown=fit.values[GAINS][:, None] * found.storeys(q),
        windows=windows,
    )


def _stepped(extended: Fit) -> tuple[Array, Fit]:
    """Shifts of all values to the optimum of the linearised fit, and the fit with the remaining residual."""
    moved = extended.moved(extended.residual)
    left = extended.residual - np.tensordot(moved, extended.jacobian, 1)
    return moved, replace(extended, residual=np.where(extended.residual == 0.0, 0.0, left))


def _extended(fit: Fit, columns: list[Array], *, keep_damping: bool) -> Fit:
    """The linearised fit with additional values appended; the dashpots are fixed unless `keep_damping`."""
    there = fit.jacobian[OFFSETS].any(axis=0)
    jacobian = np.concatenate((fit.jacobian, np.array(columns) * there))
    flat = jacobian.reshape(len(jacobian), -1)
    normal = flat @ flat.T
    normal[:COUNT, :COUNT] += fit.expected
    if not keep_damping:
        jacobian[_DAMPING] = 0.0
        normal[_DAMPING], normal[:, _DAMPING] = 0.0, 0.0
        normal[_DAMPING, _DAMPING] = np.eye(2)
    size = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    return replace(fit, jacobian=jacobian, inverse=inverse)
