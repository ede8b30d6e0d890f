"""Predictions on a table, with their tables, texts and figures: stability boundaries and long-term motions."""

import sys
from typing import TYPE_CHECKING

import numpy as np

from bench.app.cli.output import Result, columns_text
from bench.app.cli.predict import Subject
from bench.app.cli.predict_sine import print_lost
from bench.datafile.tables import arrays
from bench.prediction.files import provenance, rows_of
from bench.prediction.requests import (
    AttractorRequest,
    OnTableRequest,
    StabilityRequest,
)
from bench.progress import Progress
from sim.errors import RockbenchError
from sim.loading import load_model
from sim.shaker import Shaker

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BOUNDARIES = {
    "beta": "beta",
    "ground": "ground",
    "omega_rad_s": "boundary at omega",
    "kind": "kind",
    "argument_rad": "argument",
}

_ATTRACTORS = {
    "omega_rad_s": "omega",
    "beta": "beta",
    "alpha_2": "alpha_2 of the orbit",
    "stable": "stable",
    "repeats_cycles": "repeats after",
    "alpha_2_least": "least peak",
    "alpha_2_greatest": "greatest",
    "greatest_low": "from",
    "greatest_high": "to",
    "falls": "falls",
}


def stability(request: StabilityRequest, subject: Subject, progress: Progress) -> Result:
    """Multipliers of the rocking orbits, and the boundaries of stability."""
    from bench.prediction.stability import boundaries_table, multipliers_table

    load_model(progress)
    shaker = _shaker(request, subject)
    points = multipliers_table(subject.specimen, shaker, request, progress)
    print_lost(len(request.omega) * len(request.beta) - points["beta"].values.size)
    if missing := int(np.isnan(points["table_modulus"].values).sum()):
        print(f"rockbench: points at which the shaker cannot move this table as requested: {missing}", file=sys.stderr)
    boundaries = boundaries_table(subject.specimen, shaker, request, points, progress)

    def text() -> str:
        if not boundaries["beta"].values.size:
            return "there is no stability boundary in the range"
        return columns_text(boundaries, _BOUNDARIES)

    def figure() -> "Figure":
        from bench.figures.stability_figure import stability_figure

        if not points["beta"].values.size:
            raise RockbenchError("no rocking motion was found, so there is nothing to draw: choose other points")
        return stability_figure(arrays(points), arrays(boundaries))

    return Result(
        title="stability of the rocking motions",
        tables={"points": points, "boundaries": boundaries},
        content=lambda: {"points": rows_of(points), "boundaries": rows_of(boundaries)},
        text=text,
        metadata=provenance(request, subject.specimen),
        figure=figure,
    )


def attractor(request: AttractorRequest, subject: Subject, progress: Progress) -> Result:
    """Long-term motions where the rocking orbits are unstable on the table."""
    from bench.prediction.attractors import attractors_table, long_terms

    load_model(progress)
    found = long_terms(subject.specimen, subject.known, _shaker(request, subject), request, progress)
    if lost := len(request.omega) * len(request.beta) - len(found):
        print(f"rockbench: no rocking orbit on the table was found at {lost} point{'s' * (lost > 1)}", file=sys.stderr)
    table = attractors_table(found)

    def figure() -> "Figure":
        from bench.figures.attractor_figure import attractor_figure

        if not found:
            raise RockbenchError("no rocking motion was found, so there is nothing to draw: choose other points")
        return attractor_figure(arrays(table), [each.gains for each in found])

    return Result(
        title="long-term motions on the table",
        tables={"points": table},
        content=lambda: {"points": rows_of(table)},
        text=lambda: columns_text(table, _ATTRACTORS) if found else "no rocking motion was found",
        metadata=provenance(request, subject.specimen, subject.known),
        figure=figure,
    )


def _shaker(request: OnTableRequest, subject: Subject) -> Shaker:
    """Shaker of the simulated bench, with the moving mass of the request, if given."""
    shaker = subject.configuration.simulation.bench.shaker
    return shaker if request.table_mass is None else shaker.model_copy(update={"moving_mass": request.table_mass})
