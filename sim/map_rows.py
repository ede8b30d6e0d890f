"""Rocking orbits over a grid of frequency and stiffness, continued row after row.

Continuation over frequency gives the first row, at constant stiffness. From there, the columns of a strip are continued
over stiffness together, and each row is predicted from the previous ones. Memory is needed for one block of rows only,
since the next block continues from the last rows of the previous one.
"""

from collections.abc import Generator
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from sim.return_map import MOST_KNOWN, Solution, Solutions, extrapolated, follow, newton, parameters
from sim.specimen import Specimen
from sim.steady import NoOrbit, branch_solutions
from sim.sweep import Done, connection, sweep

Floats = NDArray[np.float64]

STRIPS, WIDE = 4, 125
"""Smallest number of strips of columns, and largest number of columns of a strip if there are more strips: enough of
them to balance the load, but wide ones. The number of processors has no influence on the strips, because an orbit may
be found from its neighbour in the same strip only.
"""

POINTS = 40_000
"""Approximate number of points of a block, which requires about 50 MB."""


@dataclass(frozen=True, eq=False)
class Continuation:
    """State after the first `rows` rows: the sections, shape (k, m, 6), and Jacobians, shape (k, m, 6, 6), of the last
    k rows.
    """

    rows: int
    sections: Floats
    jacobians: Floats


@dataclass(frozen=True, eq=False)
class Rows:
    """Orbits of n rows of m columns: sections, shape (n, m, 6), peaks, (n, m, 3), and multipliers, (n, m, 6)."""

    sections: Floats
    peaks: Floats
    multipliers: NDArray[np.complex128]


def rows_at_once(columns: int) -> int:
    """Number of rows of a block."""
    return max(POINTS // columns, MOST_KNOWN)


def rows_of_orbits(
    specimens: list[Specimen],
    omegas: Floats,
    amplitude: float,
    scheduler: str | None = None,
    done: Done | None = None,
    after: Continuation | None = None,
) -> Generator[tuple[Rows, Continuation], None, None]:
    """Orbits of each of the `specimens`, in blocks of rows, with the state from which the next block continues.

    The first block continues from the state `after`, if there is one. `scheduler` and `done` are those of
    `sim.sweep.sweep`; `done` counts the strips of each block.
    """
    with connection(scheduler):
        parts = np.array_split(np.arange(omegas.size), min(omegas.size, max(STRIPS, ceil(omegas.size / WIDE))))
        if after is None:
            first = _first_row(specimens[0], omegas, amplitude)
            after, size = Continuation(0, first.section[None], first.jacobian[None]), 1
            peaks = first.peaks[None]
        else:
            size, peaks = 0, np.empty((0, omegas.size, 3))
        while after.rows < len(specimens):
            end = min(after.rows + rows_at_once(omegas.size), len(specimens))
            # the first row is itself part of the first block
            begin = after.rows + size - len(after.sections)
            strips = [
                _Strip(
                    specimens[begin:end],
                    omegas[part],
                    amplitude,
                    after.sections[:, part],
                    after.jacobians[:, part],
                    peaks[:, part],
                )
                for part in parts
            ]
            followed = sweep(_follow_strip, strips, scheduler, done=done)
            found = [np.concatenate(each, axis=1) for each in zip(*followed, strict=True)]
            after = Continuation(end, found[3], found[4])
            size, peaks = 0, peaks[:0]
            yield Rows(found[0], found[1], found[2]), after


@dataclass(frozen=True, eq=False)
class _Strip:
    """Columns that are continued together, from known rows of the first specimens: `sections`, shape (k, m, 6), and
    `jacobians`, shape (k, m, 6, 6). The last j of these rows are part of the block of rows to be computed; `peaks`,
    shape (j, m, 3), are the peaks of these j rows.
    """

    specimens: list[Specimen]
    omegas: Floats
    amplitude: float
    sections: Floats
    jacobians: Floats
    peaks: Floats


def _follow_strip(strip: _Strip) -> tuple[Floats, Floats, NDArray[np.complex128], Floats, Floats]:
    """Sections, shape (n, m, 6), peaks, (n, m, 3), and multipliers, (n, m, 6), of n rows and m columns; then sections
    and Jacobians of the last rows.
    """
    known, own = len(strip.sections), len(strip.peaks)
    # peaks of rows before this block of rows are not needed
    peaks: Floats = np.full((known, *strip.sections.shape[1:2], 3), np.nan)
    peaks[known - own :] = strip.peaks
    rows = [
        Solutions(section, jacobian, peak, np.isfinite(section[:, 0]))
        for section, jacobian, peak in zip(strip.sections, strip.jacobians, peaks, strict=True)
    ]
    betas = [specimen.beta or 0.0 for specimen in strip.specimens]
    multipliers = [_multipliers(row) for row in rows[known - own :]]
    for i, specimen in enumerate(strip.specimens[known:], start=known):
        q = parameters(specimen, strip.omegas, strip.amplitude)
        near = slice(max(0, i - MOST_KNOWN), i)
        guess = extrapolated(betas[near], [row.section for row in rows[near]], betas[i])
        slope = extrapolated(betas[near], [row.jacobian for row in rows[near]], betas[i])
        row = newton(q, guess, slope, accuracy=2)
        before = parameters(strip.specimens[i - 1], strip.omegas, strip.amplitude)
        for j in np.flatnonzero(~row.found).tolist():
            # continue from the previous row in shorter steps, or from a neighbour in this row
            starts = [(rows[-1], before, j), (row, q, j - 1), (row, q, min(j + 1, len(q) - 1))]
            reached = ((at, origin[k], k) for at, origin, k in starts if k >= 0 and at.found[k])
            tried = (follow(origin, at.section[k], q[j])[0] for at, origin, k in reached)
            found = next(filter(None, tried), None)
            if found is not None:
                row.put(j, found)
        rows.append(row)
        multipliers.append(_multipliers(row))
    block, last = rows[known - own :], rows[-MOST_KNOWN:]
    return (
        np.stack([row.section for row in block]),
        np.stack([row.peaks for row in block]),
        np.stack(multipliers),
        np.stack([row.section for row in last]),
        np.stack([row.jacobian for row in last]),
    )


def _multipliers(row: Solutions) -> NDArray[np.complex128]:
    """Floquet multipliers, shape (m, 6); NaN where there is no orbit."""
    multipliers = np.full((len(row.found), 6), np.nan, dtype=np.complex128)
    if row.found.any():
        multipliers[row.found] = np.linalg.eigvals(row.jacobian[row.found])
    return multipliers


def _first_row(specimen: Specimen, omegas: Floats, amplitude: float) -> Solutions:
    """First row, from which all columns start; if continuation along it fails, its points are computed separately."""
    places = [float(omega) for omega in omegas]
    try:
        branch = branch_solutions(specimen, places, amplitude)
    except NoOrbit:
        branch = {omega: solution for omega in places if (solution := _single_solution(specimen, omega, amplitude))}
    n = len(places)
    row = Solutions(np.full((n, 6), np.nan), np.full((n, 6, 6), np.nan), np.full((n, 3), np.nan), np.zeros(n, np.bool_))
    for i, omega in enumerate(places):
        if omega in branch:
            row.put(i, branch[omega])
    return row


def _single_solution(specimen: Specimen, omega: float, amplitude: float) -> Solution | None:
    try:
        return branch_solutions(specimen, [omega], amplitude)[omega]
    except NoOrbit:
        return None
