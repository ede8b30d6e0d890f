"""Identification of the table: acceleration per volt of drive against frequency."""

from bench.protocol import Protocol, RunView, deferred
from protocols.common.identification.parameters import IdentifyParameters
from sim.parameters import Parameters, quantity


class IdentifiedBand(Parameters):
    """Response of the table in a third-octave band; relative quantities are referred to the gain of the band."""

    frequency_hz: float = quantity(..., "Hz", "centre frequency of the third-octave band")
    gain_m_s2_v: float = quantity(..., "m/s2/V", "table acceleration per volt of drive, rms over the lines of the band")
    phase_rad: float = quantity(
        ..., "rad", "phase lead of the acceleration relative to the drive at the line nearest to the centre"
    )
    uncertainty: float = quantity(
        ..., "1", "expanded relative uncertainty (k = 2) of a single line, due to noise and distortion"
    )
    distortion: float = quantity(
        ..., "1", "relative standard deviation of a single realisation, due to nonlinear distortion"
    )
    noise_m_s2_hz: float = quantity(..., "m/s2/Hz^0.5", "amplitude spectral density of the acceleration noise")
    coherence: float = quantity(..., "1", "lowest coherence of the acceleration with the drive in the band")
    lines: int = quantity(..., "1", "number of lines in the band")


PROTOCOL = Protocol(
    name="identify",
    summary="Identify the table: acceleration per volt of drive against frequency.",
    details=(
        "Probes the unknown table, plays low-level random-phase multisines with the specimen on the table, "
        "and separates response, noise and nonlinear distortion. The key `table_model` in the "
        "configuration of other runs names the result, table_model.json. Without options, a run identifies "
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
