"""The return map of steady rocking, its fixed points by Newton, and their continuation.

Section: just after the impact into theta > 0. Unknowns x = [phase, u1, u2, v1, v2, omega], shape (6,), with the phase
[rad] of the base's sine at that impact. The map goes over the next two impacts and takes 2 pi off the phase. It is
located on events, so its derivative needs no saltation matrices and its eigenvalues are the Floquet multipliers.

Parameters are one vector q, shape (18,): `Specimen.packed()`, omega [rad/s], amplitude [m/s2].
"""

from dataclasses import dataclass
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

ORDER, TOLERANCE = 18, 1e-11
"""Of the Taylor steps: the map is then smooth to rounding, which differencing it needs."""

DIFFERENCE = 1e-5
"""Relative step of the central differences: the product of the multipliers then errs by about 1e-10."""

CLOSURE = 1e-11
"""Scaled mismatch over one period at which an orbit counts as closed."""

MOST_ITERATIONS = 8
SMALLEST_ADVANCE = 1e-3
"""Limits of Newton's iterations and of the steps of `follow`, as a part of the way."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A fixed point: its section, shape (6,), the map's Jacobian there, shape (6, 6), peaks over the period."""

    section: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    peaks: tuple[float, float, float]


class ReturnMap:
    """The map for one parameter vector `q`; calling it costs about a hundredth of a millisecond."""

    def __init__(self, q: NDArray[np.float64]) -> None:
        from sim.kernel import rocking as kernel

        self._kernel = kernel
        self._p = np.ascontiguousarray(q[:16])
        omega, amplitude = float(q[16]), float(q[17])
        self._omega = omega
        # three periods: an orbit that has not returned by then is not one of period 2 pi / omega
        self._segments = np.array([[3.0 * tau / omega, amplitude, 0.0, 0.0, 0.0, 0.0, omega, 0.0, 0.0, 0.0]])
        self._no_times, self._no_samples = np.empty(0), np.empty((0, 6))
        self._report = np.empty(kernel.REPORT)
        length, angle = float(np.hypot(q[9], q[10])), float(q[9] / q[10])
        velocity = max(omega * angle, amplitude / omega)
        self.scale = np.array([1.0, length * angle, length * angle, length * velocity, length * velocity, velocity])

    def __call__(self, x: NDArray[np.float64], *, watch_peaks: bool = False) -> NDArray[np.float64] | None:
        """The image of `x`, shape (6,); None when the block does not come back to the section."""
        state = np.array([x[1], x[2], x[3], x[4], 0.0, x[5]])
        if not x[5] > 0.0:
            return None
        self._segments[0, 5] = x[0]
        self._kernel.run(
            self._p,
            self._segments,
            state,
            self._no_times,
            self._no_samples,
            ORDER,
            TOLERANCE,
            np.inf,
            0.5 * pi,
            0.0,
            0.0 if watch_peaks else np.inf,
            2,
            self._report,
        )
        if self._report[self._kernel.STATUS] != self._kernel.IMPACT_LIMIT or not state[5] > 0.0:
            return None
        phase = x[0] + self._omega * self._report[self._kernel.END] - tau
        return np.array([phase, state[0], state[1], state[2], state[3], state[5]])

    @property
    def peaks(self) -> tuple[float, float, float]:
        """|u1|, |u2 - u1|, |theta| of the last call that watched them."""
        u1, drift, theta = self._report[self._kernel.PEAKS :]
        return float(u1), float(drift), float(theta)

    def jacobian(self, x: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The derivative of the map at `x` by central differences, shape (6, 6); None where it is not defined."""
        columns: list[NDArray[np.float64]] = []
        for j in range(6):
            step = DIFFERENCE * self.scale[j]
            ahead, behind = x.copy(), x.copy()
            ahead[j] += step
            behind[j] -= step
            after, before = self(ahead), self(behind)
            if after is None or before is None:
                return None
            columns.append((after - before) / (ahead[j] - behind[j]))
        return np.column_stack(columns)


def newton(q: NDArray[np.float64], x: NDArray[np.float64]) -> Solution | None:
    """The fixed point near `x`; None when Newton does not converge to one."""
    return_map = ReturnMap(q)
    previous = np.inf
    for _ in range(MOST_ITERATIONS):
        image = return_map(x, watch_peaks=True)
        if image is None:
            return None
        peaks = return_map.peaks
        mismatch = image - x
        error = float(np.abs(mismatch / return_map.scale).max())
        jacobian = return_map.jacobian(x)
        if jacobian is None or not error < 10.0 * previous:
            return None
        if error < CLOSURE:
            return Solution(np.array([x[0] % tau, *x[1:]]), jacobian, peaks)
        previous = error
        try:
            x = x - np.linalg.solve(jacobian - np.eye(6), mismatch)
        except np.linalg.LinAlgError:
            return None
    return None


def follow(origin: NDArray[np.float64], x: NDArray[np.float64], target: NDArray[np.float64]) -> Solution | None:
    """The fixed point at parameters `target`, followed along the straight line from `x` near the one at `origin`.

    Steps grow while Newton converges and are halved when it does not; None when they get too short.
    """
    solution = newton(origin, x)
    if solution is None:
        return None
    span = target - origin
    if not span.any():
        return solution
    done, advance = 0.0, 1.0
    section, tangent = solution.section, np.zeros(6)
    while done < 1.0:
        place = min(done + advance, 1.0)
        found = newton(origin + place * span if place < 1.0 else target, section + (place - done) * tangent)
        if found is None:
            advance *= 0.5
            if advance < SMALLEST_ADVANCE:
                return None
            continue
        change = found.section - section
        change[0] = (change[0] + pi) % tau - pi
        tangent = change / (place - done)
        solution, section, done = found, found.section, place
        advance *= 2.0
    return solution
