"""How far a predicted gain may be off because the specimen is not known better."""

from bench.analysis.gain import COVERAGE
from sim.errors import InvalidInput
from sim.gain import Layer
from sim.knowledge import SPRING, SpecimenKnowledge
from sim.sensitivity import Sensitivity, budget, sensitivities
from sim.steady import NoOrbit


def expanded_uncertainty(layer: Layer, known: SpecimenKnowledge) -> float | None:
    """Expanded uncertainty (k = 2) of the predicted alpha_2 of a steady motion, to first order.

    From the sensitivities of the steady motion and the covariance of what it is computed from. A spring is uncertain in
    its k_C, so beta = k_C / k1 moves against k1. None where the motion cannot be differentiated.
    """
    orbit = layer.orbit
    specimen = orbit.specimen
    try:
        slopes = sensitivities(specimen, orbit.omega, orbit.amplitude, orbit.layer, orbit)
    except (NoOrbit, InvalidInput):
        return None
    beta, k1 = slopes["beta"], slopes["k1"]
    each = {
        **slopes,
        "k1": Sensitivity(
            k1.value,
            alpha_1=k1.alpha_1 - beta.value / k1.value * beta.alpha_1,
            alpha_2=k1.alpha_2 - beta.value / k1.value * beta.alpha_2,
        ),
        SPRING: Sensitivity(specimen.k_c, beta.alpha_1 / k1.value, beta.alpha_2 / k1.value),
    }
    sizes = {name: size * each[name].value for name, size in known.relative(specimen).items()}
    return COVERAGE * budget(each, sizes, known.correlations(specimen)).alpha_2
