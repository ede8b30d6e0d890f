"""Gain surface and map as in Fig. 4 of the paper: a section of a report."""

from collections.abc import Sequence
from math import isqrt

import numpy as np

from bench.config.numbers import spaced
from bench.datafile.tables import arrays
from bench.document.document import Part, Picture, Section
from bench.figures.map_figure import BranchGrid, MapPoint, map_figure
from bench.prediction.gain_map import grids, map_table, resting_margin
from bench.prediction.requests import MapRequest
from sim.specimen import Specimen

LOW, HIGH, STEP = 12.0, 21.0, 0.1
BETA_LOW, BETA_HIGH, BETA_STEP = 0.1, 1.2, 0.02
"""Ranges and steps of the frequencies [rad/s] and of the stiffness ratios of a map; measured points outside extend the
ranges.
"""

MOST = 20_000
"""Largest number of points of a map."""


def map_request(amplitude_factor: float, measured: Sequence[MapPoint] = ()) -> MapRequest:
    """Frequencies and stiffness ratios of a map that includes the `measured` points; at most `MOST` points."""
    return MapRequest(
        omega=_axis(LOW, HIGH, STEP, [point.omega for point in measured], 0.5),
        beta=_axis(BETA_LOW, BETA_HIGH, BETA_STEP, [point.beta for point in measured], 0.05),
        amplitude_factor=amplitude_factor,
    )


def map_section(specimen: Specimen, amplitude_factor: float, measured: Sequence[MapPoint] = ()) -> Section:
    """Section with the gain surfaces and maps of both steady motions, rocking and resting, and the measured points."""
    request = map_request(amplitude_factor, measured)
    columns = arrays(map_table(specimen, request))

    def grid_of(name: str) -> BranchGrid:
        gains = {gain: grids(columns, request, name, gain) for gain in ("alpha_1", "alpha_2")}
        return BranchGrid(gains, grids(columns, request, name, "floquet_modulus"))

    rocking, resting = grid_of("rocking"), grid_of("resting")
    axes = np.array(request.omega), np.array(request.beta)
    figure = map_figure(*axes, rocking, resting, resting_margin(specimen, request), measured)
    lost = int(np.isnan(rocking.multiplier).sum())
    amplitude = amplitude_factor * specimen.uplift_acceleration
    text = (
        f"Steady motions under a sine of {amplitude:.4g} m/s² ({amplitude_factor:g} g/λ), computed as "
        f"periodic orbits at {len(request.omega)} frequencies by {len(request.beta)} stiffnesses, with their "
        "stability. Where the block may rest, two steady motions can exist, and the start of a test determines "
        "which one is reached. In the hatched areas the rocking motion is unstable: a test can lead to a "
        "modulated motion or to rest, or topple the block."
    )
    parts: list[Part] = [text]
    if lost:
        parts.append(f"Number of blank points, at which no rocking orbit was found: {lost}.")
    found = " Circles are measured points with their α₂." if measured else ""
    description = "Surfaces and contour maps of alpha 1 and alpha 2 against frequency and stiffness ratio."
    parts.append(Picture(figure, f"Gain surfaces (a) and maps (b, c) of α₁ and α₂, predicted.{found}", description))
    return Section("map", "Gain surface and map (as in Fig. 4 of the paper)", parts)


def _axis(low: float, high: float, step: float, places: Sequence[float], margin: float) -> tuple[float, ...]:
    """Equally spaced values over the range `low` to `high`, extended to include the measured `places` with a `margin`.
    The spacing exceeds `step` if there would otherwise be too many values.
    """
    least = min([low, *(place - margin for place in places if place < low)])
    most = max([high, *(place + margin for place in places if place > high)])
    least = max(least, step)
    count = min(round((most - least) / step) + 1, isqrt(MOST))
    return spaced(f"{least:.6g}", f"{most:.6g}", count)
