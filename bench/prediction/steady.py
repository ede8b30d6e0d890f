"""Modes of the specimen as in Fig. 3 of the paper, and steady motions with their gain coefficients, as tables.

Other solvers compute gains from long simulations that start on the exact orbit.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import nan, tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile.tables import Column, Table
from bench.prediction.bands import bands
from bench.prediction.requests import OrbitsRequest, SineRequest
from bench.progress import Progress, counting, silent
from sim.gain import GainPrediction, gain_spectrum, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.linear import Modes, bare_modes, coupled_modes
from sim.rocking import Status
from sim.specimen import Specimen
from sim.steady import Orbit
from sim.sweep import Done, sweep

RUN_DURATION = 120.0
"""Duration of a simulation [s], as in the paper."""


@dataclass(frozen=True)
class Timed:
    """Result of a simulation; gains and peaks are NaN if the simulation ended early. `impacts_per_period` is a mean."""

    alpha_1: float
    alpha_2: float
    u1: float
    drift: float
    theta: float
    impacts_per_period: float
    status: str

    def as_row(self) -> dict[str, float | str | bool | None]:
        """Values, by column, that the simulation contributes to a row of the table of steady motions."""
        return {
            "alpha_1": self.alpha_1,
            "alpha_2": self.alpha_2,
            "u1_max_m": self.u1,
            "drift_max_m": self.drift,
            "theta_max_rad": self.theta,
            "impacts_per_period": self.impacts_per_period,
            "status": self.status,
        }


def timed_gains(
    specimen: Specimen,
    request: SineRequest,
    predictions: Sequence[GainPrediction],
    scheduler: str | None = None,
    done: Done | None = None,
) -> list[Timed | None]:
    """Run one simulation per prediction by the requested solver, on all processors or by the `scheduler`; None where
    there is no rocking orbit.
    Raises InvalidInput for a tolerance outside the solver's range.
    """
    return sweep(partial(_timed, specimen, request.solver, request.tolerance), predictions, scheduler, done=done)


def _timed(specimen: Specimen, solver: str, tolerance: float | None, prediction: GainPrediction) -> Timed | None:
    from bench.comparators.catalogue import steady_gain_by_time

    if prediction.rocking is None:
        return None
    orbit = prediction.rocking.orbit
    run = steady_gain_by_time(
        solver,
        specimen.coupled(prediction.beta),
        prediction.omega,
        prediction.amplitude,
        RUN_DURATION,
        state=orbit.start,
        phase=orbit.phase,
        tolerance=tolerance,
    )
    motion = run.motion
    if motion.status is not Status.COMPLETED:
        return Timed(nan, nan, nan, nan, nan, nan, f"{motion.status} at {motion.end_time:.2f} s")
    impacts = motion.impacts / (RUN_DURATION * prediction.omega / tau)
    peaks = motion.peaks
    return Timed(run.alpha_1, run.alpha_2, peaks.u1, peaks.drift, peaks.theta, impacts, str(motion.status))


def modes_table(specimen: Specimen, betas: Sequence[float]) -> Table:
    """Table with one row per mode: the bare frame first (beta NaN), then the coupled system at each stiffness.

    Source: Eq. (12) to (14) of the paper. A divergent mode has a growth rate instead of a frequency.
    """
    rows = list(_mode_rows(float("nan"), bare_modes(specimen.frame)))
    for beta in betas:
        rows += _mode_rows(beta, coupled_modes(specimen.coupled(beta)))
    beta, mode, omega, u1, u2, theta = (np.array(column) for column in zip(*rows, strict=True))
    divergent = omega < 0.0
    return {
        "system": Column(np.where(np.isnan(beta), "bare", "coupled"), "", "bare frame, or coupled with the block"),
        "beta": Column(beta, "1", "stiffness ratio of the coupling spring; absent for the bare frame"),
        "mode": Column(mode.astype(np.int64), "1", "number of the mode, in ascending order of the eigenvalue"),
        "divergent": Column(
            divergent, "1", "whether the mode grows instead of oscillating, because its stiffness is negative"
        ),
        "omega_rad_s": Column(np.where(divergent, np.nan, omega), "rad/s", "circular frequency; absent if divergent"),
        "frequency_hz": Column(
            np.where(divergent, np.nan, omega / (2.0 * np.pi)), "Hz", "frequency; absent if divergent"
        ),
        "growth_rate_per_s": Column(np.where(divergent, -omega, np.nan), "1/s", "growth rate if divergent"),
        "signed_root_rad_s": Column(
            omega, "rad/s", "sign(lambda) sqrt|lambda|, where lambda is the eigenvalue of M^-1 K"
        ),
        "shape_u1": Column(
            u1, "1", "displacement of the first storey in the mode; normalised to unity unless it vanishes"
        ),
        "shape_u2": Column(u2, "1", "displacement of the second storey in the mode"),
        "shape_theta_rad_per_m": Column(theta, "rad/m", "rotation of the block in the mode; absent for the bare frame"),
    }


def _mode_rows(beta: float, modes: Modes) -> Iterator[tuple[float, float, float, float, float, float]]:
    for i, omega in enumerate(modes.omega):
        u1, u2, *theta = (float(value) for value in modes.shapes[:, i])
        yield beta, i + 1, float(omega), u1, u2, theta[0] if theta else float("nan")


DIGITS = 11
"""Significant digits of peaks and gains.

Compared with orbits computed at order 26, which are periodic to 5e-14, the peaks at 228 points of a map have a median
error of 1e-12 and a maximum error of 3e-11.
"""

MULTIPLIER_DIGITS = 9
"""Significant digits of Floquet multipliers: their Jacobian is computed by finite differences, with an error of 1e-10
to 1e-9.
"""

COLUMNS: dict[str, tuple[str, str, int | None]] = {
    "omega_rad_s": ("rad/s", "circular frequency of the base motion", None),
    "beta": ("1", "stiffness ratio k_C/k1 of the coupling spring", None),
    "amplitude_m_s2": ("m/s2", "amplitude of the base acceleration", None),
    "layer": ("", "rocking, or resting where the block never lifts", None),
    "stable": ("1", "whether small disturbances decay", None),
    "alpha_1": ("1", "gain of the peak of u1, coupled over bare", DIGITS),
    "alpha_2": ("1", "gain of the peak drift u2 - u1, coupled over bare", DIGITS),
    "u1_max_m": ("m", "greatest |u1|", DIGITS),
    "drift_max_m": ("m", "greatest |u2 - u1|", DIGITS),
    "theta_max_rad": ("rad", "greatest |theta|", DIGITS),
    "bare_u1_max_m": ("m", "greatest |u1| of the bare frame", DIGITS),
    "bare_drift_max_m": ("m", "greatest |u2 - u1| of the bare frame", DIGITS),
    "impacts_per_period": ("1", "impacts of the block per period of the drive", None),
    "floquet_modulus": (
        "1",
        "greatest |Floquet multiplier|: fraction of a disturbance that remains after a period",
        MULTIPLIER_DIGITS,
    ),
    "floquet_argument_rad": (
        "rad",
        "argument of that multiplier: 0 for a fold, pi for a flip, between them for Neimark-Sacker",
        6,
    ),
}
"""Unit, description and significant digits of the results."""

EXTRA: dict[str, tuple[str, str, int | None]] = {
    "alpha_2_uncertainty": ("1", "expanded uncertainty of alpha_2 (k = 2) due to the specimen", 6),
    "alpha_2_low": ("1", "lower bound of the 95 % band of alpha_2", 6),
    "alpha_2_high": ("1", "upper bound of the 95 % band of alpha_2", 6),
    "members_share": ("1", "fraction of the drawn specimens that have this motion; 1 for a first-order band", 6),
    "status": ("", "exact, or final status of the simulation by another solver", None),
    "outcome": ("", "outcome of the sine switched on at rest: rocking, resting, other, toppled or failed", None),
    "outcome_time_s": ("s", "time at which the block overturned or the outcome was decided", None),
}

Row = dict[str, float | str | bool | None]


def amplitude_of(specimen: Specimen, request: OrbitsRequest) -> float:
    """Requested amplitude of the base acceleration [m/s2]."""
    return request.amplitude_factor * specimen.uplift_acceleration


def predict_points(specimen: Specimen, request: SineRequest, progress: Progress = silent) -> list[GainPrediction]:
    """Compute one prediction for each frequency at each stiffness, independently of the others."""
    amplitude = amplitude_of(specimen, request)
    points = [(beta, omega) for beta in request.beta for omega in request.omega]
    found: list[GainPrediction] = []
    for beta, omega in points:
        progress("computing the steady motions", len(found), len(points))
        found.append(predict_gain(specimen.coupled(beta), omega, amplitude))
    return found


def predict_spectra(specimen: Specimen, request: OrbitsRequest, progress: Progress = silent) -> list[GainPrediction]:
    """Compute the predictions of `predict_points` faster, by continuation, at each stiffness in ascending order of
    frequency.
    """
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
    scheduler: str | None = None,
) -> Table:
    """Table with one row for each branch of each prediction, rounded to the significant digits.

    `timed` has one entry for each prediction: the gains of the rocking branch by another solver, which replace the
    exact ones; an additional column then states how the simulation ended. With `known`, the uncertainties of the
    specimen, additional columns contain the band of alpha_2 (see `bench.prediction.bands.bands`).
    """
    rows: list[Row] = []
    for k, prediction in enumerate(predictions):
        for name in prediction.branches:
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
        branches = [branch for prediction in predictions for branch in prediction.branches.values()]
        columns |= band_columns(
            [branch.orbit for branch in branches],
            columns["alpha_2"],
            known,
            members,
            counting(progress, "computing the uncertainty band"),
            scheduler,
        )
    return table_of(columns)


def band_columns(
    orbits: Sequence[Orbit],
    alpha_2: NDArray[np.float64],
    known: SpecimenKnowledge,
    members: int,
    done: Done | None = None,
    scheduler: str | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Columns for a band of alpha_2, by name."""
    found = bands(orbits, alpha_2, known, members, done, scheduler)
    return {
        "alpha_2_uncertainty": found.uncertainty,
        "alpha_2_low": found.low,
        "alpha_2_high": found.high,
        "members_share": found.share,
    }


def table_of(values: Mapping[str, NDArray[Any]]) -> Table:
    """Table of steady motions from its columns by name, rounded to the significant digits."""
    made: dict[str, Column] = {}
    for name, (unit, description, digits) in {**COLUMNS, **EXTRA}.items():
        if name in EXTRA and name not in values:
            continue
        column = values.get(name, np.empty(0, np.float64 if unit else np.str_))
        made[name] = Column(column if digits is None else rounded(column, digits), unit, description)
    return made


EXACT_POWER = 22
"""Largest power of ten that a double represents exactly. A division by such a power rounds only once, as does the
conversion of a decimal number.
"""

NEAR_TIE = 1e-3
"""A value whose discarded digits are closer to one half than this, in units of the last digit, is rounded by conversion
to text.
"""


def rounded(values: NDArray[np.float64], digits: int) -> NDArray[np.float64]:
    """Round `values`, shape (n,), to the given number of significant digits. The result is the double nearest to the
    decimal number, as after a conversion to text and back.
    """
    magnitude = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        power = digits - 1 - np.floor(np.log10(magnitude))
        scaled = magnitude * 10.0 ** np.clip(power, -EXACT_POWER, EXACT_POWER)
        whole = np.rint(scaled)
        # one rounding only: the integer and the power of ten are exact
        factor = 10.0 ** np.abs(np.clip(power, -EXACT_POWER, EXACT_POWER))
        found = np.copysign(np.where(power > 0, whole / factor, whole * factor), values)
        exact = (np.abs(power) <= EXACT_POWER) & (scaled >= 10.0 ** (digits - 1)) & (scaled < 10.0**digits - 1.0)
        exact &= np.abs(np.abs(scaled - whole) - 0.5) > NEAR_TIE
    plain = ~np.isfinite(values) | (values == 0.0)
    found[plain], exact[plain] = values[plain], True
    for at in np.flatnonzero(~exact).tolist():
        found[at] = float(f"{values[at]:.{digits - 1}e}")
    return found


def _row(prediction: GainPrediction, name: str) -> Row:
    branch, bare = prediction.branches[name], prediction.bare
    peaks = branch.orbit.peaks
    return {
        "omega_rad_s": prediction.omega,
        "beta": prediction.beta,
        "amplitude_m_s2": prediction.amplitude,
        "layer": name,
        "stable": branch.stable,
        "alpha_1": branch.alpha_1,
        "alpha_2": branch.alpha_2,
        "u1_max_m": peaks.u1,
        "drift_max_m": peaks.drift,
        "theta_max_rad": peaks.theta,
        "bare_u1_max_m": bare.u1,
        "bare_drift_max_m": bare.drift,
        "impacts_per_period": branch.orbit.impacts,
        "floquet_modulus": branch.multiplier,
        "floquet_argument_rad": float(np.angle(branch.orbit.slowest)),
    }
