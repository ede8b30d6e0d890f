"""The tilts of a run: their angles, the displacement at the laser, and the length of each recording."""

from collections.abc import Sequence
from dataclasses import dataclass

from bench.analysis.free_rocking.swings import REST as STANDING
from protocols.free_rocking.protocol import FreeRockingParameters
from sim import block_face
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter, theoretical_restitution
from sim.specimen import Specimen

REST = 1.0
"""Time at the beginning over which the zero of the signals is taken [s]: the operator holds the block."""

_OVERHEAD = 20.0
"""Time of a tilt besides its recording: the operator tilts the block and lets the recording begin [s]."""

_LEAST_LOSS = 0.8
"""Share of the theoretical loss of velocity at an impact for which a recording is long enough."""


@dataclass(frozen=True)
class PlannedTilt:
    """A tilt by `angle` [rad], above zero towards the frame, recorded for `recording` [s].

    `displacement` [m] is that of the point of the face that the laser measures, NaN where the beam misses the face.
    """

    angle: float
    displacement: float
    recording: float

    @property
    def before(self) -> float:
        """Expected time until the recording begins [s]."""
        return _OVERHEAD + REST

    @property
    def duration(self) -> float:
        """Expected time of the whole tilt, once recorded [s]."""
        return self.recording + REST + _OVERHEAD


def planned_tilts(parameters: FreeRockingParameters, specimen: Specimen) -> tuple[PlannedTilt, ...]:
    """The tilts in their order, smallest first, towards the frame before away from it."""
    signs = {"both": (1.0, -1.0), "towards": (1.0,), "away": (-1.0,)}[parameters.sides]
    alpha = critical_angle(specimen.block)
    return tuple(
        _planned(parameters, specimen, sign * share * alpha) for share in sorted(parameters.tilts) for sign in signs
    )


def beam_heights(tilts: Sequence[PlannedTilt], specimen: Specimen) -> tuple[float, float]:
    """Least and greatest height [m] at which the beam meets the face at every tilt."""
    faces = [block_face.heights(tilt.angle, specimen.block) for tilt in tilts]
    return max(float(low) for low, _ in faces), min(float(high) for _, high in faces)


def _planned(parameters: FreeRockingParameters, specimen: Specimen, angle: float) -> PlannedTilt:
    """A tilt, recorded until the block, released as late as allowed, has stood still long enough."""
    block = specimen.block
    r = 1.0 - _LEAST_LOSS * (1.0 - theoretical_restitution(block))
    motion = FreeRocking(critical_angle(block), frequency_parameter(block, specimen.g), r, angle)
    return PlannedTilt(
        angle=angle,
        displacement=float(block_face.displacement(angle, parameters.height, block)),
        recording=parameters.release_within + motion.rest_time + 1.5 * STANDING,
    )
