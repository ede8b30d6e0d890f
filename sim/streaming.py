"""Motion under a base acceleration that arrives in blocks, as from a live bench.

The result is bit-identical for any division into blocks, because all state that affects a step is kept between blocks.
"""

from math import isfinite, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.errors import InvalidInput
from sim.excitation import ROW
from sim.rocking import (
    MOST_IMPACTS,
    REST_ANGLE,
    TOLERANCE,
    Motion,
    State,
    Status,
    check_options,
    check_state,
    motion_of,
    series_order,
)
from sim.specimen import Specimen


class Stream:
    """Specimen whose motion advances as the base acceleration arrives.

    The acceleration consists of values at intervals of `dt` [s], interpolated linearly; the very first value is only
    the start of the first interval. With `held`, each value is instead held for the following `dt`, as at the output of
    a converter. In each interval, `divisions` states are evaluated, at the ends of equal parts; with `divisions` = 0,
    none. `dt` may be far longer than the spacing of the states, because the motion within an interval is a polynomial.
    `peaks_from` [s] is the start of the window of the running peaks, or None for no peaks. The other arguments are
    those of `sim.rocking.simulate`, and the motion is bit-identical to its motion under a `SampledRecord`.

    Raises InvalidInput for values outside their ranges.
    """

    def __init__(
        self,
        specimen: Specimen,
        dt: float,
        *,
        state: State | None = None,
        divisions: int = 1,
        held: bool = False,
        peaks_from: float | None = 0.0,
        tolerance: float = TOLERANCE,
        overturning_angle: float = pi / 2,
    ) -> None:
        from sim.kernel import rocking as kernel

        start = state or State()
        check_options(tolerance, overturning_angle)
        check_state(specimen, start, overturning_angle)
        if not (dt > 0.0 and isfinite(dt)):
            raise InvalidInput("dt", dt, "it must be a positive, finite time step in s")
        if divisions < 0:
            raise InvalidInput("divisions", divisions, "it must be 0 or more samples per interval")
        if peaks_from is not None and not peaks_from >= 0.0:
            raise InvalidInput("peaks_from", peaks_from, "it must be 0 s or later, or None")
        self.dt, self.divisions, self.held = dt, divisions, held
        self._kernel = kernel
        self._p = specimen.packed()
        self._x = start.as_array()
        self._order, self._tolerance = series_order(tolerance, dt), tolerance
        self._overturning_angle = overturning_angle
        self._watched = peaks_from is not None
        self._peaks_from = np.inf if peaks_from is None else peaks_from
        self._report = np.zeros(kernel.REPORT)
        self._memory = kernel.memory_of(self._order, dt)
        self._latest = np.empty(0)
        self._no_times = np.empty(0)

    @property
    def state(self) -> State:
        """State at the end of the last interval, or at the end of the run."""
        return State.from_array(self._x)

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return float(self._report[self._kernel.END])

    @property
    def status(self) -> Status:
        """Status of the run: COMPLETED while it continues."""
        return self.motion().status

    def motion(self) -> Motion:
        """Result so far, with the running peaks but without the samples that `feed` returns."""
        return motion_of(self._report, self._x, None, watched=self._watched)

    def feed(self, acceleration: ArrayLike) -> NDArray[np.float64]:
        """Advance through the next values [m/s2], shape (n,), any n. Returns the evaluated states, shape (m, 6).

        m is `divisions` times the number of completed intervals; the columns are those of `State.as_array`. There are
        no rows after an overturning or a failure, which `status` reports; later input is ignored.

        Raises InvalidInput, without advancing, for values that are not finite or not one-dimensional.
        """
        values = np.asarray(acceleration, dtype=np.float64)
        if values.ndim != 1 or not np.isfinite(values).all():
            raise InvalidInput("acceleration", values.shape, "it must be a one-dimensional array of finite values")
        if self._report[self._kernel.STATUS] != self._kernel.COMPLETED:
            return np.empty((0, 6))
        if not self.held:
            values = np.concatenate((self._latest, values))
            self._latest = values[-1:]
        intervals = values.size if self.held else max(values.size - 1, 0)
        segments = np.zeros((intervals, ROW))
        segments[:, 0] = self.dt
        segments[:, 8] = values[:intervals]
        if not self.held:
            segments[:, 9] = np.diff(values) / self.dt
        samples = np.empty((intervals * self.divisions, 6))
        self._kernel.advance(
            self._p,
            segments,
            self._x,
            self._no_times,
            self.divisions,
            samples,
            self._order,
            self._tolerance,
            np.inf,
            self._overturning_angle,
            REST_ANGLE,
            self._peaks_from,
            MOST_IMPACTS,
            self._memory,
            self._report,
        )
        return samples[: int(self._report[self._kernel.SAMPLES])]
