"""The identification of the table: what is stated of a third of an octave, and the object that others find."""

from typing import TYPE_CHECKING

from bench.protocol import Prepared, Protocol, Sources
from protocols.common.identification.parameters import IdentifyParameters
from sim.parameters import Parameters, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration


class IdentifiedBand(Parameters):
    """The table's response over a third of an octave; shares are of the response there."""

    frequency_hz: float = quantity(..., "Hz", "middle of the third of an octave")
    gain_m_s2_v: float = quantity(..., "m/s2/V", "table acceleration per drive: root mean square over its lines")
    phase_rad: float = quantity(..., "rad", "phase of the acceleration before the drive at the line next to the middle")
    uncertainty: float = quantity(..., "1", "expanded relative uncertainty of a line (k = 2), noise and distortion")
    distortion: float = quantity(..., "1", "standard deviation of one realisation by nonlinear distortion, relative")
    noise_m_s2_hz: float = quantity(..., "m/s2/Hz^0.5", "spectral density of the noise in the acceleration")
    coherence: float = quantity(..., "1", "lowest share of the acceleration's power that the drive explains")
    lines: int = quantity(..., "1", "lines in it")


def _prepare(
    parameters: IdentifyParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[IdentifyParameters]:
    from protocols.identify.experiment import Identification

    return Identification(parameters, configuration, stored)


PROTOCOL = Protocol(
    name="identify",
    summary="Identify the table: what acceleration a volt of drive makes at each frequency.",
    details=(
        "Plays multisines with random phases at low level with the specimen on the table, after probes that need "
        "nothing to be known of it, and tells response, noise and nonlinear distortion apart. The result, "
        "table_model.json, is what `table_model` in the configuration of other runs names. Without options: the "
        "bare frame, over the band that replicating records takes."
    ),
    example="--config bench.toml --dry-run",
    parameters=IdentifyParameters,
    point=IdentifiedBand,
    prepare=_prepare,
    figures=("table_response.png",),
    files=("table_model.json",),
)
