"""What a decay came to, as the event that is kept and shown, and as findings for other runs."""

from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.decay import Decay
from bench.analysis.free_decay.modal import K1, K2, NAMES, UNITS, XI1, XI2
from bench.analysis.rounding import in_brackets
from bench.events import FitFinished, FittedParameter, Series
from protocols.common.decays.masses import MASSES, known_masses
from protocols.common.decays.results import FrameResult
from sim.identified import Correlation, Finding, Identified, possible

Array = NDArray[np.float64]

SOURCE = "free vibration of the bare frame"

FOUND = {"k1": K1, "k2": K2, "xi1": XI1, "xi2": XI2}
"""Quantities that go into the file of the specimen."""


def fit_finished(decay: Decay, name: str) -> FitFinished:
    """The decay with its fit, as measured by the lasers."""
    fit, stretch = decay.fit, decay.fit.stretch
    columns = {"time": Series(stretch.time, "s", "time since the start of the recording")}
    for place, laser in enumerate(("laser_1", "laser_2")):
        seen, fitted = stretch.seen[place], fit.fitted[place]
        columns[laser] = Series(seen, "m", f"what {laser} saw, means over the step of the time")
        columns[f"{laser}_fitted"] = Series(fitted, "m", f"what {laser} would see of the fitted frame")
        columns[f"{laser}_residual"] = Series(seen - fitted, "m", "measured less fitted")
    columns["table_displacement"] = Series(stretch.table, "m", "motion of the table that the fit follows")
    sizes = np.sqrt(np.diag(decay.doubt.own + decay.doubt.common))
    parameters = {
        key: FittedParameter(float(value), float(size), unit)
        for key, value, size, unit in zip(NAMES, decay.quantities, sizes, UNITS, strict=True)
    }
    return FitFinished(name, line_of(decay.quantities, sizes), columns, parameters)


def line_of(values: np.ndarray, sizes: np.ndarray) -> str:
    """The four quantities with their standard uncertainties, in one line."""
    return ", ".join(
        f"{name} {in_brackets(float(values[place]), float(sizes[place]))}"
        + (f" {UNITS[place]}" if UNITS[place] != "1" else "")
        for name, place in FOUND.items()
    )


def findings_of(result: FrameResult, known: Identified) -> tuple[list[Finding], list[Correlation]]:
    """Stiffnesses, damping ratios and the masses they were found with, and how all of them hang together.

    Masses that are known stay as they are; through them the frame hangs together with what else is known. A value that
    cannot be, such as a damping fitted below zero, is left out.
    """
    places = list(FOUND.values())
    inner = result.frame.covariance[np.ix_(places, places)]
    across = result.mass_shift[places] @ result.weighed
    whole = np.block([[inner, across], [across.T, result.weighed]])
    sizes = np.sqrt(np.diag(whole))
    names, values = [*FOUND, "m1", "m2"], [*result.frame.values[places].tolist(), *result.masses]
    date = datetime.now(UTC).replace(microsecond=0)
    sources = [*[SOURCE] * len(FOUND), *(f"as configured, with {size:.2g} kg left open" for size in sizes[-2:])]
    findings = [
        Finding(name=name, value=value, standard_uncertainty=float(size), source=origin, date=date)
        for name, value, size, origin in zip(names, values, sizes, sources, strict=True)
        if possible(name, value)
    ]
    made = {finding.name for finding in findings}
    alike = np.clip(whole / np.where(sizes > 0.0, np.outer(sizes, sizes), 1.0), -1.0, 1.0)
    correlations = [
        Correlation(first=first, second=names[j], coefficient=float(alike[i, j]))
        for i, first in enumerate(names)
        for j in range(i + 1, len(names))
        if sizes[i] > 0.0 and sizes[j] > 0.0 and {first, names[j]} <= made
    ]
    if known_masses(known) is None:
        return findings, correlations
    correlations = [one for one in correlations if one.pair != frozenset(MASSES)]
    kept = known.without(*FOUND, *MASSES).names
    shifts = dict(zip(FOUND, result.mass_shift[places], strict=True))
    for name, shift in ((name, shift) for name, shift in shifts.items() if name in made):
        size = float(sizes[names.index(name)])
        correlations += correlations_of(
            name, size, {each: through_masses(shift, known, each) for each in kept}, sizes_of(known)
        )
    return [finding for finding in findings if finding.name in FOUND], correlations


def impossible(result: FrameResult) -> str | None:
    """What of a result goes into no file because it cannot be; None where all can."""
    values = {name: float(result.frame.values[place]) for name, place in FOUND.items()}
    told = [f"{name} = {value:.3g}" for name, value in values.items() if not possible(name, value)]
    return f"{', '.join(told)} cannot be, and is not kept for other runs" if told else None


def through_masses(shift: Array, known: Identified, name: str) -> float:
    """Covariance of what follows the known masses by `shift`, shape (2,), with another quantity that is known."""
    return float(shift @ [covariance_of(known, mass, name) for mass in MASSES])


def covariance_of(known: Identified, first: str, second: str) -> float:
    """Covariance of two findings, or the variance of one."""
    places = (first,) if first == second else (first, second)
    return float(known.covariance(places)[0, -1])


def correlations_of(
    name: str, size: float, covariances: dict[str, float], sizes: dict[str, float]
) -> list[Correlation]:
    """Those of `name`, of standard uncertainty `size`, with others by their covariances with it and their `sizes`."""
    return [
        Correlation(first=name, second=other, coefficient=float(np.clip(covariance / (sizes[other] * size), -1.0, 1.0)))
        for other, covariance in covariances.items()
        if covariance != 0.0 and other in sizes and size > 0.0 and sizes[other] > 0.0
    ]


def sizes_of(known: Identified) -> dict[str, float]:
    """Standard uncertainties of what is known, by name."""
    return {finding.name: finding.standard_uncertainty for finding in known.findings}
