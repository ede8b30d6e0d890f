"""The motion over two impacts, for many starts at once: what the return map of steady rocking is made of."""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.rocking import END, IMPACT_LIMIT, PEAKS, REPORT, STATUS, run


@compiled("void(float64[:,::1], float64[:,::1], int64, float64, boolean, float64[:,::1], float64[:,::1])")
def images(
    q: NDArray[np.float64],
    x: NDArray[np.float64],
    order: int,
    tolerance: float,
    watch_peaks: bool,
    out: NDArray[np.float64],
    peaks: NDArray[np.float64],
) -> None:
    """Where each start is just after its second impact, with 2 pi taken off the phase.

    q : parameter vectors, shape (n, 18): packed specimen (16), omega [rad/s], amplitude [m/s2] of the base's sine.
    x : starts [phase, u1, u2, v1, v2, omega], shape (n * m, 6), the m starts of
    a parameter vector together.  order, tolerance : of the Taylor steps.
    out : shape (n * m, 6), NaN where the block does not come back into theta > 0 within three periods.
    peaks : shape (n * m, 3), greatest |u1|, |u2 - u1|, |theta| on the way; 0 unless `watch_peaks`.
    """
    segments = np.zeros((1, 10))
    no_times, no_samples = np.empty(0), np.empty((0, 6))
    report, state = np.empty(REPORT), np.empty(6)
    starts = x.shape[0] // q.shape[0]
    peaks_from = 0.0 if watch_peaks else np.inf
    for i in range(x.shape[0]):
        row = q[i // starts]
        # loops: assignments of arrays make numba compile the text of their errors
        for k in range(6):
            out[i, k] = np.nan
        for k in range(3):
            peaks[i, k] = 0.0
        if not x[i, 5] > 0.0:
            continue
        omega = row[16]
        # an orbit that has not returned after three periods is not one of the drive's period
        segments[0, 0] = 6.0 * np.pi / omega
        segments[0, 1], segments[0, 5], segments[0, 6] = row[17], x[i, 0], omega
        for k in range(4):
            state[k] = x[i, 1 + k]
        state[4], state[5] = 0.0, x[i, 5]
        run(
            row[:16],
            segments,
            state,
            no_times,
            no_samples,
            order,
            tolerance,
            np.inf,
            0.5 * np.pi,
            0.0,
            peaks_from,
            2,
            report,
        )
        for k in range(3):
            peaks[i, k] = report[PEAKS + k]
        if report[STATUS] == IMPACT_LIMIT and state[5] > 0.0:
            out[i, 0] = x[i, 0] + omega * report[END] - 2.0 * np.pi
            for k in range(4):
                out[i, 1 + k] = state[k]
            out[i, 5] = state[5]
