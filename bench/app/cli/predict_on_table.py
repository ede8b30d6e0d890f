"""Predictions on a table, with their tables, texts and figures: stability boundaries and long-term motions."""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from bench.app.cli.output import Result, columns_text
from bench.app.cli.predict import Subject
from bench.app.cli.predict_sine import print_lost
from bench.app.formatting import ABSENT
from bench.datafile.tables import Column, Table, arrays
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
    "amplitude_factor": "amplitude",
    "ground": "ground",
    "omega_rad_s": "boundary at omega",
    "omega_uncertainty_rad_s": "u",
    "largest": "largest part",
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
    """Multipliers of the rocking orbits, and the boundaries of stability with their sensitivities."""
    from bench.prediction.stability import boundaries_table, points_table, stability_boundaries, stability_points

    load_model(progress)
    shaker, specimen = _shaker(request, subject), subject.specimen
    orbits = stability_points(specimen, shaker, request, progress)
    points = points_table(orbits)
    print_lost(len(request.omega) * len(request.beta) * len(request.amplitude_factor) - len(orbits))
    if missing := int(np.isnan(points["table_modulus"].values).sum()):
        print(f"rockbench: points at which the shaker cannot move this table as requested: {missing}", file=sys.stderr)
    boundaries = boundaries_table(stability_boundaries(specimen, shaker, subject.known, request, orbits, progress))

    def figure() -> "Figure":
        from bench.figures.stability_figure import boundary_figure, stability_figure

        if not orbits:
            raise RockbenchError("no rocking motion was found, so there is nothing to draw: choose other points")
        draw = boundary_figure if len(request.amplitude_factor) > 1 else stability_figure
        return draw(arrays(points), arrays(boundaries))

    return Result(
        title="stability of the rocking motions",
        tables={"points": points, "boundaries": boundaries},
        content=lambda: {"points": rows_of(points), "boundaries": rows_of(boundaries)},
        text=lambda: _stability_text(boundaries, len(request.amplitude_factor) > 1),
        metadata=provenance(request, specimen, subject.known),
        figure=figure,
    )


def _stability_text(boundaries: Table, several: bool) -> str:
    """The boundaries with their uncertainties, and below them their sensitivities; the amplitude is listed if there are
    several.
    """
    if not boundaries["beta"].values.size:
        return "there is no stability boundary in the range"
    shown = {name: heading for name, heading in _BOUNDARIES.items() if several or name != "amplitude_factor"}
    identity = {name: shown[name] for name in ("beta", "amplitude_factor", "ground", "omega_rad_s") if name in shown}
    slopes = {
        name: name.removeprefix("omega_by_").removesuffix("_rad_s")
        for name in boundaries
        if name.startswith("omega_by_")
    }
    return "\n".join(
        [
            _columns(boundaries, shown),
            "",
            "u: standard uncertainty [rad/s] due to the specimen",
            "derivatives of the boundary [rad/s] with respect to the logarithm of each parameter:",
            _columns(boundaries, identity | slopes),
        ]
    )


def _columns(boundaries: Table, headings: Mapping[str, str]) -> str:
    """Text table; uncertainties and derivatives have three decimals, which their errors permit."""
    names = [name for name in headings if "_by_" in name or name.endswith("uncertainty_rad_s")]
    rounded = {name: np.array([_decimals(value) for value in boundaries[name].values]) for name in names}
    shown = {**boundaries, **{name: Column(values, "", "") for name, values in rounded.items()}}
    return columns_text(shown, headings)


def _decimals(value: float) -> str:
    return ABSENT if value != value else f"{value:.3f}"


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
