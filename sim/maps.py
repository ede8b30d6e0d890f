"""Maps of the gain coefficients over frequency and stiffness: both steady motions, their existence and stability.

Continuation over frequency gives the first row, at constant stiffness. From there, the columns of a strip are continued
over stiffness together, and each row is predicted from the previous ones. No transient has to be integrated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import tau

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.linear import frame_matrices
from sim.return_map import MOST_KNOWN, Solution, Solutions, extrapolated, follow, newton, parameters
from sim.specimen import Specimen
from sim.steady import NoOrbit, branch_solutions, check_steady, resting_rates
from sim.sweep import Done, processors, sweep

Floats = NDArray[np.float64]

STRIPS = 2
"""Number of strips of columns per processor: enough to balance the load, but few enough to keep each strip wide."""


@dataclass(frozen=True, eq=False)
class LayerMap:
    """Branch of steady motion over the grid of n stiffnesses by m frequencies; NaN where it does not exist.

    `peaks`, shape (n, m, 3): |u1|, |u2 - u1| [m], |theta| [rad]. `bare`, shape (m, 3): the same without block.
    `multipliers`: Floquet multipliers per period of the drive, shape (n, m, 6) of the rocking branch, (n, m, 4) of the
    resting one.
    """

    peaks: Floats
    bare: Floats
    multipliers: NDArray[np.complex128]

    @property
    def exists(self) -> NDArray[np.bool_]:
        """Mask of the cells where the motion exists, shape (n, m)."""
        return np.isfinite(self.peaks[:, :, 0])

    @property
    def alpha_1(self) -> Floats:
        """Gain coefficient of u1, shape (n, m). Source: Eq. (10)."""
        return self.peaks[:, :, 0] / self.bare[:, 0]

    @property
    def alpha_2(self) -> Floats:
        """Gain coefficient of the drift u2 - u1, shape (n, m). Source: Eq. (10)."""
        return self.peaks[:, :, 1] / self.bare[:, 1]

    @cached_property
    def multiplier(self) -> Floats:
        """Greatest |Floquet multiplier|, shape (n, m)."""
        return np.abs(self.multipliers).max(axis=2)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Mask of the cells where the motion exists and is stable, shape (n, m)."""
        return self.exists & (self.multiplier < 1.0)


@dataclass(frozen=True, eq=False)
class GainMap:
    """Both branches of steady motion over `betas`, shape (n,), and `omegas` [rad/s], shape (m,), under one amplitude
    [m/s2].

    `sections`, shape (n, m, 6): a point of each rocking orbit, [phase, u1, u2, v1, v2, omega], right after the impact
    into theta > 0; NaN where there is no orbit.
    """

    specimen: Specimen
    betas: Floats
    omegas: Floats
    amplitude: float
    rocking: LayerMap
    resting: LayerMap
    sections: Floats


def gain_map(
    specimen: Specimen,
    betas: Sequence[float] | Floats,
    omegas: Sequence[float] | Floats,
    amplitude: float,
    bare_amplitude: float | None = None,
    scheduler: str | None = None,
    done: Done | None = None,
) -> GainMap:
    """Gain coefficients of both branches at every stiffness ratio of `betas` and frequency of `omegas` [rad/s].

    The base acceleration is `amplitude` [m/s2] sin(omega t); in the test without block, its amplitude is
    `bare_amplitude`, if different. `scheduler` and `done` are those of `sim.sweep.sweep`. Raises InvalidInput for an
    empty axis or values outside their ranges.
    """
    rows, row_of = np.unique(np.asarray(betas, dtype=np.float64), return_inverse=True)
    columns, column_of = np.unique(np.asarray(omegas, dtype=np.float64), return_inverse=True)
    if not (rows.size and columns.size):
        raise InvalidInput("grid", (rows.size, columns.size), "the map needs at least one stiffness and one frequency")
    for omega in columns:
        check_steady(specimen.coupled(float(rows[0])), float(omega), amplitude)
    coupled = [specimen.coupled(float(beta)) for beta in rows]

    first = _first_row(coupled[0], columns, amplitude)
    parts = np.array_split(np.arange(columns.size), min(columns.size, STRIPS * processors(scheduler)))
    strips = [_Strip(coupled, columns[part], amplitude, _rows(first, part)) for part in parts]
    followed = sweep(_follow_strip, strips, scheduler, done=done)
    sections, peaks, jacobians = (np.concatenate(layer, axis=1) for layer in zip(*followed, strict=True))

    multipliers = np.full((*sections.shape[:2], 6), np.nan, dtype=np.complex128)
    exists = np.isfinite(sections[:, :, 0])
    multipliers[exists] = np.linalg.eigvals(jacobians[exists])
    bare = _linear_peaks(specimen, [0.0], columns, amplitude if bare_amplitude is None else bare_amplitude)[0][0]
    resting_peaks, resting_multipliers = _resting(coupled, columns, amplitude)
    place = np.ix_(row_of, column_of)
    return GainMap(
        specimen=specimen,
        betas=rows[row_of],
        omegas=columns[column_of],
        amplitude=amplitude,
        rocking=LayerMap(peaks[place], bare[column_of], multipliers[place]),
        resting=LayerMap(resting_peaks[place], bare[column_of], resting_multipliers[place]),
        sections=sections[place],
    )


@dataclass(frozen=True, eq=False)
class _Strip:
    """Columns that are continued together from the solutions of the first row."""

    specimens: list[Specimen]
    omegas: Floats
    amplitude: float
    first: Solutions


def _follow_strip(strip: _Strip) -> tuple[Floats, Floats, Floats]:
    """Sections, shape (n, m, 6), peaks, (n, m, 3), and Jacobians, (n, m, 6, 6), of n specimens and m columns."""
    rows = [strip.first]
    betas = [specimen.beta or 0.0 for specimen in strip.specimens]
    for i, specimen in enumerate(strip.specimens[1:], start=1):
        q = parameters(specimen, strip.omegas, strip.amplitude)
        near = slice(max(0, i - MOST_KNOWN), i)
        guess = extrapolated(betas[near], [row.section for row in rows[near]], betas[i])
        slope = extrapolated(betas[near], [row.jacobian for row in rows[near]], betas[i])
        row = newton(q, guess, slope, accuracy=2)
        before = parameters(strip.specimens[i - 1], strip.omegas, strip.amplitude)
        for j in np.flatnonzero(~row.found).tolist():
            # continue from the previous row in shorter steps, or from a neighbour in this row
            starts = [(rows[-1], before, j), (row, q, j - 1), (row, q, min(j + 1, len(q) - 1))]
            known = ((at, origin[k], k) for at, origin, k in starts if k >= 0 and at.found[k])
            found = next(filter(None, (follow(origin, at.section[k], q[j]) for at, origin, k in known)), None)
            if found is not None:
                row.put(j, found)
        rows.append(row)
    return (
        np.stack([row.section for row in rows]),
        np.stack([row.peaks for row in rows]),
        np.stack([row.jacobian for row in rows]),
    )


def _first_row(specimen: Specimen, omegas: Floats, amplitude: float) -> Solutions:
    """First row, from which all columns start; where continuation along it fails, points are computed separately."""
    places = [float(omega) for omega in omegas]
    try:
        branch = branch_solutions(specimen, places, amplitude)
    except NoOrbit:
        branch = {omega: solution for omega in places if (solution := _alone(specimen, omega, amplitude))}
    n = len(places)
    row = Solutions(np.full((n, 6), np.nan), np.full((n, 6, 6), np.nan), np.full((n, 3), np.nan), np.zeros(n, np.bool_))
    for i, omega in enumerate(places):
        if omega in branch:
            row.put(i, branch[omega])
    return row


def _alone(specimen: Specimen, omega: float, amplitude: float) -> Solution | None:
    try:
        return branch_solutions(specimen, [omega], amplitude)[omega]
    except NoOrbit:
        return None


def _rows(solutions: Solutions, part: NDArray[np.intp]) -> Solutions:
    return Solutions(solutions.section[part], solutions.jacobian[part], solutions.peaks[part], solutions.found[part])


def _linear_peaks(
    specimen: Specimen, springs: Sequence[float], omegas: Floats, amplitude: float
) -> tuple[Floats, NDArray[np.complex128]]:
    """Peaks, shape (n, m, 3), and complex u1, shape (n, m), of the frame with `springs` [N/m] fixed to the block."""
    mass, damping, stiffness = frame_matrices(specimen.frame)
    dynamic = stiffness - omegas[:, None, None] ** 2 * mass + 1j * omegas[:, None, None] * damping
    grounded = np.broadcast_to(dynamic, (len(springs), *dynamic.shape)).copy()
    grounded[:, :, 0, 0] += np.asarray(springs)[:, None]
    u = np.linalg.solve(grounded, np.broadcast_to(-amplitude * np.diag(mass)[:, None], (*grounded.shape[:2], 2, 1)))
    u1 = u[:, :, 0, 0].astype(np.complex128)
    drift = u[:, :, 1, 0] - u1
    return np.stack([np.abs(u1), np.abs(drift), np.zeros(u1.shape)], axis=2), u1


def _resting(specimens: list[Specimen], omegas: Floats, amplitude: float) -> tuple[Floats, NDArray[np.complex128]]:
    """Peaks, shape (n, m, 3), and multipliers, shape (n, m, 4), of the motion in which the block never lifts.

    Source: Eq. (9) and (A.3) over a whole period, as in `sim.steady.resting_state`.
    """
    block, springs = specimens[0].block, [specimen.k_c for specimen in specimens]
    peaks, u1 = _linear_peaks(specimens[0], springs, omegas, amplitude)
    moment = block.h_b * block.mass * amplitude - np.array(springs)[:, None] * specimens[0].frame.h1 * u1
    lifts = ~(np.abs(moment) < block.b * specimens[0].g * block.mass)
    rates = np.stack([resting_rates(specimen) for specimen in specimens])
    multipliers = np.exp(rates[:, None, :] * (tau / omegas)[None, :, None])
    peaks[lifts], multipliers[lifts] = np.nan, np.nan
    return peaks, multipliers
