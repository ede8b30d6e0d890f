"""Floquet multipliers of the rocking orbits on fixed ground and on the table, and the boundaries of stability, with
their sensitivities to the parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import nan, pi
from typing import Literal

import numpy as np

from bench.datafile.tables import Column, Table
from bench.prediction.requests import StabilityRequest
from bench.progress import Progress, counting, silent
from sim.gain import gain_spectrum, predict_gain
from sim.knowledge import RESTITUTION, SpecimenKnowledge
from sim.multiplier_sensitivity import AMPLITUDE, OF_SPECIMEN, TABLE_MASS, MultiplierSlopes, fixed_slopes, table_slopes
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit
from sim.sweep import in_threads
from sim.table_orbit import table_orbit

Ground = Literal["fixed ground", "table"]

GROUNDS: dict[Ground, str] = {"fixed ground": "modulus", "table": "table_modulus"}
"""Name of the column of moduli for each ground."""

BOUNDARY = 1e-4
"""Maximum error of the frequency of a boundary [rad/s]."""

REAL = 0.02
"""Maximum distance of a multiplier's argument from 0 or pi [rad] at which the multiplier counts as real."""

PARAMETERS = {name: name for name in (*OF_SPECIMEN, AMPLITUDE, TABLE_MASS)} | {RESTITUTION: "restitution"}
"""Name of each parameter in columns."""


@dataclass(frozen=True, eq=False)
class Found:
    """Dominant multiplier of an orbit, NaN if there is no orbit, and its sensitivities, if they were computed."""

    multiplier: complex = complex(nan, nan)
    slopes: MultiplierSlopes | None = None


@dataclass(frozen=True, eq=False)
class StabilityPoint:
    """Rocking orbit of a specimen with the spring `beta` at `factor` times the uplift acceleration, with its gain, and
    its multiplier on each ground.
    """

    beta: float
    factor: float
    orbit: Orbit
    alpha_2: float
    on: dict[Ground, Found]


@dataclass(frozen=True, eq=False)
class Boundary:
    """Frequency `omega` [rad/s] at which the stability of the orbit changes on `ground`; NaN if no orbit was found in
    between. `uncertainty` [rad/s] is its standard uncertainty due to the specimen, `largest` the largest contribution.
    """

    beta: float
    factor: float
    ground: Ground
    omega: float
    found: Found
    uncertainty: float
    largest: str


def stability_points(
    specimen: Specimen, shaker: Shaker, request: StabilityRequest, progress: Progress = silent
) -> list[StabilityPoint]:
    """Rocking orbits by stiffness, amplitude and ascending frequency."""
    curves = [(beta, factor) for beta in request.beta for factor in request.amplitude_factor]
    omegas, branches = sorted(request.omega), list[tuple[float, float, Orbit, float]]()
    for k, (beta, factor) in enumerate(curves):
        progress("computing the steady motions", k, len(curves))
        spectrum = gain_spectrum(specimen.coupled(beta), omegas, factor * specimen.uplift_acceleration)
        found = (each.rocking for each in spectrum)
        branches += [(beta, factor, each.orbit, each.alpha_2) for each in found if each is not None]

    def point(branch: tuple[float, float, Orbit, float]) -> StabilityPoint:
        beta, factor, orbit, alpha_2 = branch
        on: dict[Ground, Found] = {
            ground: _found(orbit, ground, shaker, request.harmonics, request.sensitivity) for ground in GROUNDS
        }
        return StabilityPoint(beta, factor, orbit, alpha_2, on)

    return in_threads(point, branches, counting(progress, "computing the orbits on the table"))


def points_table(points: Sequence[StabilityPoint]) -> Table:
    """Table with one row per rocking orbit: its gain, its multiplier with the largest modulus on fixed ground and on
    the table, and the sensitivities of the modulus, if they were computed; NaN where no orbit was found on the table.
    """
    moduli = "greatest |Floquet multiplier|: fraction of a disturbance that remains after a period,"
    angles = "argument of that multiplier: 0 for a fold, pi for a flip, between them for Neimark-Sacker,"
    table = {
        "beta": _numbers([each.beta for each in points], "1", "stiffness ratio k_C/k1 of the coupling spring"),
        "amplitude_factor": _amplitudes([each.factor for each in points]),
        "omega_rad_s": _numbers(
            [each.orbit.omega for each in points], "rad/s", "circular frequency of the base motion"
        ),
        "alpha_2": _numbers([each.alpha_2 for each in points], "1", "gain of the peak drift on the orbit"),
    }
    for ground, name in GROUNDS.items():
        words = "on the table" if ground == "table" else "on fixed ground"
        found = [each.on[ground] for each in points]
        table[name] = _numbers([abs(each.multiplier) for each in found], "1", f"{moduli} {words}")
        argument = name.replace("modulus", "argument_rad")
        table[argument] = _numbers([float(np.angle(each.multiplier)) for each in found], "rad", f"{angles} {words}")
    for ground, name in GROUNDS.items():
        found = [each.on[ground] for each in points]
        if any(each.slopes is not None for each in found):
            table |= _slope_columns(found, name)
    return table


def stability_boundaries(
    specimen: Specimen,
    shaker: Shaker,
    known: SpecimenKnowledge,
    request: StabilityRequest,
    points: Sequence[StabilityPoint],
    progress: Progress = silent,
) -> list[Boundary]:
    """Changes of stability between adjacent frequencies of `points`, located by bisection, by ground, stiffness,
    amplitude and frequency.
    """
    changes: list[tuple[Ground, StabilityPoint, StabilityPoint]] = [
        (ground, low, high)
        for ground in GROUNDS
        for low, high in pairwise(points)
        if (low.beta, low.factor) == (high.beta, high.factor)
        and not np.isnan([low.on[ground].multiplier, high.on[ground].multiplier]).any()
        and (abs(low.on[ground].multiplier) < 1.0) != (abs(high.on[ground].multiplier) < 1.0)
    ]

    def located(change: tuple[Ground, StabilityPoint, StabilityPoint]) -> Boundary:
        ground, below, above = change
        stable, low, high = abs(below.on[ground].multiplier) < 1.0, below.orbit.omega, above.orbit.omega
        coupled = specimen.coupled(below.beta)

        def at(omega: float, sensitivity: bool = False) -> Found:
            branch = predict_gain(coupled, omega, below.orbit.amplitude).rocking
            return Found() if branch is None else _found(branch.orbit, ground, shaker, request.harmonics, sensitivity)

        while high - low > BOUNDARY:
            middle = 0.5 * (low + high)
            found = at(middle)
            if np.isnan(found.multiplier):
                return Boundary(below.beta, below.factor, ground, nan, Found(), nan, "")
            low, high = (middle, high) if (abs(found.multiplier) < 1.0) == stable else (low, middle)
        found = at(0.5 * (low + high), sensitivity=True)
        uncertainty, parts = nan, dict[str, float]()
        if found.slopes is not None:
            uncertainty, parts = known.propagated(coupled, found.slopes.boundary)
        largest = PARAMETERS[next(iter(parts))] if parts else ""
        return Boundary(below.beta, below.factor, ground, 0.5 * (low + high), found, uncertainty, largest)

    return in_threads(located, changes, counting(progress, "locating the boundaries"))


def boundaries_table(found: Sequence[Boundary]) -> Table:
    """Table with one row per boundary: frequency with its uncertainty, kind, and sensitivities."""
    multipliers = [each.found.multiplier for each in found]
    by_frequency = {
        f"omega_by_{column}_rad_s": _numbers(
            [_slope(each.found, name, of_frequency=True) for each in found],
            "rad/s",
            f"derivative of the frequency of the boundary with respect to the logarithm of {column}",
        )
        for name, column in PARAMETERS.items()
    }
    return {
        "beta": _numbers([each.beta for each in found], "1", "stiffness ratio of the coupling spring"),
        "amplitude_factor": _amplitudes([each.factor for each in found]),
        "ground": Column(np.array([each.ground for each in found], dtype=np.str_), "", "fixed ground, or table"),
        "omega_rad_s": _numbers(
            [each.omega for each in found], "rad/s", "frequency at which the stability of the orbit changes"
        ),
        "omega_uncertainty_rad_s": _numbers(
            [each.uncertainty for each in found],
            "rad/s",
            "standard uncertainty of this frequency due to the specimen, to first order",
        ),
        "largest": Column(
            np.array([each.largest for each in found], dtype=np.str_),
            "",
            "parameter with the largest contribution to the uncertainty",
        ),
        "argument_rad": _numbers(
            [float(np.angle(each)) for each in multipliers], "rad", "argument of the multiplier at this frequency"
        ),
        "kind": Column(
            np.array([_kind(each) for each in multipliers], dtype=np.str_),
            "",
            "fold, flip or Neimark-Sacker; empty if the bisection found no orbit",
        ),
        **by_frequency,
        **_slope_columns([each.found for each in found], "modulus"),
    }


def _numbers(values: Sequence[float], unit: str, description: str) -> Column:
    return Column(np.array(values, dtype=np.float64), unit, description)


def _amplitudes(factors: Sequence[float]) -> Column:
    return _numbers(factors, "1", "amplitude of the base acceleration, relative to the uplift acceleration")


def _slope_columns(found: Sequence[Found], modulus: str) -> dict[str, Column]:
    """Columns of d|mu|/d ln p."""
    return {
        f"{modulus}_by_{column}": _numbers(
            [_slope(each, name) for each in found],
            "1",
            f"derivative of {modulus} with respect to the logarithm of {column}",
        )
        for name, column in PARAMETERS.items()
    }


def _slope(found: Found, name: str, *, of_frequency: bool = False) -> float:
    """Derivative with respect to the logarithm of a parameter; NaN if it is unknown or the parameter is absent."""
    if found.slopes is None:
        return nan
    return (found.slopes.boundary if of_frequency else found.slopes.modulus).get(name, nan)


def _found(orbit: Orbit, ground: Ground, shaker: Shaker, harmonics: int, sensitivity: bool) -> Found:
    """Multiplier with the largest modulus on `ground`, with its sensitivities on request."""
    found = Found()
    try:
        if ground == "fixed ground":
            found = Found(orbit.slowest)
            return Found(orbit.slowest, fixed_slopes(orbit)) if sensitivity else found
        moving = table_orbit(orbit, shaker, harmonics)
        found = Found(moving.slowest)
        return Found(moving.slowest, table_slopes(moving, orbit, shaker)) if sensitivity else found
    except NoOrbit:
        return found


def _kind(multiplier: complex) -> str:
    if np.isnan(multiplier):
        return ""
    angle = float(np.angle(multiplier))
    if angle < REAL:
        return "fold"
    return "flip" if pi - angle < REAL else "Neimark-Sacker"
