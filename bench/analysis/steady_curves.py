"""Error curves of both lasers, from the harmonics of steady tests.

Those of the bare frame tell the errors over its readings (`bench.analysis.bare_harmonics`). With a block, the storeys
move with harmonics of their own, but only the upper columns move the second one: the equation of
`bench.analysis.storey_equations`, here for each harmonic of the mean cycle, relates both errors over the readings of
this test, which may leave those of the bare frame. Unknown in it are also the mass and damping of the second storey
relative to its stiffness, and a delay between the lasers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bench.analysis.bare_harmonics import (
    PROPERTIES,
    Both,
    Numbers,
    bare_numbers,
    largest_drifts,
    observed_by,
    parted,
    spreads,
)
from bench.analysis.column_harmonics import FORCES, ColumnHarmonics, amplitudes, forces
from bench.analysis.curve_posterior import Basis, Candidates, LaserCurves
from bench.analysis.cycles import HARMONICS, Cycle, mean_waves
from bench.analysis.error_curve import CAUTION, rounding
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import ACCELERATION, LASER_1, LASER_2

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

PLACES = 64
"""Number of points of a cycle at which the readings are evaluated."""

LOSS = 0.1
"""Standard deviation of the second storey's loss factor, c_2 omega / k_2. That of m_2 / k_2 is its assumed value."""


@dataclass(frozen=True, eq=False)
class StoreyTest:
    """Mean cycle of a steady test at `omega` [rad/s]: `readings` of both lasers over one period, shape (2, PLACES) [m];
    complex amplitudes of both [m] and of the table's acceleration [m/s2] in all `cycles`, shape (cycles, 3, H); the
    bare `frame`; resolution `step` [m] of the lasers, and the largest delay `late` [s], which is taken for a standard
    deviation.
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
        changes = np.array([storey.m2 / storey.k2 * accelerated, LOSS / self.omega * s * (second - first)]).T
        rows = np.concatenate(
            (
                -lower[:, None] * amplitudes(bases[0](self.readings[0]))[fitted],
                upper[:, None] * amplitudes(bases[1](self.readings[1]))[fitted],
                mismatch * (upper * second)[:, None],
                ColumnHarmonics(bent, np.array([largest[0], own])).scaled(largest),
                changes,
                (self.late * upper * s * second)[:, None],
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
        return Numbers(parted(found), np.tile(noise, 2), parted(rows))


def steady_curves(
    checks: Both,
    test: StoreyTest | None,
    limits: tuple[float, float],
    ranges: tuple[float, float],
    mismatch: float,
    further: tuple[Array, Array],
) -> LaserCurves | None:
    """Curves according to the `checks` of both lasers in tests of the bare frame, and to the motion of the second
    storey in another `test`, over their readings and `further` ones. None if the lasers have no errors, or if the
    harmonics tell nothing of them.

    `limits` are the largest linearity errors and `ranges` the measuring ranges of the lasers [m]; `mismatch` is the
    standard uncertainty of the ratio of their scales.
    """
    if not any(checks) or 0.0 in limits:
        return None
    first, second = (
        np.concatenate([*(each.readings for each in found), *([] if test is None else [test.readings[laser]]), others])
        for laser, (found, others) in enumerate(zip(checks, further, strict=True))
    )
    candidates = Candidates.over((first, second), limits, ranges, CAUTION)
    bases, largest = candidates.bases, largest_drifts(checks)
    if test is not None:
        largest = np.maximum(largest, (0.0, test.drift))
    found = bare_numbers(checks, bases, largest)
    if test is not None:
        found.append(test.numbers(bases, mismatch, largest))
    observed = observed_by(found, candidates, limits)
    if not observed.values.size:
        return None
    known = sum(each.size for each in candidates.places)
    scales = np.ones(observed.rows.shape[1])
    scales[known] = mismatch
    return candidates.curves(observed, scales, spreads(1, PROPERTIES))


@lru_cache(maxsize=4)
def bare_curves(
    checks: Both, limits: tuple[float, float], ranges: tuple[float, float], mismatch: float
) -> LaserCurves | None:
    """Curves over the whole ranges according to tests of the bare frame alone, cached for later calls with the same
    objects.
    """
    first, second = 0.5 * np.outer(ranges, (-1.0, 1.0))
    return steady_curves(checks, None, limits, ranges, mismatch, (first, second))
