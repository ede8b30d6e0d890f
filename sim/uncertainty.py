"""What the identification of a specimen leaves open, and specimens drawn from it."""

import numpy as np

from sim.parameters import Parameters, quantity
from sim.specimen import Block, Frame, Specimen

LARGEST_DAMPING = 0.999
"""A drawn damping ratio stays below 1, as a frame's must."""

ELASTIC = 1.0 - 1e-12
"""A drawn restitution stays below 1, as a block's must, rounding included."""


class SpecimenUncertainty(Parameters):
    """Relative half widths: within them every value is equally likely (GUM 4.3.7), and none depends on another."""

    stiffness: float = quantity(0.05, "1", "of the stiffness of each storey", ge=0, le=0.5)
    damping: float = quantity(0.30, "1", "of the damping ratio of each mode", ge=0, le=0.9)
    restitution: float = quantity(0.01, "1", "of the block's restitution", ge=0, le=0.2)
    spring: float = quantity(0.10, "1", "of the stiffness of the coupling spring", ge=0, le=0.5)

    def draws(self, specimen: Specimen, n: int, random: np.random.Generator) -> list[Specimen]:
        """`n` specimens that `specimen` may really be. A restitution that would reach 1 is drawn just below."""
        widths = np.array([self.stiffness] * 2 + [self.damping] * 2 + [self.restitution, self.spring])
        factors = 1.0 + widths * random.uniform(-1.0, 1.0, (n, widths.size))
        return [_off(specimen, *(float(factor) for factor in row)) for row in factors]


def _off(
    specimen: Specimen, k1: float, k2: float, xi1: float, xi2: float, restitution: float, spring: float
) -> Specimen:
    """`specimen` with its values multiplied by the factors; the spring's is on k_C, whatever k1 is."""
    frame, block = specimen.frame, specimen.block
    # built anew: a copy would keep the natural frequencies that the frame has cached
    values = frame.model_dump() | {
        "k1": frame.k1 * k1,
        "k2": frame.k2 * k2,
        "xi1": min(frame.xi1 * xi1, LARGEST_DAMPING),
        "xi2": min(frame.xi2 * xi2, LARGEST_DAMPING),
    }
    elastic = ELASTIC / block.restitution if block.restitution > 0.0 else 1.0
    bounce = {"restitution_factor": block.restitution_factor * min(restitution, elastic)}
    return Specimen(
        frame=Frame(**values),
        block=Block(**(block.model_dump() | bounce)),
        beta=None if specimen.beta is None else specimen.beta * spring / k1,
        d=specimen.d,
        g=specimen.g,
    )
