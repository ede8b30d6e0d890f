"""Return map of steady rocking, its fixed points by Newton's method, and their continuation.

The section is the state just after the impact into theta > 0: x = [phase, u1, u2, v1, v2, omega], shape (6,), where
phase [rad] is that of the base's sine at this impact. The map covers the next two impacts and subtracts 2 pi from the
phase. Because the section is an event, the derivative of the map needs no saltation matrices, and its eigenvalues are
the Floquet multipliers.

The parameters are one vector q, shape (18,): `Specimen.packed()`, omega [rad/s], amplitude [m/s2]. All functions apply
to many points at once: q has shape (n, 18), x shape (n, 6).
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import pi, prod, tau
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.specimen import Specimen

Floats = NDArray[np.float64]

ORDER, TOLERANCE = 18, 1e-11
"""Order and tolerance of the Taylor steps. With them, the map is smooth to within rounding errors, as required for
its numerical differentiation.
"""

Accuracy = Literal[2, 4]
"""Order of the finite differences for a Jacobian, which take 12 or 24 evaluations of the map."""

DIFFERENCE: dict[Accuracy, float] = {2: 4e-6, 4: 5e-5}
"""Relative steps at which truncation and rounding contribute about equally to the error of the multipliers, which is
then about 5e-10 and 5e-11, respectively.
"""

STENCIL: dict[Accuracy, tuple[Floats, Floats]] = {
    2: (np.array([1.0, -1.0]), np.array([0.5, -0.5])),
    4: (np.array([1.0, -1.0, 2.0, -2.0]), np.array([8.0, -8.0, -1.0, 1.0]) / 12.0),
}
"""Central differences: nodes in units of the step, and their weights."""

STEEP, GENTLE, SHORT = 100.0, 20.0, 1e-4
"""Largest derivative, relative to the scales of x, up to which these steps are used. Beyond it, they are reduced such
that the image moves as with a derivative of GENTLE; SHORT is the fraction of the steps for a first estimate where the
whole ones leave the domain of the map. The relative error of a dominant multiplier is then about 1e-12 times its
modulus.
"""

STEEPEST = 1e7
"""Derivative beyond which an orbit counts as not found: rounding errors of its section grow to visible changes of its
peaks within a period, and its multipliers would be inaccurate.
"""

CLOSURE = 1e-12
"""Scaled mismatch over one period below which an orbit counts as closed, or this part of a derivative above STEEP,
because rounding errors of the section grow by the derivative.
"""

SLOW = 0.1
"""A known Jacobian is kept while each Newton step reduces the mismatch to less than this fraction."""

NEAR = 0.3
"""Scaled mismatch beyond which a start is rejected, because Newton's method might converge to another orbit."""

MOST_ITERATIONS = 10
SMALLEST_ADVANCE = 1e-3
"""Maximum number of Newton iterations, and lower limit on the steps of `follow` as a fraction of the path."""

MOST_KNOWN = 5
"""Largest number of points used by an extrapolation; more would amplify the rounding errors of the Jacobians."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Fixed point: section, shape (6,), Jacobian of the map there, shape (6, 6), and peaks over the period, (3,)."""

    section: Floats
    jacobian: Floats
    peaks: Floats


@dataclass(frozen=True, eq=False)
class Solutions:
    """Fixed points: sections, shape (n, 6), Jacobians, (n, 6, 6), peaks, (n, 3), and mask of those found, (n,).

    The phase is not wrapped, and thus remains near that of the start. The rows of points not found are NaN.
    """

    section: Floats
    jacobian: Floats
    peaks: Floats
    found: NDArray[np.bool_]

    def one(self, i: int) -> Solution | None:
        """Solution in row `i`, or None if it was not found."""
        return Solution(self.section[i], self.jacobian[i], self.peaks[i]) if self.found[i] else None

    def put(self, i: int, solution: Solution) -> None:
        """Set row `i` to a solution that was found by other means."""
        self.section[i], self.jacobian[i], self.peaks[i] = solution.section, solution.jacobian, solution.peaks
        self.found[i] = True


def parameters(specimen: Specimen, omega: float | Floats, amplitude: float) -> Floats:
    """Parameter vectors q of one specimen, shape (n, 18), one for each `omega` [rad/s], shape (n,) or a number."""
    omegas = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    q = np.empty((omegas.size, 18))
    q[:, :16], q[:, 16], q[:, 17] = specimen.packed(), omegas, amplitude
    return q


def scales(q: Floats) -> Floats:
    """Scales of x, shape (n, 6), from the angle b / h_b, the block's diagonal and the drive's frequency."""
    length, angle = np.hypot(q[:, 9], q[:, 10]), q[:, 9] / q[:, 10]
    velocity = np.maximum(q[:, 16] * angle, q[:, 17] / q[:, 16])
    sizes = np.empty((len(q), 6))
    sizes[:, 0], sizes[:, 5] = 1.0, velocity
    sizes[:, 1:3], sizes[:, 3:5] = (length * angle)[:, None], (length * velocity)[:, None]
    return sizes


def images(q: Floats, x: Floats, *, watch_peaks: bool = False) -> tuple[Floats, Floats]:
    """Images of x, shape (n * m, 6), with m starts for each row of q, and their peaks, shape (n * m, 3).

    An image is NaN if the block does not return to the section within three periods. The peaks are the largest
    |u1|, |u2 - u1|, |theta| until the return; they are 0 without `watch_peaks`.
    """
    from sim.kernel import members as kernel

    n, row = len(x), np.repeat(np.arange(len(q)), len(x) // len(q))
    omega, starts = q[row, 16], x[:, 5] > 0.0
    segments, states, reports = np.zeros((n, 10)), np.zeros((n, 6)), np.empty((n, kernel.REPORT))
    # an orbit that has not returned after three periods does not have the period of the drive
    segments[:, 0], segments[:, 1], segments[:, 5], segments[:, 6] = 6.0 * pi / omega, q[row, 17], x[:, 0], omega
    states[:, :4], states[:, 5] = x[:, 1:5], x[:, 5]
    spans = np.arange(n)[:, None] + np.column_stack((np.zeros(n, np.int64), starts))
    kernel.advance_members(
        np.ascontiguousarray(q[:, :16]),
        row,
        segments,
        spans,
        states,
        ORDER,
        TOLERANCE,
        0.5 * pi,
        0.0,
        np.full(n, 0.0 if watch_peaks else np.inf),
        2,
        reports,
    )
    out = np.full((n, 6), np.nan)
    back = (reports[:, kernel.STATUS] == kernel.IMPACT_LIMIT) & (states[:, 5] > 0.0)
    out[back, 0] = x[back, 0] + omega[back] * reports[back, kernel.END] - tau
    out[back, 1:5], out[back, 5] = states[back, :4], states[back, 5]
    return out, reports[:, kernel.PEAKS :].copy()


def jacobians(q: Floats, x: Floats, accuracy: Accuracy = 4) -> Floats:
    """Derivatives of the map at x, shape (n, 6, 6); NaN where the map is not defined around x."""
    found = _differences(q, x, accuracy, np.ones(len(x)))
    # a large derivative may carry these steps out of the domain of the map
    lost = np.flatnonzero(np.isnan(found).any(axis=(1, 2)))
    if lost.size:
        found[lost] = _differences(q[lost], x[lost], accuracy, np.full(lost.size, SHORT))
    growth = _growth(q, found)
    found[lost[~(growth[lost] > STEEP)]] = np.nan
    steep = np.flatnonzero(growth > STEEP)
    if steep.size:
        found[steep] = _differences(q[steep], x[steep], accuracy, GENTLE / growth[steep])
    return found


def _growth(q: Floats, jacobian: Floats) -> Floats:
    """Largest derivative relative to the scales of x, shape (n,); NaN where the map is not defined."""
    sizes = scales(q)
    return np.abs(jacobian * (sizes[:, None, :] / sizes[:, :, None])).max(axis=(1, 2))


def _differences(q: Floats, x: Floats, accuracy: Accuracy, factors: Floats) -> Floats:
    """Finite differences at x, shape (n, 6, 6), with steps multiplied by `factors`, shape (n,)."""
    nodes, weights = STENCIL[accuracy]
    # the actual steps, after rounding
    steps = (x + DIFFERENCE[accuracy] * factors[:, None] * scales(q)) - x
    starts = x[:, None, None, :] + (nodes[:, None, None] * np.eye(6)) * steps[:, None, None, :]
    out, _ = images(q, starts.reshape(-1, 6))
    return np.einsum("s,nsji->nij", weights, out.reshape(len(x), nodes.size, 6, 6)) / steps[:, None, :]


def newton(q: Floats, x: Floats, known: Floats | None = None, accuracy: Accuracy | None = 4) -> Solutions:
    """Find the fixed points near x, shape (n, 6); `known` are guesses of the Jacobians there, shape (n, 6, 6).

    A Jacobian is reused while Newton's method converges, because a chord step costs only one evaluation. At the end it
    is computed again with `accuracy`; if this is None, the last computation is omitted, which saves most of the cost
    where only the points and their peaks are needed.
    """
    n = len(x)
    place, peaks, sizes = x.copy(), np.full((n, 3), np.nan), scales(q)
    jacobian = np.full((n, 6, 6), np.nan) if known is None else known.copy()
    found, previous, active = np.zeros(n, dtype=np.bool_), np.full(n, np.inf), np.arange(n)
    for _ in range(MOST_ITERATIONS):
        image, seen = images(q[active], place[active], watch_peaks=True)
        mismatch = image - place[active]
        error = np.abs(mismatch / sizes[active]).max(axis=1)
        growth = np.fmax(_growth(q[active], jacobian[active]) / STEEP, 1.0)
        closed, going = error < CLOSURE * growth, error < np.minimum(10.0 * previous[active], NEAR)
        found[active[closed]], peaks[active[closed]] = True, seen[closed]
        keep = ~closed & going
        active, mismatch, error = active[keep], mismatch[keep], error[keep]
        stale = np.isnan(jacobian[active, 0, 0]) | ((previous[active] < np.inf) & (error > SLOW * previous[active]))
        if stale.any():
            jacobian[active[stale]] = jacobians(q[active[stale]], place[active[stale]], 2)
        previous[active] = error
        place[active] -= _solved(jacobian[active] - np.eye(6), mismatch)
        if not active.size:
            break
    if found.any() and accuracy is not None:
        jacobian[found] = jacobians(q[found], place[found], accuracy)
        found &= _growth(q, jacobian) < STEEPEST
    for each in (place, jacobian, peaks):
        each[~found] = np.nan
    return Solutions(place, jacobian, peaks, found)


def follow(origin: Floats, x: Floats, target: Floats) -> tuple[Solution | None, float]:
    """Find the fixed point for the parameters `target`, shape (18,), by continuation from `x`, which is near the fixed
    point for `origin`.

    The path in parameter space is a straight line. Steps grow while Newton's method converges and are halved when it
    does not. Returns None if they become too short. The second value is the largest derivative, relative to the scales
    of x, at the last fixed point that was found.
    """
    solution = _at(origin.tobytes(), x.tobytes())
    if solution is None:
        return None, 0.0
    span = target - origin
    if not span.any():
        return solution, _steepness(origin, solution)
    done, advance = 0.0, 1.0
    section, tangent = solution.section, np.zeros(6)
    while done < 1.0:
        place = min(done + advance, 1.0)
        aim = origin + place * span if place < 1.0 else target
        found = newton(aim[None], (section + (place - done) * tangent)[None]).one(0)
        if found is None:
            advance *= 0.5
            if advance < SMALLEST_ADVANCE:
                return None, _steepness(origin + done * span, solution)
            continue
        change = found.section - section
        change[0] = (change[0] + pi) % tau - pi
        tangent = change / (place - done)
        solution, section, done = found, found.section, place
        advance *= 2.0
    return solution, _steepness(target, solution)


def follow_each(origin: Floats, x: Floats, targets: Floats) -> list[Solution | None]:
    """Find the fixed points for the parameters in each row of `targets`, shape (n, 18), as `follow` does for one.

    The first steps, which usually reach the targets, are taken together.
    """
    start = _at(origin.tobytes(), x.tobytes())
    if start is None:
        return [None] * len(targets)
    together = newton(targets, np.tile(start.section, (len(targets), 1)))
    return [together.one(i) or follow(origin, x, target)[0] for i, target in enumerate(targets)]


@lru_cache(maxsize=64)
def _at(origin: bytes, x: bytes) -> Solution | None:
    """Fixed point near `x` for the parameters `origin`, both as bytes: many paths begin at the same point."""
    return newton(np.frombuffer(origin)[None], np.frombuffer(x)[None]).one(0)


def _steepness(q: Floats, solution: Solution) -> float:
    return float(_growth(q[None], solution.jacobian[None])[0])


def extrapolated(places: Sequence[float], values: Sequence[Floats], place: float) -> Floats:
    """Value at `place` of the Lagrange polynomial through the last MOST_KNOWN of `values`, of any shape."""
    near, last = places[-MOST_KNOWN:], values[-MOST_KNOWN:]
    total = np.zeros_like(last[0])
    for at, value in zip(near, last, strict=True):
        total += value * prod((place - other) / (at - other) for other in near if other != at)
    return total


def _solved(matrices: Floats, right: Floats) -> Floats:
    """Solutions of linear systems, shape (n, 6); NaN where a matrix is singular or not finite."""
    solution = np.full(right.shape, np.nan)
    finite = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
    with suppress(np.linalg.LinAlgError):
        solution[finite] = np.linalg.solve(matrices[finite], right[finite][..., None])[..., 0]
        return solution
    usable = finite[np.linalg.det(matrices[finite]) != 0.0]
    solution[usable] = np.linalg.solve(matrices[usable], right[usable][..., None])[..., 0]
    return solution
