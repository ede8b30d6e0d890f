"""The seismic campaign: what it asks for, the result of a point, and the object that others find."""

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, field_validator

from bench.protocol import Prepared, Protocol, Sources
from sim.parameters import COUPLING, Parameters, each_once, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.publication.campaign import Campaign
    from bench.report.page.document import Section

Stiffness = Annotated[float, Field(gt=0, le=100)]


class EarthquakeParameters(Parameters):
    """Earthquake records on the bare and the coupled frame; stiffnesses and peak are those of the paper."""

    records: tuple[str, ...] = quantity(
        (),
        "",
        "records, before the flags: FILE, FILE@KEY=VALUE,... or synthetic:NAME[:SEED] (see `rockbench records`); "
        "absent: the seven synthetic ones",
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios k_C/k1 of the coupling springs", min_length=1, usual=COUPLING
    )

    _each_once = field_validator("beta")(each_once)

    peak_factor: float = quantity(
        1.2, "1", "peak acceleration of the table over the uplift acceleration g/lambda", ge=0.05, le=5
    )
    table_band: str | None = quantity(
        None,
        "",
        "band LOW:HIGH [Hz] that the records are limited to before they are scaled (-6 dB, zero phase); absent: the "
        "usable band of the configured table",
    )
    length_ratio: float = quantity(
        1.0, "1", "model over prototype length: time is scaled by its root, acceleration kept", gt=0, le=1
    )
    trim: float = quantity(
        0.0005, "1", "share of the Arias intensity left out at either end of a record; 0 for none", ge=0, lt=0.1
    )
    longest: float = quantity(
        100.0,
        "s",
        "of a longer record, the part of this length with the most Arias intensity is played",
        ge=5,
        le=3600,
    )
    passes: int = quantity(
        5, "1", "passes at most in which the table learns a record, with the bare frame", ge=1, le=20
    )
    tolerance: float = quantity(
        0.005, "1", "rms error of the table without its noise, over the record's rms, that ends the passes", gt=0, lt=1
    )
    spectrum_tolerance: float = quantity(
        0.01,
        "1",
        "error of the table's response spectrum, 0.1 to 1 s and at the periods of the frame, without its noise, below "
        "which the passes end as well",
        gt=0,
        lt=1,
    )
    usable: float = quantity(
        0.05,
        "1",
        "rms error without its noise, over the record's rms, up to which the best drive is used although the passes "
        "ended before the tolerance: at a limit, at their number, or for want of samples",
        gt=0,
        lt=1,
    )
    decay: float = quantity(5.0, "s", "free vibration that is measured after a record", ge=0, le=120)
    rest: float = quantity(2.0, "s", "time at rest before a record, once the storeys are still", ge=0.5, le=60)
    draws: int = quantity(
        200,
        "1",
        "draws of the Monte Carlo behind each prediction; half of them for the bench alone, a quarter for each part",
        ge=40,
        le=5000,
    )


class PointStatus(StrEnum):
    """How a record ended."""

    MEASURED = "measured"
    OVERTURNED = "overturned"
    NOT_PLAYED = "not played"


class EarthquakePoint(Parameters):
    """Measured and predicted gains under one record.

    What was not measured is absent (None), never zero. Uncertainties of measured gains are expanded (k = 2); the
    interval of the prediction holds 95 % of what the Monte Carlo drew. Seconds are counted from the drive's begin.
    """

    record: str = quantity(..., "", "name of the record")
    beta: float = quantity(..., "1", "stiffness ratio of the coupling spring")
    status: PointStatus = quantity(..., "", "how the record ended")
    alpha_1: float | None = quantity(None, "1", "measured gain of the peak of u1, coupled over bare")
    alpha_1_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_1 (k = 2)")
    alpha_1_predicted: float | None = quantity(None, "1", "predicted gain of u1 for the achieved motions of the table")
    alpha_1_low: float | None = quantity(None, "1", "where the 95 % of what may be measured of it begin")
    alpha_1_high: float | None = quantity(None, "1", "where they end")
    alpha_1_agrees: bool | None = quantity(None, "1", "whether alpha_1 lies between alpha_1_low and alpha_1_high")
    alpha_2: float | None = quantity(None, "1", "measured gain of the peak drift, coupled over bare")
    alpha_2_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_2 (k = 2)")
    alpha_2_predicted: float | None = quantity(
        None, "1", "predicted gain for the achieved motions of the table, specimen as known"
    )
    alpha_2_low: float | None = quantity(None, "1", "where the 95 % of what may be measured begin, by Monte Carlo")
    alpha_2_high: float | None = quantity(None, "1", "where they end")
    alpha_2_target: float | None = quantity(
        None, "1", "predicted gain for the motion that the table was asked for; absent where the block would topple"
    )
    alpha_2_bench_uncertainty: float | None = quantity(
        None,
        "1",
        "95 % of measured minus predicted alpha_2 lie within, were the specimen known exactly; by Monte Carlo",
    )
    agrees: bool | None = quantity(None, "1", "whether alpha_2 lies between alpha_2_low and alpha_2_high")
    dominating: str = quantity("", "", "part of the uncertainty that is the largest")
    uncertainty_parts: str = quantity("", "", "standard uncertainty of alpha_2 by each part, as JSON")
    topple_chance: float | None = quantity(
        None, "1", "predicted chance that the block topples, over the uncertainty of specimen and motion"
    )
    overturned_s: float | None = quantity(
        None, "s", "when the block passed its critical angle for good, to about 0.3 s"
    )
    overturned_predicted_s: float | None = quantity(
        None, "s", "median of the predicted times at which it reaches 0.35 rad, about 0.45 s later"
    )
    drift_peak_m: float | None = quantity(None, "m", "peak drift of the coupled frame")
    bare_drift_peak_m: float | None = quantity(None, "m", "peak drift of the bare frame")
    drift_peak_s: float | None = quantity(None, "s", "when the coupled drift had its peak")
    pga_target_m_s2: float = quantity(..., "m/s2", "peak acceleration that the table was asked for")
    pga_m_s2: float | None = quantity(None, "m/s2", "achieved peak acceleration, coupled, up to 400 Hz")
    tracking_error: float | None = quantity(
        None, "1", "rms error of the table within the band over the record's rms, coupled"
    )
    spectrum_error: float | None = quantity(
        None, "1", "largest error of the response spectrum between 0.1 and 1 s, coupled"
    )
    motion_difference: float | None = quantity(
        None, "1", "rms difference between the table's motions, coupled and bare, over the record's rms"
    )
    bare_tracking_error: float | None = quantity(None, "1", "rms error of the table with the bare frame")
    passes: int = quantity(0, "1", "passes in which the table learned the record, bare frame")
    replication: str = quantity("", "", "how the learning ended")
    reason: str = quantity("", "", "why there is no gain, or what was noticed")


def _prepare(
    parameters: EarthquakeParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[EarthquakeParameters]:
    from protocols.earthquake.campaign import EarthquakeCampaign

    return EarthquakeCampaign(parameters, configuration, stored)


def _report(campaign: "Campaign") -> "list[Section]":
    from protocols.earthquake.report import seismic_section

    return [seismic_section(campaign)] if campaign.seismic_points else []


PROTOCOL = Protocol(
    name="earthquake",
    summary="Earthquake records on the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
    details=(
        "Each record is limited to a band, scaled, and fitted to the stroke; the table learns it with the bare "
        "frame, and it is played with every spring. The measured gain of the peak drift is compared with the one "
        "predicted for the motion that the table really made. A block that topples is a result. Records are files, "
        "or synthetic:NAME."
    ),
    example="RECORD.AT2 --beta 0.25 0.64",
    parameters=EarthquakeParameters,
    point=EarthquakePoint,
    prepare=_prepare,
    figures=(
        "gain_curves.png",
        "table_motions.png",
        "drift_histories.png",
    ),
    positional="records",
    report=_report,
)
