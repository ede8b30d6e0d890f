"""How far a predicted gain may be off because the specimen is not known better."""

from math import hypot, sqrt

from sim.budget import budget
from sim.errors import InvalidInput
from sim.gain import Layer
from sim.sensitivity import sensitivities
from sim.steady import NoOrbit
from sim.uncertainty import SpecimenUncertainty

COVERAGE = 2.0
"""Coverage factor k."""


def expanded_uncertainty(layer: Layer, uncertainty: SpecimenUncertainty) -> float | None:
    """Expanded uncertainty (k = 2) of the predicted alpha_2 of a steady motion, to first order.

    Half widths of rectangular distributions become standard uncertainties by 1 / sqrt(3) (GUM 4.3.7). The spring's is
    on k_C, so beta = k_C / k1 moves against k1. None where the motion cannot be differentiated.
    """
    orbit = layer.orbit
    specimen = orbit.specimen
    beta = specimen.beta or 0.0
    ratio = hypot(uncertainty.spring, uncertainty.stiffness)
    widths = {
        "k1": uncertainty.stiffness * specimen.frame.k1,
        "k2": uncertainty.stiffness * specimen.frame.k2,
        "xi1": uncertainty.damping * specimen.frame.xi1,
        "xi2": uncertainty.damping * specimen.frame.xi2,
        "restitution_factor": uncertainty.restitution * specimen.block.restitution_factor,
        "beta": ratio * beta,
    }
    against = {("k1", "beta"): -uncertainty.stiffness / ratio} if ratio > 0.0 and beta > 0.0 else {}
    try:
        slopes = sensitivities(specimen, orbit.omega, orbit.amplitude, orbit.layer, orbit)
    except (NoOrbit, InvalidInput):
        return None
    found = budget(slopes, {name: width / sqrt(3.0) for name, width in widths.items()}, against)
    return COVERAGE * found.alpha_2
