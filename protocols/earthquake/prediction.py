"""The gain curves that the model expects under the asked motions, computed and stored before the first sample moves."""

from functools import lru_cache

import numpy as np

from bench.config.model import BenchConfiguration
from bench.record.tables import Column, Table
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import shakings
from protocols.earthquake.sources import Sources
from sim.gain import SeismicGain, seismic_curve

STEP = 0.05
"""Distance of the stiffness ratios of a curve."""

MARGIN = 0.15
"""How far a curve goes beyond the measured stiffnesses."""


def gain_curves(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> Table:
    """alpha_1 and alpha_2 against beta for every record: one row per stiffness, NaN where the block topples."""
    rows = [(name, gain) for name, curve in _curves(parameters, configuration).items() for gain in curve]

    def numbers(values: list[float | None], unit: str, description: str) -> Column:
        return Column(np.array([np.nan if value is None else value for value in values]), unit, description)

    return {
        "record": Column(np.array([name for name, _ in rows], dtype=np.str_), "", "name of the record"),
        "beta": Column(np.array([gain.beta for _, gain in rows]), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": numbers([gain.alpha_1 for _, gain in rows], "1", "gain of the peak of u1"),
        "alpha_2": numbers([gain.alpha_2 for _, gain in rows], "1", "gain of the peak drift"),
        "toppled_s": numbers(
            [None if gain.motion.overturned is None else gain.motion.end_time for _, gain in rows],
            "s",
            "when the block overturns, counted from the drive's begin; NaN where it stands",
        ),
    }


def target_gains(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: Sources | None = None
) -> dict[tuple[str, float], float | None]:
    """alpha_2 under the asked motion for every record and asked stiffness; None where the block topples."""
    curves = _curves(parameters, configuration, sources)
    return {
        (name, gain.beta): gain.alpha_2
        for name, curve in curves.items()
        for gain in curve
        if gain.beta in parameters.beta
    }


def _curves(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: Sources | None = None
) -> dict[str, list[SeismicGain]]:
    # frozen parameters are hashable, though pydantic does not declare it
    return _computed(parameters, configuration, sources)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=4)
def _computed(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: Sources | None
) -> dict[str, list[SeismicGain]]:
    first, last = max(min(parameters.beta) - MARGIN, STEP), max(parameters.beta) + MARGIN
    grid = np.linspace(first, last, round((last - first) / STEP) + 1)
    betas = sorted({*(round(float(beta), 6) for beta in grid), *parameters.beta})
    specimen = configuration.known_specimen
    return {
        shaking.name: seismic_curve(specimen, shaking.prepared.record, betas)
        for shaking in shakings(parameters, configuration, sources)
    }
