"""The gain curves that the model expects under the asked motions, computed and stored before the first sample moves."""

from collections.abc import Mapping, Sequence

import numpy as np

from bench.record.tables import Column, Table
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import Shaking
from sim.gain import SeismicGain, seismic_curve
from sim.specimen import Specimen

STEP = 0.05
"""Distance of the stiffness ratios of a curve."""

MARGIN = 0.15
"""How far a curve goes beyond the measured stiffnesses."""


Curves = Mapping[str, Sequence[SeismicGain]]
"""Gains over ascending stiffness ratios, by record."""


def curves(parameters: EarthquakeParameters, shakings: Sequence[Shaking], specimen: Specimen) -> Curves:
    """The gains of every record under the asked motion, at the asked stiffnesses and between them."""
    first, last = max(min(parameters.beta) - MARGIN, STEP), max(parameters.beta) + MARGIN
    grid = np.linspace(first, last, round((last - first) / STEP) + 1)
    betas = sorted({*(round(float(beta), 6) for beta in grid), *parameters.beta})
    return {shaking.name: seismic_curve(specimen, shaking.prepared.record, betas) for shaking in shakings}


def gain_curves(curves: Curves) -> Table:
    """alpha_1 and alpha_2 against beta for every record: one row per stiffness, NaN where the block topples."""
    rows = [(name, gain) for name, curve in curves.items() for gain in curve]

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


def target_gains(curves: Curves, betas: Sequence[float]) -> dict[tuple[str, float], float | None]:
    """alpha_2 under the asked motion for every record and asked stiffness; None where the block topples."""
    return {(name, gain.beta): gain.alpha_2 for name, curve in curves.items() for gain in curve if gain.beta in betas}
