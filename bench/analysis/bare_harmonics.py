"""Observations of the error curves of both lasers by harmonics, above all by those of tests of the bare frame.

In a test of the bare frame, which is driven by a sine, the harmonics of each reading are those of its error
(`bench.analysis.error_curve`), and of a motion due to columns that are not linear: stiffness of either storey that
depends on the drift, and dry friction, alike in all tests (`bench.analysis.column_harmonics`). How far the columns are
from linear ones is unknown as well: few harmonics hardly tell, and allowing for much widens the interval of a linear
frame. Several sizes are therefore weighted by their evidence, as the shapes of the curves are.

All numbers are divided by their standard deviations. Further errors of the model make them scatter more than these: the
ratio with the largest evidence, if it is above 1, widens all of them (`bench.analysis.curve_observations`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.column_harmonics import FORCES, amplitudes
from bench.analysis.curve_observations import Observations, observations
from bench.analysis.curve_posterior import Basis, Candidates
from bench.analysis.error_curve import LEAST, Harmonics

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Both = tuple[tuple[Harmonics, ...], tuple[Harmonics, ...]]
"""Harmonics of the readings of laser 1 and of laser 2 in tests of the bare frame."""

UNIT = 1e-6
"""Standard deviation to which all numbers are scaled [m]."""

NOT_LINEAR: Array = np.array([0.01, 0.1, 1.0])
"""Possible standard deviations of the forces of columns that are not linear, relative to the largest expected ones."""

LEAST_DRIFT = 1e-9
"""Smallest drift to which forces of columns are relative [m]."""

PROPERTIES = 3
"""Number of further unknowns of a test with a block: mass and damping of the second storey relative to its stiffness,
and a delay between the lasers.
"""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Measured numbers as linear functions of the unknowns: `values`, shape (n,) [m], with the standard deviations
    `noise`, shape (n,) [m]; `rows`, shape (n, unknowns), for the curves of laser 1 and laser 2, the scale of laser 2
    relative to that of laser 1, the columns of both storeys, and the PROPERTIES of a test with a block.
    """

    values: Array
    noise: Array
    rows: Array


def bare_numbers(checks: Both, bases: tuple[Basis, Basis], largest: Array) -> list[Numbers]:
    """Harmonics of all readings; for `largest` see `ColumnHarmonics`."""
    found = list[Numbers]()
    for laser, every in enumerate(checks):
        for each in every:
            orders = slice(each.first, each.first + each.found.size)
            own = parted(amplitudes(bases[laser](each.readings))[orders])
            n = len(own)
            other, none = np.zeros((n, len(bases[1 - laser](np.zeros(1))))), np.zeros((n, PROPERTIES))
            bent = np.zeros((n, 2 * FORCES)) if each.columns is None else parted(each.columns.scaled(largest))
            # harmonics that the motion does not have are not changed by the scale
            rows = np.concatenate((*((own, other) if laser == 0 else (other, own)), none[:, :1], bent, none), axis=1)
            found.append(Numbers(parted(each.found), np.tile(each.uncertainty, 2), rows))
    return found


def largest_drifts(checks: Both) -> Array:
    """Largest drifts of both storeys in the tests, shape (2,) [m]."""
    drifts = [each.columns.largest for every in checks for each in every if each.columns is not None]
    return np.asarray(np.max([np.full(2, LEAST_DRIFT), *drifts], axis=0), dtype=np.float64)


def observed_by(found: Sequence[Numbers], candidates: Candidates, limits: tuple[float, float]) -> Observations:
    """Observations by numbers of which those of one element may have related errors, of lasers with the largest
    linearity errors `limits` [m].
    """
    noise = np.hypot(np.concatenate([each.noise for each in found]), LEAST * min(limits)) / UNIT
    rows = np.concatenate([each.rows for each in found]) / noise[:, None]
    values = np.concatenate([each.values for each in found]) / noise
    starts = np.cumsum([0, *(each.values.size for each in found[:-1])])
    return observations(rows, values, 0, starts, candidates.flexible, least=UNIT)


def spreads(before: int, after: int) -> Array:
    """Possible prior standard deviations of the unknowns of the columns with `before` and `after` further ones, whose
    prior standard deviation is 1; shape (possibilities, further unknowns).
    """
    columns = np.tile(NOT_LINEAR[:, None], 2 * FORCES)
    return np.pad(columns, ((0, 0), (before, after)), constant_values=1.0)


def parted(numbers: Complex) -> Array:
    """Real and then imaginary parts along the first axis."""
    return np.concatenate((numbers.real, numbers.imag))
