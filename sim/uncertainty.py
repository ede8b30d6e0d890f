"""How far the assumed values of a specimen may be off."""

from sim.parameters import Parameters, quantity


class SpecimenUncertainty(Parameters):
    """Relative half widths: within them every value is equally likely (GUM 4.3.7), and none depends on another."""

    stiffness: float = quantity(0.05, "1", "of the stiffness of each storey", ge=0, le=0.5)
    damping: float = quantity(0.30, "1", "of the damping ratio of each mode", ge=0, le=0.9)
    restitution: float = quantity(0.01, "1", "of the block's restitution", ge=0, le=0.2)
    spring: float = quantity(0.10, "1", "of the stiffness of the coupling spring", ge=0, le=0.5)
