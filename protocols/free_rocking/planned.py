"""The tilts of a run, how long each takes, and what the laser sees of them."""

from bench.analysis.free_rocking.swings import REST
from protocols.free_rocking.protocol import FreeRockingParameters
from sim import block_face
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter, theoretical_restitution
from sim.specimen import Specimen

_LESS_LOST = 0.8
"""Share of the theoretical loss of velocity at an impact for which a recording is long enough."""


def planned_tilts(parameters: FreeRockingParameters, specimen: Specimen) -> tuple[float, ...]:
    """The tilts [rad] in their order, smallest first, towards the frame (above zero) before away from it."""
    signs = {"both": (1.0, -1.0), "towards": (1.0,), "away": (-1.0,)}[parameters.sides]
    alpha = critical_angle(specimen.block)
    return tuple(sign * share * alpha for share in sorted(parameters.tilts) for sign in signs)


def seen_displacement(parameters: FreeRockingParameters, specimen: Specimen, tilt: float) -> float:
    """Displacement [m] of the lit point of the face at `tilt` [rad]; NaN where the beam misses the face."""
    return float(block_face.displacement(tilt, parameters.height, specimen.block))


def beam_heights(parameters: FreeRockingParameters, specimen: Specimen) -> tuple[float, float]:
    """Least and greatest height [m] at which the beam meets the face at every tilt."""
    faces = [block_face.heights(tilt, specimen.block) for tilt in planned_tilts(parameters, specimen)]
    return max(float(low) for low, _ in faces), min(float(high) for _, high in faces)


def recording_time(parameters: FreeRockingParameters, specimen: Specimen, tilt: float) -> float:
    """How long a tilt is recorded [s]: until the block, let go as late as allowed, has stood still long enough."""
    block = specimen.block
    r = 1.0 - _LESS_LOST * (1.0 - theoretical_restitution(block))
    motion = FreeRocking(critical_angle(block), frequency_parameter(block, specimen.g), r, tilt)
    return parameters.release_within + motion.rest_time + 1.5 * REST
