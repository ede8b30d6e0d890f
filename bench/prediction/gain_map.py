"""Gain map: rocking and resting steady motions on a grid of frequencies and stiffnesses, as in Fig. 4 of the paper."""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.datafile.tables import Column, Table
from bench.prediction.map_store import MapStore
from bench.prediction.requests import MapRequest
from bench.prediction.steady import amplitude_of, band_columns, table_of
from bench.progress import Progress, counting, silent
from sim.knowledge import SpecimenKnowledge
from sim.map_rows import rows_at_once
from sim.maps import BranchMap, GainMap, gain_map_blocks
from sim.rocking import Peaks, State
from sim.specimen import Specimen
from sim.steady import Orbit, resting_level
from sim.sweep import Done, connection

IMPACTS: dict[Literal["rocking", "resting"], int] = {"rocking": 2, "resting": 0}
"""Impacts per period of the drive, by branch."""


def map_table(
    specimen: Specimen,
    request: MapRequest,
    known: SpecimenKnowledge | None = None,
    progress: Progress = silent,
    store: Callable[[], MapStore] | None = None,
) -> Table:
    """Table with one row for each branch that exists at each point, sorted by stiffness, then frequency.

    If the uncertainties of the specimen are given as `known`, additional columns contain the band of alpha_2. A map of
    several blocks is kept in the `store`, if there is one, and continues after the last block stored there. Raises
    SchedulerUnavailable if the requested scheduler does not respond.
    """
    betas, omegas = np.sort(request.beta), np.sort(request.omega)
    amplitude = amplitude_of(specimen, request)
    kept = store() if store is not None and betas.size > rows_at_once(omegas.size) else None
    steps = _Steps(
        progress, betas.size, rows_at_once(omegas.size), 1 + request.outcomes + len(IMPACTS) * (known is not None)
    )
    after = None if kept is None else kept.after
    steps.rows = 0 if after is None else after.rows
    tables = list[Table]()
    map_done = steps.done(0, "computing the gain map")
    with connection(request.scheduler):
        for made, then in gain_map_blocks(
            specimen, betas, omegas, amplitude, scheduler=request.scheduler, done=map_done, after=after
        ):
            table = _block(made, request, known, steps)
            if kept is None:
                tables.append(table)
            else:
                kept.append(table, then)
            steps.rows = then.rows
    return _joined(tables) if kept is None else kept.table()


class _Steps:
    """Progress of a map over its blocks, each of which has the same number of steps. With one block, each step is
    reported as a phase; with several, the entire map is one phase.
    """

    def __init__(self, progress: Progress, total: int, size: int, count: int) -> None:
        self._progress, self._total, self._size, self._count = progress, total, size, count
        self.rows = 0
        """Completed rows of the map."""

    def done(self, step: int, phase: str) -> Done:
        """Function that reports the completed parts of `step` of the current block."""
        if self._total <= self._size:
            return counting(self._progress, phase)
        name = "computing the gain map"
        if step == 0:
            self._progress(name)

        def completed(parts: int, of: int) -> None:
            size = min(self._size, self._total - self.rows)
            share = (step + parts / max(of, 1)) * size
            self._progress(name, int(self._count * self.rows + share), self._count * self._total)

        return completed


def _block(made: GainMap, request: MapRequest, known: SpecimenKnowledge | None, steps: _Steps) -> Table:
    """Rows of a block of the map."""
    parts = [
        _columns(name, branch, made.omegas, made.betas, made.amplitude)
        for name, branch in zip(IMPACTS, (made.rocking, made.resting), strict=True)
    ]
    if request.outcomes:
        from sim.outcomes import outcome_map

        came = outcome_map(made, scheduler=request.scheduler, done=steps.done(1, "simulating from rest"))
        for part, branch in zip(parts, (made.rocking, made.resting), strict=True):
            part |= {"outcome": came.outcome[branch.exists], "outcome_time_s": came.time[branch.exists]}
    if known is not None:
        for step, (part, name) in enumerate(zip(parts, IMPACTS, strict=True), 1 + request.outcomes):
            done = steps.done(step, "computing the uncertainty band")
            orbits = _orbits(made, name)
            part |= band_columns(orbits, part["alpha_2"], known, request.members, done, request.scheduler)
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    # stable sort: at each point the rocking branch remains first
    order = np.lexsort((whole["omega_rad_s"], whole["beta"]))
    return table_of({name: values[order] for name, values in whole.items()})


def _joined(tables: list[Table]) -> Table:
    """One table with the rows of several tables."""
    if len(tables) == 1:
        return tables[0]
    return {
        name: Column(np.concatenate([table[name].values for table in tables]), each.unit, each.description)
        for name, each in tables[0].items()
    }


def grids(table: Mapping[str, NDArray[Any]], request: MapRequest, branch: str, name: str) -> NDArray[np.float64]:
    """Column `name` of a branch over the grid, shape (n_beta, n_omega), both ascending; NaN where there is no row."""
    betas, omegas = np.sort(request.beta), np.sort(request.omega)
    grid = np.full((betas.size, omegas.size), np.nan)
    rows = table["layer"] == branch
    i = np.searchsorted(betas, table["beta"][rows])
    j = np.searchsorted(omegas, table["omega_rad_s"][rows])
    grid[i, j] = table[name][rows]
    return grid


def resting_margin(specimen: Specimen, request: MapRequest) -> NDArray[np.float64]:
    """Margin of a resting block against uplift, shape (n_beta, n_omega), both ascending.

    Ratio of the amplitude that would uplift the block to the amplitude of the test, minus one. The resting branch
    exists where the margin is positive.
    """
    amplitude = amplitude_of(specimen, request)
    return np.array(
        [
            [resting_level(specimen.coupled(beta), omega) / amplitude - 1.0 for omega in sorted(request.omega)]
            for beta in sorted(request.beta)
        ]
    )


def _orbits(made: GainMap, name: Literal["rocking", "resting"]) -> list[Orbit]:
    """Motions of one branch, in the row order of its columns."""
    branch = made.rocking if name == "rocking" else made.resting
    specimens = [made.specimen.coupled(float(beta)) for beta in made.betas]
    orbits: list[Orbit] = []
    for i, j in np.argwhere(branch.exists).tolist():
        phase, u1, u2, v1, v2, velocity = np.nan_to_num(made.sections[i, j]).tolist()
        orbits.append(
            Orbit(
                specimen=specimens[i],
                omega=float(made.omegas[j]),
                amplitude=made.amplitude,
                branch=name,
                phase=phase,
                start=State(u1, u2, v1, v2, 0.0, velocity),
                peaks=Peaks(*branch.peaks[i, j].tolist()),
                impacts=IMPACTS[name],
                multipliers=branch.multipliers[i, j],
            )
        )
    return orbits


def _columns(
    name: Literal["rocking", "resting"],
    branch: BranchMap,
    omegas: NDArray[np.float64],
    betas: NDArray[np.float64],
    amplitude: float,
) -> dict[str, NDArray[Any]]:
    here = branch.exists
    n = int(here.sum())
    i, j = np.nonzero(here)
    multipliers = branch.multipliers[here]
    leading = multipliers[np.arange(n), np.abs(multipliers).argmax(axis=1)] if n else np.empty(0, np.complex128)
    return {
        "omega_rad_s": omegas[j],
        "beta": betas[i],
        "amplitude_m_s2": np.full(n, amplitude),
        "layer": np.full(n, name),
        "stable": branch.stable[here],
        "alpha_1": branch.alpha_1[here],
        "alpha_2": branch.alpha_2[here],
        "u1_max_m": branch.peaks[here, 0],
        "drift_max_m": branch.peaks[here, 1],
        "theta_max_rad": branch.peaks[here, 2],
        "bare_u1_max_m": branch.bare[j, 0],
        "bare_drift_max_m": branch.bare[j, 1],
        "impacts_per_period": np.full(n, IMPACTS[name]),
        "floquet_modulus": np.abs(leading),
        "floquet_argument_rad": np.abs(np.angle(leading)),
    }
