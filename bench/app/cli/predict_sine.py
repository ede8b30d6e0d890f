"""Predictions under a sine, with tables, texts and figures: modes, histories, steady motions, spectra and maps."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.app.cli.output import Result, cell, columns_text
from bench.app.cli.predict import Subject
from bench.app.formatting import ABSENT
from bench.datafile.tables import Table, arrays
from bench.figures.text_table import TextColumn, text_table
from bench.prediction.files import plain, provenance, rows_of
from bench.prediction.history import History, histories, history_table, runs_table
from bench.prediction.requests import (
    GainRequest,
    HistoryRequest,
    MapRequest,
    ModesRequest,
    SpectrumRequest,
    SteadyRequest,
)
from bench.prediction.steady import modes_table, predict_points, predict_spectra, steady_table
from bench.progress import Progress, counting
from sim.errors import RockbenchError
from sim.gain import GainPrediction
from sim.loading import STEADY, load_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.figures.map_figure import BranchGrid

MOST_SPECTRA = 12
"""Maximum number of stiffnesses with separate rows in the summary."""

_MODES = {
    "system": "system",
    "beta": "beta",
    "mode": "mode",
    "frequency_hz": "frequency",
    "omega_rad_s": "omega",
    "growth_rate_per_s": "divergent",
    "shape_u1": "u1",
    "shape_u2": "u2",
    "shape_theta_rad_per_m": "theta",
}

_HISTORY = {
    "omega_rad_s": "omega",
    "beta": "beta",
    "motion": "motion",
    "sampled_max_drift_m": "max drift",
    "sampled_max_bare_drift_m": "bare",
    "sampled_max_theta_rad": "max theta",
    "impacts": "impacts",
    "end_time_s": "end",
    "condition_number": "condition",
    "relative_error": "error",
    "status": "status",
}

_STEADY = {
    "omega_rad_s": "omega",
    "beta": "beta",
    "layer": "branch",
    "alpha_1": "alpha_1",
    "alpha_2": "alpha_2",
    "alpha_2_low": "from",
    "alpha_2_high": "to",
    "theta_max_rad": "max theta",
    "impacts_per_period": "impacts",
    "floquet_modulus": "Floquet",
    "stable": "stable",
    "status": "status",
}


def modes(request: ModesRequest, subject: Subject, _progress: Progress) -> Result:
    """Modes of the bare frame and of the linearised coupled system."""
    table = modes_table(subject.specimen, request.beta)

    def figure() -> "Figure":
        from bench.figures.modes_figure import modes_figure

        return modes_figure(arrays(table), subject.specimen)

    return Result(
        title="modes of the bare frame and of the linearised coupled system",
        tables={"modes": table},
        content=lambda: {"modes": rows_of(table)},
        text=lambda: columns_text(table, _MODES),
        metadata=provenance(request, subject.specimen),
        figure=figure,
    )


def history(request: HistoryRequest, subject: Subject, progress: Progress) -> Result:
    """Time histories from rest, or of steady motions."""
    load_model(progress)
    found = histories(subject.specimen, request, progress)
    runs = runs_table(found)
    samples = ({name: plain(values) for name, values in each.values.items()} for each in found)
    return Result(
        title="time histories under a sine",
        tables={"histories": history_table(found), "runs": runs},
        content=lambda: {"histories": [{**row, **values} for row, values in zip(rows_of(runs), samples, strict=True)]},
        text=lambda: columns_text(runs, _HISTORY),
        metadata=provenance(request, subject.specimen),
        figure=lambda: _history_figure(found),
    )


def steady(request: SteadyRequest, subject: Subject, progress: Progress) -> Result:
    """Steady motions at single points."""
    load_model(progress, STEADY)
    table = _table(request, subject, predict_points(subject.specimen, request, progress), progress)

    def figure() -> "Figure":
        shared = request.model_dump(include={"omega", "beta", "amplitude_factor"})
        return _history_figure(histories(subject.specimen, HistoryRequest(**shared, steady=True, periods=2)))

    shown = {name: heading for name, heading in _STEADY.items() if name in table}
    return _result("steady motions under a sine", request, subject, table, lambda: columns_text(table, shown), figure)


def spectrum(request: SpectrumRequest, subject: Subject, progress: Progress) -> Result:
    """Gain spectra, one for each stiffness."""
    load_model(progress, STEADY)
    table = _table(request, subject, predict_spectra(subject.specimen, request, progress), progress)

    def figure() -> "Figure":
        from bench.figures.spectra_figure import gain_spectra

        columns = arrays(table)
        return gain_spectra([], {**columns, "omega": columns["omega_rad_s"]})

    return _result("gain spectra", request, subject, table, lambda: extremes(table), figure)


def gain_map(request: MapRequest, subject: Subject, progress: Progress) -> Result:
    """Gain maps; with an output file and the solver taylor, an interrupted map is continued."""
    from bench.prediction.gain_map import grids, map_table, resting_margin
    from bench.prediction.map_store import MapStore, discard

    load_model(progress, STEADY)
    stores = list[MapStore]()
    if request.solver == "taylor":
        known = subject.known if request.band or request.members else None

        def store() -> MapStore:
            inputs = provenance(request.model_copy(update={"scheduler": None}), subject.specimen, known)
            kept = MapStore(unfinished, inputs)
            if kept.after is not None:
                print(f"rockbench: the map continues at row {kept.after.rows + 1} ({unfinished})", file=sys.stderr)
            stores.append(kept)
            return kept

        unfinished = subject.unfinished or Path()
        try:
            table = map_table(subject.specimen, request, known, progress, None if subject.unfinished is None else store)
        except (KeyboardInterrupt, RockbenchError, OSError):
            for each in stores:
                if each.after is not None:
                    rows = f"complete rows: {each.after.rows} of {len(request.beta)}"
                    print(f"rockbench: {rows}; the same command continues the map", file=sys.stderr)
                each.close()
            raise
        print_lost(len(request.omega) * len(request.beta) - int((table["layer"].values == "rocking").sum()))
    else:
        spectra = predict_spectra(subject.specimen, request, progress)
        table = _table(request, subject, spectra, progress)

    def figure() -> "Figure":
        from bench.figures.map_figure import BranchGrid, map_figure

        columns = arrays(table)

        def grid_of(name: str) -> "BranchGrid":
            gains = {gain: grids(columns, request, name, gain) for gain in ("alpha_1", "alpha_2")}
            return BranchGrid(gains, grids(columns, request, name, "floquet_modulus"))

        axes = np.sort(request.omega), np.sort(request.beta)
        return map_figure(*axes, grid_of("rocking"), grid_of("resting"), resting_margin(subject.specimen, request))

    found = _result("gain maps", request, subject, table, lambda: extremes(table), figure)
    if stores:
        return replace(found, close=stores[0].remove)
    # an earlier, larger map with the same name may have left rows
    return found if subject.unfinished is None else replace(found, close=partial(discard, subject.unfinished))


def _table(request: GainRequest, subject: Subject, predictions: list[GainPrediction], progress: Progress) -> Table:
    print_lost(sum(prediction.rocking is None for prediction in predictions))
    scheduler = request.scheduler
    if request.solver == "taylor":
        return steady_table(
            predictions, known=subject.known, members=request.members, progress=progress, scheduler=scheduler
        )
    from bench.prediction.steady import timed_gains

    timed = timed_gains(subject.specimen, request, predictions, scheduler, counting(progress, "simulating in time"))
    return steady_table(predictions, timed)


def print_lost(points: int) -> None:
    if points:
        print(f"rockbench: no rocking orbit was found at {points} point{'s' * (points > 1)}", file=sys.stderr)


def _result(
    title: str,
    request: GainRequest,
    subject: Subject,
    table: Table,
    text: Callable[[], str],
    figure: "Callable[[], Figure]",
) -> Result:
    exists = bool(table["layer"].values.size)

    def checked() -> "Figure":
        if not exists:
            raise RockbenchError("no steady motion was found, so there is nothing to draw: choose other points")
        return figure()

    return Result(
        title=title,
        tables={"points": table},
        content=lambda: {"points": rows_of(table)},
        text=text if exists else lambda: "no steady motion was found",
        metadata=provenance(request, subject.specimen, subject.known),
        figure=checked,
    )


def _history_figure(found: Sequence[History]) -> "Figure":
    from bench.figures.history_figure import Motion, history_figure

    return history_figure(
        [
            Motion(omega=each.omega, beta=each.beta, name=each.motion, status=each.status, values=each.values)
            for each in found
        ]
    )


def extremes(table: "Table") -> str:
    """Least and greatest alpha_2 of each branch: at each stiffness, or over all if there are more than `MOST_SPECTRA`
    stiffnesses.
    """
    omega, beta, branch, alpha, stable = (
        table[name].values for name in ("omega_rad_s", "beta", "layer", "alpha_2", "stable")
    )
    stiffnesses = np.unique(beta)
    separate = len(stiffnesses) <= MOST_SPECTRA
    groups = [(value, beta == value) for value in stiffnesses] if separate else [(None, np.full(beta.size, True))]
    where = (TextColumn("at omega", "rad/s"), TextColumn("beta"))
    group = (TextColumn("beta"), TextColumn("branch"), TextColumn("points"), TextColumn("unstable"))
    columns = (*group, TextColumn("least alpha_2"), *where, TextColumn("greatest"), *where)
    rows: list[list[str]] = []
    for value, chosen in groups:
        for name in ("rocking", "resting"):
            here = np.flatnonzero(chosen & (branch == name))
            if not here.size:
                continue
            known: list[Any] = [ABSENT if value is None else float(value), name, here.size, int((~stable[here]).sum())]
            # a run in time that ended early has no gain
            ended = here[np.isfinite(alpha[here])]
            limits = (ended[alpha[ended].argmin()], ended[alpha[ended].argmax()]) if ended.size else ()
            found = [float(x) for k in limits for x in (alpha[k], omega[k], beta[k])] or [nan] * 6
            rows.append([cell(each) for each in (*known, *found)])
    return text_table(columns, rows)
