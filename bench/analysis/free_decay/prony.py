"""Initial estimate of the frame by Prony's method, with the measured motion of the table as input.

Both lasers' signals obey one difference equation of fourth order, which is linear in its coefficients:

    y(n) = sum_k a_k y(n - k) + sum_k b_k x(n - k) + const

The roots of 1 - sum a_k z^-k are the poles of the modes (Marple, Digital Spectral Analysis, 1987, ch. 11, and, for a
system with an input, Ljung, System Identification, 2nd ed., sec. 7.3: ARX). Given the roots, the mode shapes also
follow from a linear problem.
"""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.response import Constants
from bench.analysis.free_decay.stretch import Stretch, Unusable

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RATE = 20.0
"""Approximate sample rate of the estimate [1/s]: a few samples per period of the second mode, because noise dominates
the differences of closer samples.
"""

LENGTH = 15.0
"""Longest duration used for the estimate [s]; later, the second mode has usually decayed."""

DAMPING = 0.003, 0.06
"""Range to which the estimated damping ratios are limited."""

ORDER = 4
"""Order of the difference equation, for two modes."""


def modes_of(stretch: Stretch) -> tuple[Complex, Array]:
    """Poles [1/s], shape (2,), slower first, and the ratio of storey 2 to storey 1 in each, shape (2,).

    Raises Unusable if the signals do not show two modes of a frame.
    """
    many = max(round(1.0 / (RATE * stretch.step)), 1)
    rows = min(stretch.time.size, round(LENGTH / stretch.step)) // many
    shape = (2, rows, many)
    seen = np.array([_filled(one) for one in stretch.readings])[:, : rows * many].reshape(shape).mean(axis=2)
    x = stretch.table[: rows * many].reshape(rows, many).mean(axis=1)
    if stretch.on_table:
        seen = seen + x
    step = many * stretch.step
    poles = _poles(seen, x, step)
    return poles, _ratios(seen, x, poles, step)


def constants_of(poles: Complex, ratios: Array, m1: float, m2: float) -> Constants:
    """The frame with these modes.

    Two pairs of stiffnesses have the same two frequencies: k2 follows from (1/m1 + 1/m2) k2^2 - T k2 + m2 P = 0 with T
    the sum and P the product of the squared frequencies; the shape of the first mode selects one pair.
    """
    squares = np.abs(poles) ** 2
    total, product = float(squares.sum()), float(squares.prod())
    inverse = 1.0 / m1 + 1.0 / m2
    root = np.sqrt(max(total**2 - 4.0 * inverse * m2 * product, 0.0))
    pairs = (total + root * np.array([-1.0, 1.0])) / (2.0 * inverse)
    # ratio of storey 2 to storey 1 in the first mode, from the second row of the eigenproblem
    shown = pairs / (pairs - squares[0] * m2)
    k2 = float(pairs[np.argmin(np.abs(shown - ratios[0]))])
    k1 = product * m1 * m2 / k2
    # the damping of a weak mode is arbitrary in the initial estimate
    rates = 2.0 * np.abs(poles) * np.clip(-poles.real / np.abs(poles), *DAMPING)
    rows: list[Array] = []
    for square in squares:
        top = k2 / (k2 - square * m2)
        rows.append(np.array([1.0, (top - 1.0) ** 2]) / (m1 + m2 * top**2))
    c1, c2 = np.linalg.solve(np.array(rows), rates)
    return Constants(m1, m2, k1, k2, float(c1), float(c2))


def _filled(values: Array) -> Array:
    """The values, with missing ones interpolated linearly."""
    there, index = np.isfinite(values), np.arange(values.size)
    return np.interp(index, index[there], values[there])


def _poles(seen: Array, x: Array, step: float) -> Complex:
    n = x.size - ORDER
    own = np.array([[y[ORDER - k : ORDER - k + n] for k in range(1, ORDER + 1)] for y in seen])
    given = np.array([*(x[ORDER - k : ORDER - k + n] for k in range(ORDER + 1)), np.ones(n)])
    none = np.zeros_like(given)
    left = np.hstack([np.vstack((own[0], given, none)), np.vstack((own[1], none, given))]).T
    found = np.linalg.lstsq(left, seen[:, ORDER:].ravel(), rcond=None)[0]
    turns = np.roots(np.concatenate(([1.0], -found[:ORDER]))).astype(np.complex128)
    upper = turns[turns.imag > 0.0]
    if upper.size != 2:
        raise Unusable("the decay does not show two modes of a frame: check the lasers, or request a larger motion")
    poles = np.asarray(np.log(upper) / step, np.complex128)
    return poles[np.argsort(np.abs(poles))]


def _ratios(seen: Array, x: Array, poles: Complex, step: float) -> Array:
    """Ratio of storey 2 to storey 1 in each mode, shape (2,), from its free and driven contributions to the signals."""
    from scipy import signal

    time = step * np.arange(x.size)
    columns: list[Array] = []
    for pole in poles:
        driven = step * np.asarray(signal.lfilter([0.0, 1.0], [1.0, -np.exp(pole * step)], x.astype(np.complex128)))
        for motion in (np.exp(pole * time), driven):
            columns += [motion.real, -motion.imag]
    left = np.array([*columns, np.ones(x.size)]).T
    found = np.linalg.lstsq(left, seen.T, rcond=None)[0]
    shares = found[:8:2] + 1j * found[1:8:2]
    size = np.array([np.linalg.norm(columns[2 * k]) for k in range(4)])
    weighted = (shares * size[:, None]).reshape(2, 2, 2)
    # free and driven contributions of a mode have the same shape
    found_ratios = [float((np.vdot(one[:, 0], one[:, 1]) / np.vdot(one[:, 0], one[:, 0])).real) for one in weighted]
    return np.array(found_ratios)
