"""Gain coefficients under earthquake records: against stiffness, and against the lower end of the table's band."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bench.accelerograms.accelerogram import Accelerogram
from bench.config.model import BenchConfiguration
from bench.config.numbers import read_band
from bench.control.preparation import PreparedMotion, prepare
from bench.control.stroke.fit import Method, periods_of
from bench.control.stroke.reach import Reach
from bench.prediction.bands import Bands, record_bands
from bench.prediction.requests import BandStudyRequest, RecordsRequest, SeismicRequest
from bench.progress import Progress, silent
from sim.errors import InvalidInput
from sim.gain import SeismicGain, seismic_curve
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen

Band = tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class SeismicCurve:
    """What the model says of one record: the motion of the table that it becomes, and a gain for each stiffness.

    `bands`, where they were asked for: of alpha_2 at each stiffness.
    """

    accelerogram: Accelerogram
    prepared: PreparedMotion
    gains: list[SeismicGain]
    bands: Bands | None = None


def band_of(text: str | None, configuration: BenchConfiguration) -> Band:
    """The band [Hz] that `text` asks for: "LOW:HIGH", "none", or None for the configured one. Raises InvalidInput."""
    if text is None:
        return configuration.table_band
    if text == "none":
        return None
    try:
        return read_band(text)
    except ValueError as error:
        allowed = str(error) or "it must be LOW:HIGH, two frequencies above 0 Hz that ascend, or none"
        raise InvalidInput("--table-band", text, allowed) from None


def seismic_curves(
    specimen: Specimen,
    records: Sequence[Accelerogram],
    request: SeismicRequest,
    configuration: BenchConfiguration,
    known: SpecimenKnowledge | None = None,
    progress: Progress = silent,
) -> list[SeismicCurve]:
    """A curve for each record, with the bands that are asked for, where it is `known` how well the specimen is.

    Raises InvalidInput for a record that cannot be prepared.
    """
    band, betas = band_of(request.table_band, configuration), sorted(request.beta)
    reach = None if request.stroke_fit == "none" else Reach.of(configuration)
    method = Method.HIGH_PASS if request.stroke_fit == "high-pass" else Method.LEAST_CHANGE
    curves: list[SeismicCurve] = []
    for record in records:
        progress("simulating the records", len(curves), len(records))
        curves.append(_curve(specimen, record, request, betas, band, reach, method))
    if known is None or not request.members:
        return curves
    coupled = [specimen.coupled(beta) for beta in betas]
    banded: list[SeismicCurve] = []
    for curve in curves:
        progress("computing the uncertainty bands", len(banded), len(curves))
        banded.append(replace(curve, bands=record_bands(coupled, curve.prepared.record, known, request.members)))
    return banded


def band_study(
    specimen: Specimen,
    records: Sequence[Accelerogram],
    request: BandStudyRequest,
    configuration: BenchConfiguration,
    progress: Progress = silent,
) -> list[SeismicCurve]:
    """A curve for each record at each lower end of the band, ascending; each is scaled to the peak by itself.

    Raises InvalidInput for a band that does not go up, or a record that cannot be prepared.
    """
    band, betas = band_of(request.table_band, configuration), sorted(request.beta)
    if band is None:
        raise InvalidInput("--table-band", "none", "the study moves the band's lower end: leave it out, or LOW:HIGH")
    if max(request.corner) >= band[1]:
        raise InvalidInput("--corner", max(request.corner), f"it must be below the band's upper end, {band[1]:g} Hz")
    bands = [(record, (corner, band[1])) for record in records for corner in sorted(request.corner)]
    curves: list[SeismicCurve] = []
    for record, limited in bands:
        progress("simulating the records", len(curves), len(bands))
        curves.append(_curve(specimen, record, request, betas, limited))
    return curves


def _curve(
    specimen: Specimen,
    record: Accelerogram,
    request: RecordsRequest,
    betas: Sequence[float],
    band: Band,
    reach: Reach | None = None,
    method: Method = Method.LEAST_CHANGE,
) -> SeismicCurve:
    try:
        prepared = prepare(
            record.sampled,
            band=band,
            peak=request.peak_factor * specimen.uplift_acceleration,
            reach=reach,
            method=method,
            trim=request.trim or None,
            length_ratio=request.length_ratio,
            periods=periods_of(specimen.frame),
        )
    except InvalidInput as refused:
        raise InvalidInput(f"{refused.item} of {record.name}", refused.value, refused.allowed) from None
    return SeismicCurve(record, prepared, seismic_curve(specimen, prepared.record, betas))
