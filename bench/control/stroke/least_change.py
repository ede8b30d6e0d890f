"""The good fit: the least change of the record that keeps the table within stroke and velocity at every sample.

The change is a sum of slow half sines. Its cost is the integral of its square, slow parts cheaper because the
specimen does not notice them, and what it does to the peaks of oscillators at the periods that count. That is
least squares under linear inequalities: |d| and |v| at the samples are linear in the sizes of the sines. Only samples
where a limit is about to be broken enter the problem; those that turn up while it is solved are added.
"""

from typing import NamedTuple

import numpy as np

from bench.analysis.table_motion import Array, TableMotion, at_rest_in_the_end, table_motion
from bench.control.stroke.least_distance import Infeasible, shortest
from bench.control.stroke.modes import SineModes
from bench.control.stroke.oscillators import Peak, oscillator_peak
from bench.control.stroke.reach import Reach
from sim.errors import InvalidInput

HIGHEST = 2.0
"""Highest frequency of a change [Hz], or `ABOVE` times its lowest where that is more."""

ABOVE = 4.0
"""Two octaves are room enough for a change that must not go below some frequency."""

CHEAP = 0.5
"""Frequency [Hz] at which the change costs its square; elsewhere (f / CHEAP)^4 times that."""

FLOOR = 0.05
"""Frequency [Hz] below which it becomes no cheaper: a slower sine uses the stroke up at once."""

SPECTRUM = 7.0
"""Time [s] for which a change as large as the record's peak costs as much as doubling every oscillator's peak."""

PASSES = 2
"""Solutions: each looks at the oscillators' peaks where they were and where they have gone to."""

CLOSER = 1e-4
"""Share of a limit that is kept free while solving, so that rounding and the samples between peaks do not break it."""

MOST_ROUNDS = 60
"""Rounds of adding samples; a dozen is usual."""


class _Bound(NamedTuple):
    """A sample at which `sign` times velocity or displacement is held to its limit."""

    sample: int
    of_displacement: bool
    sign: int


def fit_by_least_change(
    acceleration: Array, dt: float, reach: Reach, periods: Array, damping: float, lowest: float = 0.0
) -> Array:
    """`acceleration` [m/s2], shape (n,), changed as little as keeps the table in `reach` and ends it at rest.

    `periods` [s] and `damping` of the oscillators whose peaks are to stay; the change has no part below `lowest` [Hz].
    Raises InvalidInput where no change from there to 2 Hz, or to four times it, is enough.
    """

    def peaks_of(record: Array) -> list[Peak]:
        return [oscillator_peak(record, dt, float(period), damping) for period in periods]

    problem = _Problem(acceleration, dt, reach, lowest)
    peaks = original = peaks_of(acceleration)
    scales = np.abs([peak.value for peak in original])
    fitted = problem.solved(peaks, scales)
    for _ in range(PASSES - 1):
        peaks, scales = peaks_of(fitted) + original, np.tile(scales[: len(original)], 2)
        fitted = problem.solved(peaks, scales)
    return fitted


class _Problem:
    """One record and its limits; samples that were held stay so from one solution to the next."""

    def __init__(self, acceleration: Array, dt: float, reach: Reach, lowest: float) -> None:
        self._record, self._dt, self._reach = acceleration, dt, reach
        highest = max(HIGHEST, ABOVE * lowest)
        self._modes = SineModes(acceleration.size, dt, highest, lowest)
        self._kind = f"below {highest:g} Hz" if lowest == 0.0 else f"from {lowest:.3g} to {highest:.3g} Hz"
        length = (acceleration.size - 1) * dt
        size = float(np.abs(acceleration).max())
        self._cost = 0.5 * length * (np.maximum(self._modes.frequencies, FLOOR) / CHEAP) ** 4 / size**2
        self._motion = table_motion(acceleration, dt)
        self._bounds: list[_Bound] = []

    def solved(self, peaks: list[Peak], scales: Array) -> Array:
        """The record with the change that costs least; a change of each peak counts relative to its scale [m/s2]."""
        from scipy.linalg import cholesky, solve_triangular

        pulls = np.array([self._modes.products(peak.weights) for peak in peaks]) / scales[:, None]
        root: Array = cholesky(np.diag(self._cost) + SPECTRUM / len(peaks) * (pulls.T @ pulls), lower=True)

        def rows(plain: Array) -> Array:
            """Rows over the sizes of the modes as rows over y = root' sizes, whose square is the cost."""
            return np.asarray(solve_triangular(root, plain.T, lower=True), dtype=np.float64).T

        ends = self._equations()
        equations = rows(ends[0]), ends[1]
        held, needed = self._inequalities(self._bounds)
        held = rows(held)
        for _ in range(MOST_ROUNDS):
            try:
                y = shortest(equations, (held, needed))
            except Infeasible:
                raise self._refusal(f"no change {self._kind} keeps it") from None
            sizes = np.asarray(solve_triangular(root.T, y, lower=False), dtype=np.float64)
            fitted = at_rest_in_the_end(self._record - self._modes.sum(sizes), self._dt)
            motion = table_motion(fitted, self._dt)
            if self._reach.holds(motion):
                return fitted
            new = [bound for bound in self._broken(motion) if bound not in self._bounds]
            if not new:
                break
            self._bounds += new
            more, values = self._inequalities(new)
            held, needed = np.concatenate((held, rows(more))), np.concatenate((needed, values))
        raise self._refusal("the search ended before a change kept it")

    def _equations(self) -> tuple[Array, Array]:
        """A and b of A sizes = b that take back the record's velocity and displacement at its end."""
        scale = np.array([self._reach.velocity, self._reach.displacement])
        velocity, displacement = self._modes.motions(np.array([self._record.size - 1]))
        last = np.array([self._motion.velocity[-1], self._motion.displacement[-1]])
        return np.concatenate((velocity, displacement)) / scale[:, None], last / scale

    def _broken(self, motion: TableMotion) -> list[_Bound]:
        """The local peaks of a motion that are beyond a limit."""
        found: list[_Bound] = []
        for share, far in (
            (motion.velocity / self._reach.velocity, False),
            (motion.displacement / self._reach.displacement, True),
        ):
            size = np.abs(share)
            peak = (size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] > 1.0 - CLOSER)
            found += [_Bound(int(j), far, 1 if share[j] > 0.0 else -1) for j in np.flatnonzero(peak) + 1]
        return found

    def _inequalities(self, bounds: list[_Bound]) -> tuple[Array, Array]:
        """G and h of G sizes >= h that keep each bound's sample within its limit, shapes (m, k) and (m,)."""
        samples = np.array([bound.sample for bound in bounds], dtype=np.intp)
        far = np.array([bound.of_displacement for bound in bounds], dtype=np.bool_)
        signs = np.array([bound.sign for bound in bounds], dtype=np.float64)
        limits = np.where(far, self._reach.displacement, self._reach.velocity)
        velocity, displacement = self._modes.motions(samples)
        made = np.where(far[:, None], displacement, velocity) * (signs / limits)[:, None]
        there = np.where(far, self._motion.displacement[samples], self._motion.velocity[samples]) * signs / limits
        return made, there - (1.0 - CLOSER)

    def _refusal(self, why: str) -> InvalidInput:
        allowed = f"{1e3 * self._reach.displacement:.3g} mm and {self._reach.velocity:.3g} m/s"
        peak = f"peak displacement {1e3 * self._motion.peak_displacement:.3g} mm"
        return InvalidInput("record", peak, f"{why} within {allowed}: scale its time or its acceleration down")
