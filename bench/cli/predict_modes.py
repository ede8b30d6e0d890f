"""`rockbench predict modes`, computed and put into every form of output."""

from typing import TYPE_CHECKING

from bench.cli.predict_output import Result
from bench.cli.predict_text import prediction_table
from bench.prediction.files import provenance, rows_of
from bench.prediction.modes import modes_table
from bench.prediction.requests import ModesRequest
from bench.record.tables import arrays
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {
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


def modes(request: ModesRequest, specimen: Specimen) -> Result:
    """Modes of the bare frame and of the linearised coupled system."""
    table = modes_table(specimen, request.beta)

    def figure() -> "Figure":
        from bench.report.modes_figure import modes_figure

        return modes_figure(arrays(table), specimen)

    return Result(
        title="modes of the bare frame and of the linearised coupled system",
        tables={"modes": table},
        content={"modes": rows_of(table)},
        text=prediction_table(table, _SHOWN),
        metadata=provenance(request, specimen),
        figure=figure,
    )
