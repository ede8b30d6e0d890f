"""Error curves of both lasers, from the harmonics of steady tests.

In a test of the bare frame, which is linear, the harmonics of each reading are those of its error
(`bench.analysis.error_curve`). With a block, the storeys move with harmonics of their own, but only the upper columns
move the second one: the equation of `bench.analysis.storey_equations`, here for each harmonic of the mean cycle,
relates both errors over the readings of this test, which may leave those of the bare frame.

What else may be in these numbers are unknowns: stiffness of either storey that depends on the drift, and dry friction,
alike in all tests (`bench.analysis.column_harmonics`); in a test with a block also other ratios of mass and damping to
stiffness than the assumed ones, and a delay between the lasers. How far the columns are from linear ones is unknown as
well: few harmonics hardly tell, and allowing for much widens the interval of a linear frame. Several sizes are
therefore weighted by their evidence, as the shapes of the curves are.

All numbers are divided by their standard deviations. Further errors of the model make them scatter more than these: the
ratio with the largest evidence, if it is above 1, widens all of them (`bench.analysis.curve_observations`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bench.analysis.column_harmonics import FORCES, ColumnHarmonics, amplitudes, forces
from bench.analysis.curve_observations import observations
from bench.analysis.curve_posterior import Basis, Candidates, LaserCurves
from bench.analysis.cycles import HARMONICS, Cycle, mean_waves
from bench.analysis.error_curve import CAUTION, LEAST, Harmonics, block_diagonal, rounding
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import ACCELERATION, LASER_1, LASER_2

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

UNIT = 1e-6
"""Standard deviation to which all numbers are scaled [m]."""

PLACES = 64
"""Number of points of a cycle at which the readings are evaluated."""

NOT_LINEAR: Array = np.array([0.001, 0.01, 0.1])
"""Possible standard deviations of the forces of columns that are not linear, relative to the linear one at the largest
drift; friction has a tenth of them.
"""

PROPERTIES = 0.1
"""Standard deviations of the second storey's mass and damping, relative to its stiffness."""

LEAST_DRIFT = 1e-9
"""Smallest drift to which they are relative [m]."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Measured numbers as linear functions of the unknowns: `values`, shape (n,) [m], with the standard deviations
    `noise`, shape (n,) [m]; `rows`, shape (n, unknowns), for the curves of laser 1 and laser 2, the scale of laser 2
    relative to that of laser 1, the columns of both storeys, and mass and damping of the second one; and `late`, shape
    (n, 0) or (n, 1), for an unknown of this test alone.
    """

    values: Array
    noise: Array
    rows: Array
    late: Array


@dataclass(frozen=True, eq=False)
class StoreyTest:
    """Mean cycle of a steady test at `omega` [rad/s]: `readings` of both lasers over one period, shape (2, PLACES) [m];
    complex amplitudes of both and of the table's acceleration in all `cycles`, shape (cycles, 3, H) [m, m/s2]; the bare
    `frame`; resolution `step` [m] and unknown delay `late` [s] of the lasers.
    """

    omega: float
    readings: Array
    cycles: Complex
    frame: LinearFrame
    step: float
    late: float

    @classmethod
    def of(cls, cycles: Sequence[Cycle], omega: float, frame: LinearFrame, accuracy: SensorAccuracy) -> "StoreyTest":
        """The test of these `cycles`."""
        highest = min(HARMONICS, *(cycle.fitted for cycle in cycles))
        waves = mean_waves(cycles).waveform[:, [LASER_1, LASER_2]].T
        every = max(waves.shape[1] // PLACES, 1)
        # Im(z exp(i k phase)) is Re(c exp(-i k phase)) with c = i z*
        columns = LASER_1, LASER_2, ACCELERATION
        each = 1j * np.array([[cycle.harmonics(k)[:highest] for k in columns] for cycle in cycles]).conj()
        return cls(omega, waves[:, ::every], each, frame, accuracy.laser_resolution, accuracy.laser_timing)

    @property
    def drift(self) -> float:
        """Largest drift [m]."""
        return forces(self.readings[1] - self.readings[0])[1]

    def numbers(self, bases: tuple[Basis, Basis], mismatch: float, largest: Array) -> Numbers:
        """Residuals of the second storey's equation. The scale is relative to `mismatch`; for `largest` see
        `ColumnHarmonics`.
        """
        highest = self.cycles.shape[2]
        fitted, storey = slice(1, highest + 1), self.frame.specimen.frame
        # the conjugate of the response, as amplitudes multiply exp(-i k phase)
        s = np.asarray(-1j * self.omega * np.arange(1, highest + 1), dtype=np.complex128)
        lower = 1.0 + storey.dashpots[1] / storey.k2 * s
        upper = lower + storey.m2 / storey.k2 * s**2
        first, second, table = self.cycles.mean(axis=0)
        residual = upper * self.cycles[:, 1] - lower * self.cycles[:, 0]
        accelerated = second * s**2
        if not self.frame.grounded:
            residual += storey.m2 / storey.k2 * self.cycles[:, 2]
            accelerated = accelerated + table
        relative, own = forces(self.readings[1] - self.readings[0])
        bent = np.zeros((highest, 2 * FORCES), dtype=np.complex128)
        bent[:, FORCES:] = -own * amplitudes(relative)[fitted]
        changes = np.array([accelerated / self.omega**2, s / self.omega * (second - first)]).T
        rows = np.concatenate(
            (
                -lower[:, None] * amplitudes(bases[0](self.readings[0]))[fitted],
                upper[:, None] * amplitudes(bases[1](self.readings[1]))[fitted],
                mismatch * (upper * second)[:, None],
                ColumnHarmonics(bent, np.array([largest[0], own])).scaled(largest),
                PROPERTIES * changes,
            ),
            axis=1,
            dtype=np.complex128,
        )
        found = residual.mean(axis=0)
        scatter = np.sqrt(0.5 * np.mean(np.abs(residual - found) ** 2, axis=0) / max(len(residual) - 1, 1))
        swings = np.ptp(self.readings, axis=1)
        steps = [
            np.abs(part) * rounding(float(swing), self.step) for part, swing in zip((lower, upper), swings, strict=True)
        ]
        noise = np.sqrt(scatter**2 + steps[0] ** 2 + steps[1] ** 2)
        late = (self.late * upper * s * second)[:, None]
        return Numbers(_parted(found), np.tile(noise, 2), _parted(rows), _parted(late))


@lru_cache(maxsize=4)
def steady_curves(
    checks: tuple[tuple[Harmonics, ...], tuple[Harmonics, ...]],
    tests: tuple[StoreyTest, ...],
    limits: tuple[float, float],
    ranges: tuple[float, float],
    mismatch: float,
) -> LaserCurves | None:
    """Curves according to the `checks` of both lasers in tests of the bare frame, and to the motion of the second
    storey in `tests`. None if the lasers have no errors, or if the harmonics tell nothing of them. The result is cached
    for later calls with the same objects.

    `limits` are the largest linearity errors and `ranges` the measuring ranges of the lasers [m]; `mismatch` is the
    standard uncertainty of the ratio of their scales.
    """
    if not any(checks) or 0.0 in limits:
        return None
    first, second = (
        np.concatenate([each.readings for each in found] + [each.readings[laser] for each in tests])
        for laser, found in enumerate(checks)
    )
    candidates = Candidates.over((first, second), limits, ranges, CAUTION)
    bases = candidates.bases
    drifts = [each.columns.largest for found in checks for each in found if each.columns is not None]
    largest = np.max([*drifts, *(np.array([0.0, each.drift]) for each in tests)], axis=0, initial=LEAST_DRIFT)
    found = [_bare(each, laser, bases, largest) for laser, every in enumerate(checks) for each in every]
    found += [each.numbers(bases, mismatch, largest) for each in tests]
    rows = np.concatenate([each.rows for each in found])
    noise = np.hypot(np.concatenate([each.noise for each in found]), LEAST * min(limits)) / UNIT
    rows = np.concatenate((rows, block_diagonal([each.late for each in found])), axis=1) / noise[:, None]
    values = np.concatenate([each.values for each in found]) / noise
    starts = np.cumsum([0, *(each.values.size for each in found[:-1])])
    observed = observations(rows, values, 0, starts, candidates.flexible, least=UNIT)
    if not observed.values.size:
        return None
    scales = np.ones(rows.shape[1])
    known = sum(each.size for each in candidates.places)
    scales[known] = mismatch
    spreads = np.ones((len(NOT_LINEAR), rows.shape[1] - known))
    spreads[:, 1 : 1 + 2 * FORCES] = NOT_LINEAR[:, None]
    return candidates.curves(observed, scales, spreads)


def _bare(harmonics: Harmonics, laser: int, bases: tuple[Basis, Basis], largest: Array) -> Numbers:
    """Harmonics of the readings of laser 0 or 1 in a test of the bare frame; for `largest` see `ColumnHarmonics`."""
    orders, columns = slice(harmonics.first, harmonics.first + harmonics.found.size), harmonics.columns
    own = _parted(amplitudes(bases[laser](harmonics.readings))[orders])
    n = len(own)
    other, none = np.zeros((n, len(bases[1 - laser](np.zeros(1))))), np.zeros((n, 2))
    bent = np.zeros((n, 2 * FORCES)) if columns is None else _parted(columns.scaled(largest))
    # harmonics that the motion does not have are not changed by the scale
    rows = np.concatenate((*((own, other) if laser == 0 else (other, own)), none[:, :1], bent, none), axis=1)
    return Numbers(_parted(harmonics.found), np.tile(harmonics.uncertainty, 2), rows, none[:, :0])


def _parted(numbers: Complex) -> Array:
    """Real and then imaginary parts along the first axis."""
    return np.concatenate((numbers.real, numbers.imag))
