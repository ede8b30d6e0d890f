"""`rockbench predict steady`, `spectrum` and `map`: the same table, each with its figure and its text."""

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from bench.cli.predict_output import Result
from bench.cli.predict_text import extremes, prediction_table
from bench.prediction.files import provenance, rows_of
from bench.prediction.requests import GainRequest, HistoryRequest, MapRequest, SpectrumRequest, SteadyRequest
from bench.prediction.steady import predict_points, predict_spectra, steady_table
from bench.progress import Progress, counting
from bench.record.tables import Table, arrays
from sim.errors import RockbenchError
from sim.extras import require
from sim.gain import GainPrediction
from sim.knowledge import SpecimenKnowledge
from sim.loading import load_model
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.report.map_figure import Layer

_SHOWN = {
    "omega_rad_s": "omega",
    "beta": "beta",
    "layer": "layer",
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


def steady(request: SteadyRequest, specimen: Specimen, known: SpecimenKnowledge, progress: Progress) -> Result:
    """Steady motions at single points."""
    load_model(progress)
    table = _table(request, specimen, known, predict_points(specimen, request, progress), progress)

    def figure() -> "Figure":
        from bench.cli.predict_history import figure_of
        from bench.prediction.history import histories

        shared = request.model_dump(include={"omega", "beta", "amplitude_factor"})
        return figure_of(histories(specimen, HistoryRequest(**shared, steady=True, periods=2)))

    shown = {name: heading for name, heading in _SHOWN.items() if name in table}
    return _result(
        "steady motions under a sine", request, specimen, known, table, prediction_table(table, shown), figure
    )


def spectrum(request: SpectrumRequest, specimen: Specimen, known: SpecimenKnowledge, progress: Progress) -> Result:
    """Gain spectra, one for each stiffness."""
    load_model(progress)
    table = _table(request, specimen, known, predict_spectra(specimen, request, progress), progress)

    def figure() -> "Figure":
        from bench.report.figure import gain_spectra

        columns = arrays(table)
        return gain_spectra([], {**columns, "omega": columns["omega_rad_s"]})

    return _result("gain spectra", request, specimen, known, table, extremes(table), figure)


def gain_map(request: MapRequest, specimen: Specimen, known: SpecimenKnowledge, progress: Progress) -> Result:
    """Gain maps."""
    from bench.prediction.gain_map import grids, map_table, resting_margin

    if request.scheduler is not None:
        require("distributed", "--scheduler")
    load_model(progress)
    if request.solver == "taylor":
        table = map_table(specimen, request, known if request.band or request.members else None, progress)
        _tell_lost(len(request.omega) * len(request.beta) - int((table["layer"].values == "rocking").sum()))
    else:
        table = _table(
            request, specimen, known, predict_spectra(specimen, request, progress), progress, request.scheduler
        )

    def figure() -> "Figure":
        from bench.report.map_figure import Layer, map_figure

        columns = arrays(table)

        def layer(name: str) -> "Layer":
            gains = {gain: grids(columns, request, name, gain) for gain in ("alpha_1", "alpha_2")}
            return Layer(gains, grids(columns, request, name, "floquet_modulus"))

        axes = np.sort(request.omega), np.sort(request.beta)
        return map_figure(*axes, layer("rocking"), layer("resting"), resting_margin(specimen, request))

    return _result("gain maps", request, specimen, known, table, extremes(table), figure)


def _table(
    request: GainRequest,
    specimen: Specimen,
    known: SpecimenKnowledge,
    predictions: list[GainPrediction],
    progress: Progress,
    scheduler: str | None = None,
) -> Table:
    _tell_lost(sum(prediction.rocking is None for prediction in predictions))
    if request.solver == "taylor":
        return steady_table(predictions, known=known, members=request.members, progress=progress)
    from bench.prediction.timed import timed_gains

    return steady_table(
        predictions, timed_gains(specimen, request, predictions, scheduler, counting(progress, "simulating in time"))
    )


def _tell_lost(points: int) -> None:
    if points:
        print(f"rockbench: no rocking orbit was found at {points} point{'s' * (points > 1)}", file=sys.stderr)


def _result(
    title: str,
    request: GainRequest,
    specimen: Specimen,
    known: SpecimenKnowledge,
    table: Table,
    text: str,
    figure: "Callable[[], Figure]",
) -> Result:
    exists = bool(table["layer"].values.size)

    def drawn() -> "Figure":
        if not exists:
            raise RockbenchError("no steady motion was found, so there is nothing to draw: ask for other points")
        return figure()

    return Result(
        title=title,
        tables={"points": table},
        content={"points": rows_of(table)},
        text=text if exists else "no steady motion was found",
        metadata=provenance(request, specimen, known),
        figure=drawn,
    )
