"""Comparison of the measured multipliers and boundaries with those predicted for several laws of restitution."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, nan

import numpy as np
from numpy.typing import NDArray

from bench.analysis.uncertainty import COVERAGE
from protocols.stability.prediction import Boundary, boundaries, on_table
from protocols.stability.protocol import StabilityPoint
from sim.knowledge import RESTITUTION, SpecimenKnowledge
from sim.multiplier_sensitivity import fixed_slopes
from sim.restitution_laws import laws
from sim.shaker import Shaker
from sim.steady import NoOrbit, Orbit, rocking_orbit

Curve = Mapping[str, NDArray[np.float64]]

HOUSNER = "housner"

WORDS = {HOUSNER: "Housner's law with the restitution factor"} | {law.name: law.words for law in laws()}

EXACT = ("stiffness", "damping", "spring")
"""Half widths that remain where the restitution is that of a law."""


@dataclass(frozen=True)
class LawPrediction:
    """Moduli predicted with each law, by its name, on the table if it is known, otherwise on fixed ground; NaN without
    an orbit. `uncertainty` is their standard uncertainty due to the specimen apart from its restitution, and `slope`
    the derivative of the modulus with respect to the logarithm of the restitution.
    """

    moduli: Mapping[str, float]
    uncertainty: float
    slope: float


def law_prediction(
    orbit: Orbit,
    multiplier: complex,
    known: SpecimenKnowledge,
    shaker: Shaker | None,
    harmonics: int,
    offset: float | None,
) -> LawPrediction:
    """Moduli at frequency and amplitude of `orbit`, whose `multiplier` is that of Housner's law with the restitution
    factor of its specimen.
    """
    moduli = {HOUSNER: abs(multiplier)}
    for law in laws(offset):
        moduli[law.name] = nan
        try:
            other = rocking_orbit(law.applied(orbit.specimen), orbit.omega, orbit.amplitude, guess=orbit)
        except NoOrbit:
            continue
        moving = other.slowest if shaker is None else on_table(other, shaker, harmonics)
        moduli[law.name] = nan if moving is None else abs(moving)
    try:
        slopes = fixed_slopes(orbit).modulus
    except NoOrbit:
        return LawPrediction(moduli, nan, nan)
    uncertainty, _ = known.only(*EXACT).propagated(orbit.specimen, slopes)
    return LawPrediction(moduli, uncertainty, slopes[RESTITUTION])


def predicted_columns(found: LawPrediction) -> dict[str, float]:
    """Values, by name, that a prediction contributes to a row of results or of the predicted curve."""
    moduli = {f"{name}_modulus": modulus for name, modulus in found.moduli.items() if name != HOUSNER}
    return {**moduli, "law_modulus_uncertainty": COVERAGE * found.uncertainty}


def implied(found: LawPrediction, factor: float, modulus: float, expanded: float) -> dict[str, float | None]:
    """Restitution factor that would give the measured `modulus`, to first order, with its expanded uncertainty.

    `factor` is the one of the prediction, `expanded` the expanded uncertainty of the measured modulus.
    """
    change = (modulus - found.moduli[HOUSNER]) / found.slope if found.slope else nan
    size = hypot(expanded, COVERAGE * found.uncertainty) / abs(found.slope) if found.slope else nan
    values = {"implied_factor": factor * (1.0 + change), "implied_factor_uncertainty": factor * size}
    return {name: value if value == value else None for name, value in values.items()}


def modulus_of(point: StabilityPoint, law: str) -> float | None:
    """Modulus predicted for a point with the law of this name."""
    return point.modulus_predicted if law == HOUSNER else getattr(point, f"{law}_modulus")


def deviation(point: StabilityPoint, law: str) -> float | None:
    """Normalised deviation of the measured modulus: its difference from the prediction, divided by the combined
    expanded uncertainty (root sum of squares); None if either is unknown.
    """
    expected, own = modulus_of(point, law), point.law_modulus_uncertainty
    if point.modulus is None or point.modulus_uncertainty is None or expected is None or own is None:
        return None
    return (point.modulus - expected) / hypot(point.modulus_uncertainty, own)


def closest(point: StabilityPoint) -> str:
    """Name of the law whose modulus is closest to the measured one; empty if none is known."""
    deviations = {law: abs(found) for law in WORDS if (found := deviation(point, law)) is not None}
    return min(deviations, key=deviations.__getitem__) if deviations else ""


def law_boundaries(curve: Curve) -> dict[str, list[Boundary]]:
    """Boundaries of the predicted curve by law, with their uncertainty due to the specimen apart from its restitution;
    empty for files without these predictions.
    """
    if "law_modulus_uncertainty" not in curve:
        return {}
    over = np.unique(curve["amplitude_factor"]).size > 1
    places = curve["amplitude_factor" if over else "omega_rad_s"].tolist()
    sizes = np.nan_to_num(curve["law_modulus_uncertainty"] / COVERAGE).tolist()
    own = np.where(np.isfinite(curve["table_modulus"]), curve["table_modulus"], curve["fixed_modulus"])
    moduli = {law: own if law == HOUSNER else curve[f"{law}_modulus"] for law in WORDS}
    return {law: boundaries(places, values.tolist(), sizes) for law, values in moduli.items()}


def law_texts(points: Sequence[StabilityPoint], measured: Sequence[Boundary], curve: Curve, unit: str) -> list[str]:
    """Statements on the laws: deviations of the measured moduli, boundaries, and the implied restitution factor."""
    compared = [point for point in points if closest(point)]
    lines = list[str]()
    for law, words in WORDS.items():
        found = [value for point in compared if (value := deviation(point, law)) is not None]
        if not found:
            continue
        near = sum(closest(point) == law for point in compared)
        ends = f"{min(found):+.2f}" if len(found) == 1 else f"{min(found):+.2f} to {max(found):+.2f}"
        lines.append(f"{words}: normalised deviation of |mu| {ends}, closest at {near} of {len(compared)} points")
    for law, places in law_boundaries(curve).items():
        for place in places:
            text = f"{WORDS[law]}: boundary {place.place:.4f} +- {place.uncertainty:.4f}{unit} (k = 2)"
            if measured:
                nearest = min(measured, key=lambda each: abs(each.place - place.place))
                size = hypot(nearest.uncertainty, place.uncertainty)
                text += f", normalised deviation of the measured one {(nearest.place - place.place) / size:+.2f}"
            lines.append(text)
    lines += [
        f"restitution factor implied by |mu| at {point.omega_rad_s:.4f} rad/s, amplitude factor "
        f"{point.amplitude_factor:.4f}: {point.implied_factor:.4f} +- {point.implied_factor_uncertainty:.4f} (k = 2)"
        for point in compared
        if point.implied_factor is not None
    ]
    return lines
