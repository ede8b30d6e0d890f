"""Runs under many records of the same length and time step, as in a Monte Carlo simulation, in reused memory."""

from math import pi

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import ROW
from sim.rocking import MOST_IMPACTS, REST_ANGLE, TOLERANCE, Motion, check_options, motion_of, series_order
from sim.specimen import Specimen

BLOCK = 2000
"""Number of segments integrated in one call: few enough for their table to remain in the processor's cache."""


class RecordRuns:
    """Integrates specimens from rest under records of `samples` accelerations at intervals of `dt` [s], and finds the
    peaks.

    The results are bit-identical to those of `sim.rocking.simulate` under a `SampledRecord`, but no new table of
    segments is made for each record. One thread at a time may use an object.
    """

    def __init__(self, samples: int, dt: float) -> None:
        if samples < 2 or not dt > 0.0:
            raise InvalidInput("record", (samples, dt), "it must have at least two samples and a positive time step")
        self._segments = np.zeros((min(samples - 1, BLOCK), ROW))
        self._segments[:, 0] = dt
        self._count, self._dt = samples - 1, dt
        self._times, self._samples = np.empty(0), np.empty((0, 6))

    def run(
        self,
        specimen: Specimen,
        acceleration: NDArray[np.float64],
        *,
        tolerance: float = TOLERANCE,
        overturning_angle: float = pi / 2,
    ) -> Motion:
        """Motion under `acceleration` [m/s2], shape (samples,); the other arguments are those of `simulate`.

        Raises InvalidInput for an acceleration of another length or with numbers that are not finite.
        """
        from sim.kernel import rocking as kernel

        check_options(tolerance, overturning_angle)
        if acceleration.shape != (self._count + 1,) or not np.isfinite(acceleration.sum()):
            raise InvalidInput("record", acceleration.shape, f"it must have {self._count + 1} finite samples")
        slopes = np.diff(acceleration) / self._dt
        p, x, report, order = specimen.packed(), np.zeros(6), np.zeros(kernel.REPORT), series_order(tolerance, self._dt)
        memory = kernel.memory_of(order, self._dt)
        for first in range(0, self._count, BLOCK):
            part = slice(first, min(first + BLOCK, self._count))
            segments = self._segments[: part.stop - first]
            segments[:, 8] = acceleration[part]
            segments[:, 9] = slopes[part]
            kernel.advance(
                p,
                segments,
                x,
                self._times,
                0,
                self._samples,
                order,
                tolerance,
                np.inf,
                overturning_angle,
                REST_ANGLE,
                0.0,
                MOST_IMPACTS,
                memory,
                report,
            )
            if report[kernel.STATUS] != kernel.COMPLETED:
                break
        return motion_of(report, x, None, watched=True)
