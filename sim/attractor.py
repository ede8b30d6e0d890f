"""Long-term motion of a specimen on the table of a bench: a periodic orbit, a torus, or a fall.

Where the orbit of one period is unstable, disturbances grow until the motion repeats after several periods, does not
repeat at all, or the block falls. The motion is integrated from a disturbed orbit under a drive that keeps the table's
mean harmonics at their requested values, as a slow amplitude control does.
"""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.table_orbit import TableOrbit, TablePeriod, corner, harmonics_of

Array = NDArray[np.float64]

TICKS, SUBSTEPS = 400, 1
"""Number of intervals of constant drive per period, and Runge-Kutta steps in each. In the cases compared, the greatest
peak differed by at most 0.2 % from that with 600 intervals of two steps, less than between two parts of a motion that
does not repeat.
"""

ROUNDING = 1e-6
"""Largest relative difference of peaks that are the same."""

LONGEST_PERIOD = 24
"""Longest period of the motion that is searched for [cycles]."""

KEPT = 10 * LONGEST_PERIOD
"""Number of final cycles that describe the long-term motion."""

DISTURBANCE = 0.1
"""Relative disturbance of the block's angle at the start."""

CONTROLLED, SHARE = 36, 0.5
"""Number of cycles between corrections of the drive, and the fraction of the error of the table's mean harmonics
removed by each.
"""

REPEATED, ALIKE = 0.01, 0.05
"""Largest change of a peak over one period of a motion that counts as periodic: relative to the largest peak, and
relative to the range of the peaks. The second limit is needed because a slow spiral also returns close to earlier
states.
"""


@dataclass(frozen=True, eq=False)
class Attractor:
    """Long-term motion: `peaks` of u1 and drift [m] in each of the last `KEPT` cycles, shape (KEPT, 2), and `within`,
    the smallest, mean and largest value of the largest drift [m] within a period that slides over these cycles.
    `fallen` is the number of cycles before the block fell, None if it did not fall. If it fell, `peaks` has no rows,
    and `within` describes the last `KEPT` cycles before; NaN if there were fewer.
    """

    peaks: Array
    within: tuple[float, float, float]
    fallen: int | None = None

    @property
    def repeats(self) -> int:
        """Number of cycles after which the motion repeats, up to `LONGEST_PERIOD`; 0 if it does not repeat, or if the
        block falls.
        """
        return period_of(self.peaks)


def attractor(specimen: Specimen, shaker: Shaker, orbit: TableOrbit, cycles: int = 1500) -> Attractor:
    """Long-term motion of `specimen` on the table of `shaker`, `cycles` cycles after a start on the disturbed `orbit`.

    The drive is initially that of the orbit, which may be the orbit of a similar specimen. It is then corrected so that
    the table's mean harmonics remain those of the orbit.
    """
    from sim.kernel.plant import FALLEN

    period = TablePeriod(specimen, shaker, orbit.omega, TICKS, SUBSTEPS)
    drive = orbit.drive
    orders = np.arange(1.0, drive.size + 1.0)
    response = shaker.gain / shaker.frequency_response(orders * orbit.omega, specimen.mass)
    y, mode = orbit.start.copy(), corner(orbit.start)
    y[6] *= 1.0 + DISTURBANCE
    commands = period.commands(drive)
    carried, mean = np.array([period.output(commands), 0.0]), np.zeros(drive.size, dtype=np.complex128)
    peaks, drifts = np.empty((cycles, 2)), np.empty((KEPT, TICKS))
    for cycle in range(cycles):
        mode, samples = period.advance(mode, y, carried, commands)
        if mode == FALLEN:
            before = _within(drifts, cycle) if cycle >= KEPT else (nan, nan, nan)
            return Attractor(np.empty((0, 2)), before, cycle)
        drift = drifts[cycle % KEPT] = np.abs(samples[:, 3] - samples[:, 2])
        peaks[cycle] = np.abs(samples[:, 2]).max(), drift.max()
        mean += harmonics_of(samples[:, -1], drive.size) / CONTROLLED
        if (cycle + 1) % CONTROLLED == 0:
            drive = drive + SHARE * (orbit.acceleration - mean) * response
            commands, mean = period.commands(drive), np.zeros(drive.size, dtype=np.complex128)
    return Attractor(peaks[-KEPT:], _within(drifts, cycles))


def _within(drifts: Array, cycles: int) -> tuple[float, float, float]:
    """Smallest, mean and largest value of the largest drift [m] within a period, for the last of so many `cycles`."""
    last = np.roll(drifts, -cycles, axis=0) if cycles > KEPT else drifts[:cycles]
    found = largest_within(last.ravel(), TICKS)
    return float(found.min()), float(found.mean()), float(found.max())


def largest_within(values: Array, length: int) -> Array:
    """Largest of the `values`, shape (n,), in each position of a window of `length` values, shape (n - length + 1,),
    with three comparisons per value (van Herk, Pattern Recognition Letters 13 (1992) 517).

    The values are split into blocks of the window's length: a window is the end of one block and the start of the next.
    `scipy.ndimage.maximum_filter1d` does the same, but its import takes up to a second, while a table is driven.
    """
    blocks = np.full((-(-values.size // length), length), -np.inf)
    blocks.ravel()[: values.size] = values
    starts = np.maximum.accumulate(blocks, axis=1).ravel()
    ends = np.maximum.accumulate(blocks[:, ::-1], axis=1)[:, ::-1].ravel()
    return np.maximum(ends[: values.size - length + 1], starts[length - 1 : values.size])


def period_of(peaks: Array) -> int:
    """Smallest number of cycles after which all peaks, shape (n, k), repeat, over at least two periods; 0 if they do
    not repeat.
    """
    if not peaks.size:
        return 0
    largest = peaks.max(axis=0)
    # the peaks of a constant motion differ by rounding only
    allowed = np.maximum(np.minimum(REPEATED * largest, ALIKE * np.ptp(peaks, axis=0)), ROUNDING * largest)
    for period in range(1, min(LONGEST_PERIOD, peaks.shape[0] // 2) + 1):
        if bool(np.all(np.abs(peaks[period:] - peaks[:-period]) <= allowed)):
            return period
    return 0
