"""Floquet multipliers of the rocking orbits on fixed ground and on the table, and the boundaries of stability."""

from collections.abc import Sequence
from math import nan, pi

import numpy as np

from bench.datafile.tables import Column, Table
from bench.prediction.requests import StabilityRequest
from bench.prediction.steady import amplitude_of, predict_spectra
from bench.progress import Progress, counting, silent
from sim.gain import predict_gain
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit
from sim.sweep import in_threads
from sim.table_orbit import table_orbit

GROUNDS = {"fixed ground": "modulus", "table": "table_modulus"}
"""Name of the column of moduli for each ground."""

BOUNDARY = 1e-4
"""Maximum error of the frequency of a boundary [rad/s]."""

UNKNOWN = complex(nan, nan)

REAL = 0.02
"""Maximum distance of a multiplier's argument from 0 or pi [rad] at which the multiplier counts as real."""


def multipliers_table(
    specimen: Specimen, shaker: Shaker, request: StabilityRequest, progress: Progress = silent
) -> Table:
    """Table with one row per rocking orbit, by stiffness and ascending frequency: its gain, and its multiplier with the
    largest modulus on fixed ground and on the table; NaN where no orbit was found on the table.
    """
    found = predict_spectra(specimen, request, progress)
    branches = [(each.beta, each.omega, each.rocking) for each in found if each.rocking is not None]
    on_table = in_threads(
        lambda branch: _slowest(branch[2].orbit, "table", shaker, request.harmonics),
        branches,
        counting(progress, "computing the orbits on the table"),
    )
    fixed = [branch.orbit.slowest for _, _, branch in branches]

    def numbers(values: Sequence[float], unit: str, description: str) -> Column:
        return Column(np.array(values, dtype=np.float64), unit, description)

    moduli = "greatest |Floquet multiplier|: fraction of a disturbance that remains after a period,"
    angles = "argument of that multiplier: 0 for a fold, pi for a flip, between them for Neimark-Sacker,"
    return {
        "beta": numbers([beta for beta, _, _ in branches], "1", "stiffness ratio k_C/k1 of the coupling spring"),
        "omega_rad_s": numbers([omega for _, omega, _ in branches], "rad/s", "circular frequency of the base motion"),
        "alpha_2": numbers([branch.alpha_2 for _, _, branch in branches], "1", "gain of the peak drift on the orbit"),
        "modulus": numbers([abs(each) for each in fixed], "1", f"{moduli} on fixed ground"),
        "argument_rad": numbers([float(np.angle(each)) for each in fixed], "rad", f"{angles} on fixed ground"),
        "table_modulus": numbers([abs(each) for each in on_table], "1", f"{moduli} on the table"),
        "table_argument_rad": numbers([float(np.angle(each)) for each in on_table], "rad", f"{angles} on the table"),
    }


def boundaries_table(
    specimen: Specimen, shaker: Shaker, request: StabilityRequest, table: Table, progress: Progress = silent
) -> Table:
    """Table with one row per change of stability between adjacent rows of `table`, located by bisection."""
    amplitude = amplitude_of(specimen, request)
    columns = {name: column.values for name, column in table.items()}
    changes = [
        (ground, k, float(columns["beta"][k]))
        for ground, name in GROUNDS.items()
        for k in np.flatnonzero(
            (columns["beta"][1:] == columns["beta"][:-1]) & ((columns[name][1:] < 1.0) != (columns[name][:-1] < 1.0))
        ).tolist()
        if np.isfinite(columns[name][k : k + 2]).all()
    ]

    def located(change: tuple[str, int, float]) -> tuple[float, complex]:
        ground, k, beta = change
        low, high = (float(columns["omega_rad_s"][at]) for at in (k, k + 1))
        stable = bool(columns[GROUNDS[ground]][k] < 1.0)
        coupled, slowest = specimen.coupled(beta), UNKNOWN
        while high - low > BOUNDARY:
            middle = 0.5 * (low + high)
            branch = predict_gain(coupled, middle, amplitude).rocking
            slowest = UNKNOWN if branch is None else _slowest(branch.orbit, ground, shaker, request.harmonics)
            if np.isnan(slowest):
                return nan, UNKNOWN
            if (abs(slowest) < 1.0) == stable:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high), slowest

    found = in_threads(located, changes, counting(progress, "locating the boundaries"))
    return {
        "beta": Column(
            np.array([beta for *_, beta in changes], dtype=np.float64), "1", "stiffness ratio of the coupling spring"
        ),
        "ground": Column(np.array([ground for ground, *_ in changes], dtype=np.str_), "", "fixed ground, or table"),
        "omega_rad_s": Column(
            np.array([omega for omega, _ in found]), "rad/s", "frequency at which the stability of the orbit changes"
        ),
        "argument_rad": Column(
            np.array([float(np.angle(each)) for _, each in found]),
            "rad",
            "argument of the multiplier at this frequency",
        ),
        "kind": Column(
            np.array([_kind(each) for _, each in found], dtype=np.str_),
            "",
            "fold, flip or Neimark-Sacker; empty if the bisection found no orbit",
        ),
    }


def _slowest(orbit: Orbit, ground: str, shaker: Shaker, harmonics: int) -> complex:
    """Multiplier with the largest modulus on one of GROUNDS; UNKNOWN if no orbit is found on the table."""
    if ground == "fixed ground":
        return orbit.slowest
    try:
        return table_orbit(orbit, shaker, harmonics).slowest
    except NoOrbit:
        return UNKNOWN


def _kind(multiplier: complex) -> str:
    if np.isnan(multiplier):
        return ""
    angle = float(np.angle(multiplier))
    if angle < REAL:
        return "fold"
    return "flip" if pi - angle < REAL else "Neimark-Sacker"
