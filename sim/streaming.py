"""The motion under a base acceleration that is handed over piece by piece, as a live bench does.

How the samples are cut into blocks makes no difference, bit for bit: everything that a step depends on is carried over.
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
    """A specimen that moves on as its base acceleration becomes known.

    The acceleration comes as values `dt` [s] apart, joined by straight lines; the first value of all only says where
    the lines begin. With `held`, each value instead stays for the `dt` after it, as a converter puts it out.
    `divisions` states are read off each interval, at equal parts of it with its end among them: the drive's updates may
    be far coarser than the samples wanted, because between two of them the motion is a polynomial. 0 reads off none.

    `peaks_from` [s] starts the window of the running peaks, None watches none; the other arguments are those of
    `sim.rocking.simulate`, and the motion is bit for bit the one that it gives for a `SampledRecord`.

    Raises InvalidInput for values outside their meaning.
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
            raise InvalidInput("dt", dt, "it must be positive seconds")
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
        self._memory = np.zeros((kernel.MEMORY_ROWS, 6))
        self._memory[0, kernel.LENGTH] = dt
        self._latest = np.empty(0)
        self._no_times = np.empty(0)

    @property
    def state(self) -> State:
        """The state now: at the end of the last interval, or where the run ended."""
        return State.from_array(self._x)

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return float(self._report[self._kernel.END])

    @property
    def status(self) -> Status:
        """COMPLETED as long as the run goes on."""
        return self.motion().status

    def motion(self) -> Motion:
        """What the specimen has done so far, with the running peaks; without samples, which `feed` gives."""
        return motion_of(self._report, self._x, None, watched=self._watched)

    def feed(self, acceleration: ArrayLike) -> NDArray[np.float64]:
        """Go on through the next values [m/s2], shape (n,), any n; the states read off, shape (m, 6).

        m is `divisions` for each interval completed; columns as `State.as_array`. Rows after an overturning or a
        failure are not there, and what is fed then is ignored: `status` says so.

        Raises InvalidInput, and nothing has moved, for values that are not finite or not in one row.
        """
        values = np.asarray(acceleration, dtype=np.float64)
        if values.ndim != 1 or not np.isfinite(values).all():
            raise InvalidInput("acceleration", values.shape, "it must be finite values in one row")
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
