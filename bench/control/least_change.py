"""Smallest change of a record that keeps the table within its limits of stroke and velocity at every sample.

The change is a sum of slow sines, zero at both ends of the record. Its cost is the integral of its square, weighted by
frequency because slow parts hardly affect the specimen, plus its effect on the peaks of oscillators at given periods.
This is a least-squares problem with linear inequalities: displacement and velocity at the samples are linear in the
amplitudes of the sines.
Inequalities are added at the peaks of the motion that reach a limit, until every sample is within its limits.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.analysis.table_motion import Array, TableMotion, table_motion, with_final_rest
from bench.control.target import Reach
from sim.errors import InvalidInput

INFEASIBLE = 1e-10
"""Residual of the dual least-squares problem below which the inequalities are treated as infeasible."""


class Infeasible(Exception):
    """Error raised if no vector satisfies all constraints."""


def shortest(equations: tuple[Array, Array], inequalities: tuple[Array, Array]) -> Array:
    """Vector y, shape (n,), of minimum norm with A y = b and G y >= h.

    After the minimum-norm solution of the equations has been split off, a least-distance problem remains; its dual is a
    non-negative least-squares problem. `equations` is (A, b), of full row rank, `inequalities` (G, h). Raises
    Infeasible. Source: Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23.
    """
    from scipy.optimize import nnls

    (a, b), (g, h) = equations, inequalities
    inverse = np.linalg.pinv(a)
    particular = inverse @ b
    free, needed = g - (g @ inverse) @ a, h - g @ particular
    if not (needed > 0.0).any():
        return particular
    # the scale is the distance to the farthest inequality
    scale = float((needed / np.linalg.norm(free, axis=1)).max())
    dual = np.vstack((scale * free.T, needed))
    target = np.zeros(dual.shape[0])
    target[-1] = 1.0
    multipliers = np.asarray(nnls(dual, target, maxiter=50 * h.size)[0], dtype=np.float64)
    residual = dual @ multipliers - target
    if -residual[-1] < INFEASIBLE:
        raise Infeasible
    # positive multipliers mark the active inequalities, whose equations determine the vector to within rounding
    active = multipliers > 0.0
    return particular + np.linalg.lstsq(free[active], needed[active], rcond=1e-12)[0]


class SineModes:
    """sin(k pi j / (n - 1)) at the samples j = 0 to n - 1, for every k with a frequency from `lowest` to `highest`
    [Hz].

    There are at least two modes. They vanish at both ends of the record.
    """

    def __init__(self, n: int, dt: float, highest: float, lowest: float = 0.0) -> None:
        self._n, self._dt = n, dt
        length = (n - 1) * dt
        first = min(max(int(np.ceil(2.0 * length * lowest)), 1), n - 3)
        last = min(max(int(np.ceil(2.0 * length * highest)), first + 1), n - 2)
        self._below = first - 1
        orders = np.arange(first, last + 1)
        self.frequencies: Array = orders / (2.0 * length)
        self._steps: Array = np.pi * orders / (n - 1)

    def sum(self, sizes: Array) -> Array:
        """The sum of the modes with amplitudes `sizes`, shape (k,), at the samples, shape (n,)."""
        whole = np.zeros(self._n)
        whole[1:-1] = 0.5 * _transformed(np.pad(sizes, (self._below, self._n - 2 - self._below - sizes.size)))
        return whole

    def products(self, weights: Array) -> Array:
        """Scalar products of `weights` at the samples, shape (n,), with each mode, shape (k,)."""
        return 0.5 * _transformed(weights[1:-1])[self._below : self._below + self._steps.size]

    def motions(self, samples: NDArray[np.intp]) -> tuple[Array, Array]:
        """Velocity and displacement at each of `samples`, shape (m,), due to each mode with unit amplitude, shape (m,
        k).

        Closed form of the first-order hold's sums over sines and cosines at equal steps theta: sum of sin(i theta), i <
        j, is (cos(theta/2) - cos((j - 1/2) theta)) / (2 sin(theta/2)), and so on.
        """
        dt, theta, j = self._dt, self._steps, samples[:, None]
        half = np.sin(0.5 * theta)
        sines = (np.cos(0.5 * theta) - np.cos((j - 0.5) * theta)) / (2.0 * half)
        cosines = 0.5 + np.sin((j - 0.5) * theta) / (2.0 * half)
        trapezium = 0.5 * dt / np.tan(0.5 * theta)
        velocity = trapezium * (1.0 - np.cos(j * theta))
        displacement = dt * trapezium * (j - cosines) + (dt * dt / 6.0) * (3.0 * sines + np.sin(j * theta))
        return velocity, displacement


def _transformed(values: Array) -> Array:
    """Type I discrete sine transform in scipy's definition, with a factor of 2; shape (n,)."""
    from scipy.fft import dst

    return np.asarray(dst(values, type=1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Peak:
    """Peak pseudo-acceleration of an oscillator [m/s2], with sign, and its derivative with respect to each sample of
    the excitation.
    """

    value: float
    weights: Array


def oscillator_peak(acceleration: Array, dt: float, period: float, damping: float) -> Peak:
    """`Peak` of the oscillator of `period` [s] under `acceleration` [m/s2], shape (n,), evaluated at the sample with
    the largest response.

    Uses the recursion of `bench.analysis.response_spectrum`: z' = lambda z + a, exact for linear interpolation between
    samples.
    """
    from scipy import signal

    omega = 2.0 * np.pi / period
    damped = omega * (1.0 - damping**2) ** 0.5
    x = complex(-damping * omega, damped) * dt
    first = np.expm1(x) / x
    second = (np.expm1(x) - x) / x**2
    taps = dt * second, dt * (first - second)
    # `Any`: scipy's stubs do not specify the type of a filtered array
    z: Any = signal.lfilter(taps, [1.0, -np.exp(x)], acceleration)
    response = np.asarray(-(omega**2 / damped) * z.imag, dtype=np.float64)
    at = int(np.abs(response).argmax())
    age = np.arange(at, -1, -1)
    answers = taps[0] * np.exp(x * age)
    answers[:-1] += taps[1] * np.exp(x * (age[:-1] - 1))
    weights = np.zeros_like(acceleration)
    weights[: at + 1] = -(omega**2 / damped) * answers.imag
    return Peak(float(response[at]), weights)


HIGHEST = 2.0
"""Highest frequency of a change [Hz], unless `ABOVE` times its lowest frequency is higher."""

ABOVE = 4.0
"""Smallest ratio of the highest to the lowest frequency of a change with a lower frequency limit: two octaves
suffice.
"""

CHEAP = 0.5
"""Frequency [Hz] at which the squared change has the weight 1; at a frequency f the weight is (f / CHEAP)^4."""

FLOOR = 0.05
"""Frequency [Hz] below which the weight is constant; with a smaller weight, slower sines would use up the stroke."""

SPECTRUM = 7.0
"""Duration [s] for which a change as large as the record's peak has the same cost as doubling every oscillator's
peak.
"""

PASSES = 2
"""Number of solutions; from the second on, the cost includes the oscillators' responses at the instants of the original
peaks and of the previous solution's peaks.
"""

CLOSER = 1e-4
"""Fraction of a limit that the solution reserves for rounding and for the samples between peaks."""

MOST_ROUNDS = 60
"""Maximum number of rounds in which samples are added; a dozen is usual."""


class _Bound(NamedTuple):
    """A sample at which `sign` times the velocity or displacement must not exceed the limit."""

    sample: int
    of_displacement: bool
    sign: int


def fit_by_least_change(
    acceleration: Array, dt: float, reach: Reach, periods: Array, damping: float, lowest: float = 0.0
) -> Array:
    """`acceleration` [m/s2], shape (n,), with the smallest change that keeps the table within `reach` and leaves it at
    rest.

    `periods` [s] and `damping` are those of the oscillators whose peaks are preserved; the change consists of
    sines with frequencies of at least `lowest` [Hz]. Raises InvalidInput if no sufficient change with frequencies
    between `lowest` and 2 Hz (or four times `lowest`, if higher) is found.
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
    """Least-change problem of one record and its limits; constrained samples remain constrained in later solutions."""

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
        """The record with the least-cost change; changes of the peaks are relative to `scales` [m/s2]."""
        from scipy.linalg import cholesky, solve_triangular

        pulls = np.array([self._modes.products(peak.weights) for peak in peaks]) / scales[:, None]
        root: Array = cholesky(np.diag(self._cost) + SPECTRUM / len(peaks) * (pulls.T @ pulls), lower=True)

        def rows(plain: Array) -> Array:
            """Convert coefficients of the modes' amplitudes to coefficients of y, whose squared norm is the cost."""
            return np.asarray(solve_triangular(root, plain.T, lower=True), dtype=np.float64).T

        ends = self._equations()
        equations = rows(ends[0]), ends[1]
        held, needed = self._inequalities(self._bounds)
        held = rows(held)
        for _ in range(MOST_ROUNDS):
            try:
                y = shortest(equations, (held, needed))
            except Infeasible:
                raise self._refusal(f"no change {self._kind} keeps the record") from None
            sizes = np.asarray(solve_triangular(root.T, y, lower=False), dtype=np.float64)
            fitted = with_final_rest(self._record - self._modes.sum(sizes), self._dt)
            motion = table_motion(fitted, self._dt)
            if self._reach.holds(motion):
                return fitted
            new = [bound for bound in self._broken(motion) if bound not in self._bounds]
            if not new:
                break
            self._bounds += new
            more, values = self._inequalities(new)
            held, needed = np.concatenate((held, rows(more))), np.concatenate((needed, values))
        raise self._refusal("the search found no change that keeps the record")

    def _equations(self) -> tuple[Array, Array]:
        """A and b of the equations A sizes = b, which make the table's velocity and displacement zero at the end of the
        record.
        """
        scale = np.array([self._reach.velocity, self._reach.displacement])
        velocity, displacement = self._modes.motions(np.array([self._record.size - 1]))
        last = np.array([self._motion.velocity[-1], self._motion.displacement[-1]])
        return np.concatenate((velocity, displacement)) / scale[:, None], last / scale

    def _broken(self, motion: TableMotion) -> list[_Bound]:
        """The local peaks at which a motion exceeds a limit or comes within the fraction `CLOSER` of it."""
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
        """G and h of the inequalities G sizes >= h, shapes (m, k) and (m,), which keep the sample of each bound within
        its limit.
        """
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
        return InvalidInput("record", peak, f"{why} within {allowed}: reduce its time scale or its acceleration")
