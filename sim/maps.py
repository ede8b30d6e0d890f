"""Maps of the gain coefficients over frequency and stiffness: both steady motions, their existence and stability.

The rocking orbits are continued over the grid by `sim.map_rows`; no transient has to be integrated.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.linear import frame_matrices
from sim.map_rows import Continuation, rows_at_once, rows_of_orbits
from sim.specimen import Specimen
from sim.steady import check_steady, resting_rates
from sim.sweep import Done

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BranchMap:
    """Branch of steady motion over the grid of n stiffnesses by m frequencies; NaN where it does not exist.

    `peaks`, shape (n, m, 3): |u1|, |u2 - u1| [m], |theta| [rad]. `bare`, shape (m, 3): the same without the block.
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
        """Modulus of the dominant Floquet multiplier, shape (n, m)."""
        return np.abs(self.multipliers).max(axis=2)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Mask of the cells where the motion exists and is stable, shape (n, m)."""
        return self.exists & (self.multiplier < 1.0)


@dataclass(frozen=True, eq=False)
class GainMap:
    """Both branches of steady motion over `betas`, shape (n,), and `omegas` [rad/s], shape (m,), for one amplitude
    [m/s2].

    `sections`, shape (n, m, 6): a point of each rocking orbit, [phase, u1, u2, v1, v2, omega], right after the impact
    into theta > 0; NaN where there is no orbit.
    """

    specimen: Specimen
    betas: Floats
    omegas: Floats
    amplitude: float
    rocking: BranchMap
    resting: BranchMap
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

    The base acceleration is `amplitude` [m/s2] sin(omega t); in the test without the block, its amplitude is
    `bare_amplitude`, if different. `scheduler` and `done` are those of `sim.sweep.sweep`. Raises InvalidInput for an
    empty axis, or a stiffness, frequency or amplitude outside its range.
    """
    rows, row_of = np.unique(np.asarray(betas, dtype=np.float64), return_inverse=True)
    columns, column_of = np.unique(np.asarray(omegas, dtype=np.float64), return_inverse=True)
    gone = 0

    def counted(finished: int, tasks: int) -> None:
        size = min(rows_at_once(columns.size), rows.size - gone)
        if done is not None:
            done(gone * tasks + finished * size, rows.size * tasks)

    blocks = list[GainMap]()
    for block, after in gain_map_blocks(specimen, rows, columns, amplitude, bare_amplitude, scheduler, counted):
        blocks.append(block)
        gone = after.rows
    place = np.ix_(row_of, column_of)

    def whole(values: Callable[[GainMap], NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([values(block) for block in blocks])[place]

    bare = blocks[0].rocking.bare[column_of]
    return GainMap(
        specimen=specimen,
        betas=rows[row_of],
        omegas=columns[column_of],
        amplitude=amplitude,
        rocking=BranchMap(whole(lambda b: b.rocking.peaks), bare, whole(lambda b: b.rocking.multipliers)),
        resting=BranchMap(whole(lambda b: b.resting.peaks), bare, whole(lambda b: b.resting.multipliers)),
        sections=whole(lambda b: b.sections),
    )


def gain_map_blocks(
    specimen: Specimen,
    betas: Floats,
    omegas: Floats,
    amplitude: float,
    bare_amplitude: float | None = None,
    scheduler: str | None = None,
    done: Done | None = None,
    after: Continuation | None = None,
) -> Generator[tuple[GainMap, Continuation], None, None]:
    """Same as `gain_map`, in blocks of `rows_at_once` stiffnesses; both axes must be ascending.

    Each block is returned with the state from which the next one continues. With this state as `after`, a map can be
    continued in another process, with bit-identical results. `done` counts the parts of each block.
    """
    if not (betas.size and omegas.size):
        raise InvalidInput("grid", (betas.size, omegas.size), "the map needs at least one stiffness and one frequency")
    for omega in omegas:
        check_steady(specimen.coupled(float(betas[0])), float(omega), amplitude)
    coupled = [specimen.coupled(float(beta)) for beta in betas]
    bare = _linear_peaks(specimen, [0.0], omegas, amplitude if bare_amplitude is None else bare_amplitude)[0][0]
    for rows, state in rows_of_orbits(coupled, omegas, amplitude, scheduler, done, after):
        part = slice(state.rows - len(rows.sections), state.rows)
        resting_peaks, resting_multipliers = _resting(coupled[part], omegas, amplitude)
        block = GainMap(
            specimen=specimen,
            betas=betas[part],
            omegas=omegas,
            amplitude=amplitude,
            rocking=BranchMap(rows.peaks, bare, rows.multipliers),
            resting=BranchMap(resting_peaks, bare, resting_multipliers),
            sections=rows.sections,
        )
        yield block, state


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
    # the spring would have no length
    lifts |= (np.array(springs) > 0.0)[:, None] & ~(peaks[:, :, 0] < specimens[0].d)
    rates = np.stack([resting_rates(specimen) for specimen in specimens])
    multipliers = np.exp(rates[:, None, :] * (tau / omegas)[None, :, None])
    peaks[lifts], multipliers[lifts] = np.nan, np.nan
    return peaks, multipliers
