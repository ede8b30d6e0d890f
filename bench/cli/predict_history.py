"""`rockbench predict history`, computed and put into every form of output."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bench.cli.predict_output import Result
from bench.cli.predict_text import prediction_table
from bench.prediction.files import plain, provenance, rows_of
from bench.prediction.history import History, histories, history_table, runs_table
from bench.prediction.requests import HistoryRequest
from bench.progress import Progress
from sim.loading import load_model
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {
    "omega_rad_s": "omega",
    "beta": "beta",
    "motion": "motion",
    "sampled_max_drift_m": "max drift",
    "sampled_max_bare_drift_m": "bare",
    "sampled_max_theta_rad": "max theta",
    "impacts": "impacts",
    "end_time_s": "end",
    "status": "status",
}


def history(request: HistoryRequest, specimen: Specimen, progress: Progress) -> Result:
    """Time histories from rest, or of steady motions."""
    load_model(progress)
    made = histories(specimen, request, progress)
    runs = runs_table(made)
    samples = ({name: plain(values) for name, values in each.values.items()} for each in made)
    return Result(
        title="time histories under a sine",
        tables={"histories": history_table(made), "runs": runs},
        content={"histories": [{**row, **values} for row, values in zip(rows_of(runs), samples, strict=True)]},
        text=prediction_table(runs, _SHOWN),
        metadata=provenance(request, specimen),
        figure=lambda: figure_of(made),
    )


def figure_of(made: Sequence[History]) -> "Figure":
    """The figure of some histories."""
    from bench.report.history_figure import Motion, history_figure

    return history_figure(
        [
            Motion(omega=each.omega, beta=each.beta, name=each.motion, status=each.status, values=each.values)
            for each in made
        ]
    )
