"""Identification of the table: acceleration per volt of drive against frequency."""

from bench.protocol import Protocol, RunView, deferred
from protocols.common.identification.parameters import IdentifyParameters
from sim.parameters import Parameters, quantity


class IdentifiedBand(Parameters):
    """Response of the table in a third-octave band; relative quantities are relative to its gain."""

    frequency_hz: float = quantity(..., "Hz", "centre frequency of the third-octave band")
    gain_m_s2_v: float = quantity(..., "m/s2/V", "table acceleration per drive, rms over the lines")
    phase_rad: float = quantity(
        ..., "rad", "phase lead of the acceleration relative to the drive at the line nearest to the centre"
    )
    uncertainty: float = quantity(
        ..., "1", "expanded relative uncertainty of a line (k = 2) due to noise and distortion"
    )
    distortion: float = quantity(
        ..., "1", "relative standard deviation of a single realisation due to nonlinear distortion"
    )
    noise_m_s2_hz: float = quantity(..., "m/s2/Hz^0.5", "spectral density of the noise in the acceleration")
    coherence: float = quantity(..., "1", "lowest fraction of the acceleration's power that is coherent with the drive")
    lines: int = quantity(..., "1", "number of lines in the band")


PROTOCOL = Protocol(
    name="identify",
    summary="Identify the table: acceleration per volt of drive against frequency.",
    details=(
        "Plays multisines with random phases at low level with the specimen on the table, after probes of "
        "the unknown table, and separates response, noise and nonlinear distortion. The key `table_model` in "
        "the configuration of other runs names the result, table_model.json. Without options, it identifies "
        "the table with the bare frame, over the band required to replicate records."
    ),
    example="--config bench.toml --dry-run",
    parameters=IdentifyParameters,
    point=IdentifiedBand,
    prepare=deferred("protocols.identify.experiment:Identification"),
    figures=("table_response.png",),
    files=("table_model.json",),
    view=RunView(
        headline="gain_m_s2_v",
        labels={"frequency_hz": "frequency", "gain_m_s2_v": "acceleration per drive", "noise_m_s2_hz": "noise"},
        live=deferred("protocols.identify.live:response_view"),
    ),
)
