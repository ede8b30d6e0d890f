"""Results of decays: the fit as an event, findings for other runs, and the storey masses on which the findings depend.

The masses are taken from the specimen file if it contains them, otherwise from the configuration.
"""

from collections.abc import Generator
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.decay import Decay
from bench.analysis.free_decay.response import K1, K2, NAMES, UNITS, XI1, XI2
from bench.analysis.uncertainty import in_brackets
from bench.config.model import BenchConfiguration
from bench.engine.steps import Outcome, Publish, Step
from bench.events import Warned
from bench.findings import FitFinished, FittedParameter, Series
from protocols.common.decays.frame import FrameResult
from protocols.common.decays.parameters import DecayParameters
from sim.channel import STOREYS, TABLE_DISPLACEMENT
from sim.errors import InvalidInput
from sim.identified import Correlation, Finding, Identified, possible

Array = NDArray[np.float64]

SOURCE = "free vibration of the bare frame"

FOUND = {"k1": K1, "k2": K2, "xi1": XI1, "xi2": XI2}
"""Quantities written to the specimen file."""

MASSES = ("m1", "m2")


def fit_finished(decay: Decay, name: str) -> FitFinished:
    """Event with the fit of a decay, labelled `name`, and the lasers' signals."""
    fit, stretch = decay.fit, decay.fit.stretch
    columns = {"time": Series(stretch.time, "s", "time since the start of the recording")}
    for row, laser in enumerate(STOREYS):
        measured, fitted = stretch.readings[row], fit.fitted[row]
        columns[laser] = Series(measured, "m", f"signal of {laser}, averaged over the time step")
        columns[f"{laser}_fitted"] = Series(fitted, "m", f"signal of {laser} computed with the fitted frame")
        columns[f"{laser}_residual"] = Series(measured - fitted, "m", "measured minus fitted")
    columns[TABLE_DISPLACEMENT] = Series(stretch.table, "m", "measured motion of the table, used as input of the fit")
    uncertainties = np.sqrt(np.diag(decay.uncertainty.own + decay.uncertainty.common))
    parameters = {
        key: FittedParameter(float(value), float(uncertainty), unit)
        for key, value, uncertainty, unit in zip(NAMES, decay.quantities, uncertainties, UNITS, strict=True)
    }
    return FitFinished(name, _summary(decay.quantities, uncertainties), columns, parameters)


def frame_findings(result: FrameResult, known: Identified) -> tuple[list[Finding], list[Correlation]]:
    """Stiffnesses, damping ratios, and the masses with which they were identified, with all correlations.

    Masses known from the specimen file are kept; they correlate the frame with all other known quantities. Physically
    impossible values, such as a negative damping ratio, are omitted.
    """
    indices = list(FOUND.values())
    inner = result.frame.covariance[np.ix_(indices, indices)]
    across = result.mass_shift[indices] @ result.masses_covariance
    whole = np.block([[inner, across], [across.T, result.masses_covariance]])
    uncertainties = np.sqrt(np.diag(whole))
    names, values = [*FOUND, "m1", "m2"], [*result.frame.values[indices].tolist(), *result.masses]
    date = datetime.now(UTC).replace(microsecond=0)
    sources = [
        *[SOURCE] * len(FOUND),
        *(f"as configured, with a standard uncertainty of {mass:.2g} kg" for mass in uncertainties[-2:]),
    ]
    findings = [
        Finding(name=name, value=value, standard_uncertainty=float(uncertainty), source=origin, date=date)
        for name, value, uncertainty, origin in zip(names, values, uncertainties, sources, strict=True)
        if possible(name, value)
    ]
    stated = {finding.name for finding in findings}
    coefficients = np.clip(
        whole / np.where(uncertainties > 0.0, np.outer(uncertainties, uncertainties), 1.0), -1.0, 1.0
    )
    correlations = [
        Correlation(first=first, second=names[j], coefficient=float(coefficients[i, j]))
        for i, first in enumerate(names)
        for j in range(i + 1, len(names))
        if uncertainties[i] > 0.0 and uncertainties[j] > 0.0 and {first, names[j]} <= stated
    ]
    if known_masses(known) is None:
        return findings, correlations
    correlations = [one for one in correlations if one.pair != frozenset(MASSES)]
    kept = known.without(*FOUND, *MASSES).names
    shifts = dict(zip(FOUND, result.mass_shift[indices], strict=True))
    for name, shift in ((name, shift) for name, shift in shifts.items() if name in stated):
        own = float(uncertainties[names.index(name)])
        correlations += correlations_with(
            name, own, {each: through_masses(shift, known, each) for each in kept}, standard_uncertainties(known)
        )
    return [finding for finding in findings if finding.name in FOUND], correlations


def impossible_values(result: FrameResult) -> str | None:
    """Warning that names physically impossible values, which are not stored; None if all values are possible."""
    values = {name: float(result.frame.values[place]) for name, place in FOUND.items()}
    texts = [f"{name} = {value:.3g}" for name, value in values.items() if not possible(name, value)]
    return f"physically impossible, and not stored for other runs: {', '.join(texts)}" if texts else None


def through_masses(shift: Array, known: Identified, name: str) -> float:
    """Covariance of the known quantity `name` with one whose sensitivity to the masses is `shift`, shape (2,)."""
    return float(shift @ [known_covariance(known, mass, name) for mass in MASSES])


def known_covariance(known: Identified, first: str, second: str) -> float:
    """Covariance of two known quantities, or the variance if both names are the same."""
    places = (first,) if first == second else (first, second)
    return float(known.covariance(places)[0, -1])


def correlations_with(
    name: str, own: float, covariances: dict[str, float], others: dict[str, float]
) -> list[Correlation]:
    """Correlations of `name`, whose standard uncertainty is `own`, with other quantities: `covariances` are those with
    `name`, and `others` the standard uncertainties of the other quantities.
    """
    return [
        Correlation(first=name, second=other, coefficient=float(np.clip(covariance / (others[other] * own), -1.0, 1.0)))
        for other, covariance in covariances.items()
        if covariance != 0.0 and other in others and own > 0.0 and others[other] > 0.0
    ]


def standard_uncertainties(known: Identified) -> dict[str, float]:
    """Standard uncertainties of the known quantities, by name."""
    return {finding.name: finding.standard_uncertainty for finding in known.findings}


def known_masses(known: Identified | None) -> Identified | None:
    """The identified quantities if they include both masses, otherwise None."""
    return known if known is not None and set(MASSES) <= set(known.names) else None


def mass_covariance(parameters: DecayParameters, known: Identified | None) -> NDArray[np.float64]:
    """Covariance of the two masses [kg2], shape (2, 2)."""
    if (found := known_masses(known)) is not None:
        return found.covariance(MASSES)
    rho = parameters.mass_correlation
    return parameters.mass_uncertainty**2 * np.array([[1.0, rho], [rho, 1.0]])


def check_masses(parameters: DecayParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput for a mass uncertainty or correlation other than the default if the specimen file includes
    both masses.
    """
    if (known := known_masses(configuration.identified)) is None:
        return
    for item in ("mass_uncertainty", "mass_correlation"):
        value = getattr(parameters, item)
        if value != DecayParameters.model_fields[item].default:
            allowed = (
                f"the masses are those of the specimen file, {_masses_text(known)}: omit this parameter, or remove "
                "both masses from that file"
            )
            raise InvalidInput(item, value, allowed)


def mass_warning(configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """Warn if the masses in configuration and specimen file differ; those of the specimen file are used."""
    if (known := known_masses(configuration.identified)) is None:
        return
    frame = configuration.specimen.frame
    found = {name: finding for name in MASSES if (finding := known.finding(name)) is not None}
    if any(finding.value != getattr(frame, name) for name, finding in found.items()):
        asked = f"specimen.frame.m1 = {frame.m1:.6g} kg and m2 = {frame.m2:.6g} kg"
        text = f"the masses are those of the specimen file, {_masses_text(known)}; {asked} are not used"
        yield Publish(Warned(text))


def _summary(values: np.ndarray, uncertainties: np.ndarray) -> str:
    """One-line summary of the stiffnesses and damping ratios with their standard uncertainties."""
    return ", ".join(
        f"{name} {in_brackets(float(values[index]), float(uncertainties[index]))}"
        + (f" {UNITS[index]}" if UNITS[index] != "1" else "")
        for name, index in FOUND.items()
    )


def _masses_text(known: Identified) -> str:
    found = [finding for name in MASSES if (finding := known.finding(name)) is not None]
    return ", ".join(f"{one.name} = {one.value:.6g} kg (u = {one.standard_uncertainty:.2g} kg)" for one in found)
