"""Steady motions and their gain coefficients: one row for each layer that exists at a point."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.prediction.bands import bands
from bench.prediction.requests import SineRequest
from bench.progress import Progress, counting, silent
from bench.record.tables import Column, Table
from sim.gain import GainPrediction, gain_spectrum, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen
from sim.steady import Orbit
from sim.sweep import Done

if TYPE_CHECKING:
    from bench.prediction.timed import Timed

DIGITS = 11
"""Significant digits of peaks and gains.

Against orbits of order 26 closed to 5e-14, the peaks of 228 points of a map err by 1e-12 in the median and by 3e-11 at
most.
"""

MULTIPLIER_DIGITS = 9
"""Of Floquet multipliers, whose Jacobian comes from differences and errs by 1e-10 to 1e-9."""

COLUMNS: dict[str, tuple[str, str, int | None]] = {
    "omega_rad_s": ("rad/s", "circular frequency of the base motion", None),
    "beta": ("1", "stiffness ratio k_C/k1 of the coupling spring", None),
    "amplitude_m_s2": ("m/s2", "amplitude of the base acceleration", None),
    "layer": ("", "rocking, or resting where the block never lifts", None),
    "stable": ("1", "whether small disturbances die out", None),
    "alpha_1": ("1", "gain of the peak of u1, coupled over bare", DIGITS),
    "alpha_2": ("1", "gain of the peak drift u2 - u1, coupled over bare", DIGITS),
    "u1_max_m": ("m", "greatest |u1|", DIGITS),
    "drift_max_m": ("m", "greatest |u2 - u1|", DIGITS),
    "theta_max_rad": ("rad", "greatest |theta|", DIGITS),
    "bare_u1_max_m": ("m", "greatest |u1| of the bare frame", DIGITS),
    "bare_drift_max_m": ("m", "greatest |u2 - u1| of the bare frame", DIGITS),
    "impacts_per_period": ("1", "impacts of the block in a period of the drive", None),
    "floquet_modulus": (
        "1",
        "greatest |Floquet multiplier|: what is left of a disturbance after a period",
        MULTIPLIER_DIGITS,
    ),
    "floquet_argument_rad": ("rad", "argument of that multiplier: 0 fold, pi flip, between them Neimark-Sacker", 6),
}
"""Unit, meaning, and significant digits of what is computed."""

EXTRA: dict[str, tuple[str, str, int | None]] = {
    "alpha_2_uncertainty": ("1", "expanded uncertainty of alpha_2 (k = 2): what is left open of the specimen", 6),
    "alpha_2_low": ("1", "where the band of alpha_2 that holds 95 % begins", 6),
    "alpha_2_high": ("1", "where it ends", 6),
    "members_share": ("1", "share of the drawn specimens that have this motion; 1 to first order", 6),
    "status": ("", "exact, or how the run by another solver ended", None),
    "outcome": ("", "what the sine switched on at rest comes to: rocking, resting, other, toppled or failed", None),
    "outcome_time_s": ("s", "time of the overturning, or when the outcome was decided", None),
}

Row = dict[str, float | str | bool | None]


def amplitude_of(specimen: Specimen, request: SineRequest) -> float:
    """Amplitude of the base acceleration that is asked for [m/s2]."""
    return request.amplitude_factor * specimen.uplift_acceleration


def predict_points(specimen: Specimen, request: SineRequest, progress: Progress = silent) -> list[GainPrediction]:
    """A prediction for every frequency at every stiffness; each is found by itself, whatever else is asked for."""
    amplitude = amplitude_of(specimen, request)
    points = [(beta, omega) for beta in request.beta for omega in request.omega]
    found: list[GainPrediction] = []
    for beta, omega in points:
        progress("computing the steady motions", len(found), len(points))
        found.append(predict_gain(specimen.coupled(beta), omega, amplitude))
    return found


def predict_spectra(specimen: Specimen, request: SineRequest, progress: Progress = silent) -> list[GainPrediction]:
    """The same along ascending frequency, each from its neighbours: five times cheaper."""
    amplitude, omegas = amplitude_of(specimen, request), sorted(request.omega)
    found: list[GainPrediction] = []
    for i, beta in enumerate(request.beta):
        progress("computing the steady motions", i, len(request.beta))
        found += gain_spectrum(specimen.coupled(beta), omegas, amplitude)
    return found


def steady_table(
    predictions: Sequence[GainPrediction],
    timed: "Sequence[Timed | None] | None" = None,
    known: SpecimenKnowledge | None = None,
    members: int = 0,
    progress: Progress = silent,
) -> Table:
    """One row for each layer of each prediction, to the digits that are known.

    `timed`, one for each prediction: gains of the rocking layer by another solver, which take the place of the exact
    ones; how its run ended is then a column more. `known`: how well the specimen is; columns more are then the band of
    alpha_2, see `bench.prediction.bands.bands`.
    """
    rows: list[Row] = []
    for k, prediction in enumerate(predictions):
        for name in prediction.layers:
            row = _row(prediction, name)
            if timed is not None:
                run = timed[k] if name == "rocking" else None
                row |= run.as_row() if run is not None else {"status": "exact"}
            rows.append(row)
    names = [*COLUMNS, "status"] if timed is not None else list(COLUMNS)
    if not rows:
        return table_of({})
    columns: dict[str, NDArray[Any]] = {name: np.array([row[name] for row in rows]) for name in names}
    if known is not None:
        layers = [layer for prediction in predictions for layer in prediction.layers.values()]
        columns |= band_columns(
            [layer.orbit for layer in layers],
            columns["alpha_2"],
            known,
            members,
            counting(progress, "computing the uncertainty band"),
        )
    return table_of(columns)


def band_columns(
    orbits: Sequence[Orbit],
    alpha_2: NDArray[np.float64],
    known: SpecimenKnowledge,
    members: int,
    done: Done | None = None,
) -> dict[str, NDArray[np.float64]]:
    """The columns of a band of alpha_2, by name."""
    found = bands(orbits, alpha_2, known, members, done)
    return {
        "alpha_2_uncertainty": found.uncertainty,
        "alpha_2_low": found.low,
        "alpha_2_high": found.high,
        "members_share": found.share,
    }


def table_of(values: Mapping[str, NDArray[Any]]) -> Table:
    """The table of steady motions from its columns by name, rounded to the digits that are known."""
    made: dict[str, Column] = {}
    for name, (unit, description, digits) in {**COLUMNS, **EXTRA}.items():
        if name in EXTRA and name not in values:
            continue
        column = values.get(name, np.empty(0, np.float64 if unit else np.str_))
        made[name] = Column(column if digits is None else rounded(column, digits), unit, description)
    return made


def rounded(values: NDArray[np.float64], digits: int) -> NDArray[np.float64]:
    """`values`, shape (n,), to so many significant digits."""
    return np.array([float(f"{value:.{digits - 1}e}") for value in values.tolist()], dtype=np.float64)


def _row(prediction: GainPrediction, name: str) -> Row:
    layer, bare = prediction.layers[name], prediction.bare
    multipliers, peaks = layer.orbit.multipliers, layer.orbit.peaks
    return {
        "omega_rad_s": prediction.omega,
        "beta": prediction.beta,
        "amplitude_m_s2": prediction.amplitude,
        "layer": name,
        "stable": layer.stable,
        "alpha_1": layer.alpha_1,
        "alpha_2": layer.alpha_2,
        "u1_max_m": peaks.u1,
        "drift_max_m": peaks.drift,
        "theta_max_rad": peaks.theta,
        "bare_u1_max_m": bare.u1,
        "bare_drift_max_m": bare.drift,
        "impacts_per_period": layer.orbit.impacts,
        "floquet_modulus": layer.multiplier,
        # of a conjugate pair, the one in the upper half
        "floquet_argument_rad": abs(float(np.angle(multipliers[np.abs(multipliers).argmax()]))),
    }
