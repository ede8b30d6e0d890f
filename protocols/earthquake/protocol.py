"""Earthquake protocol: measured against predicted gain under recorded ground motions."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field, field_validator

from bench.protocol import Axis, Protocol, RunView, deferred
from sim.parameters import COUPLING, Parameters, each_once, quantity

Stiffness = Annotated[float, Field(gt=0, le=100)]


class EarthquakeParameters(Parameters):
    """Earthquake records on the bare and the coupled frame; the default stiffnesses and peak are the paper's."""

    records: tuple[str, ...] = quantity(
        (),
        "",
        "records, given before the options: FILE, FILE@KEY=VALUE,... or synthetic:NAME[:SEED] (see `rockbench "
        "records`); if absent, the seven synthetic ones",
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios k_C/k1 of the coupling springs", min_length=1, usual=COUPLING
    )

    _each_once = field_validator("beta")(each_once)

    peak_factor: float = quantity(
        1.2, "1", "peak acceleration of the table, relative to the uplift acceleration g/lambda", ge=0.05, le=5
    )
    table_band: str | None = quantity(
        None,
        "",
        "band LOW:HIGH [Hz] to which records are filtered before scaling (-6 dB, zero phase); if absent, the "
        "usable band of the configured table",
    )
    length_ratio: float = quantity(
        1.0,
        "1",
        "length scale, model over prototype: time scales with its square root, acceleration is unchanged",
        gt=0,
        le=1,
    )
    trim: float = quantity(
        0.0005, "1", "fraction of the Arias intensity removed at each end of a record; 0: none", ge=0, lt=0.1
    )
    longest: float = quantity(
        100.0,
        "s",
        "longest duration taken from a record, before its time is scaled by length_ratio; of a longer record, the part "
        "with the largest Arias intensity is played",
        ge=5,
        le=3600,
    )
    passes: int = quantity(
        5, "1", "maximum number of replication passes for a record, with the bare frame", ge=1, le=20
    )
    tolerance: float = quantity(
        0.005,
        "1",
        "rms tracking error of the table, excluding noise, relative to the record's rms, at which the passes end",
        gt=0,
        lt=1,
    )
    spectrum_tolerance: float = quantity(
        0.01,
        "1",
        "tolerance for the error of the table's response spectrum, excluding noise, from 0.1 to 1 s and at the "
        "periods of the frame; the passes end when both tolerances are met",
        gt=0,
        lt=1,
    )
    usable: float = quantity(
        0.05,
        "1",
        "largest rms error, excluding noise, relative to the record's rms, at which the best drive is still used "
        "if the passes end before the tolerances are met because of a limit, the maximum number of passes, or missing "
        "samples",
        gt=0,
        lt=1,
    )
    decay: float = quantity(5.0, "s", "duration of the free vibration measured after a record", ge=0, le=120)
    rest: float = quantity(2.0, "s", "time at rest before a record, after the storeys have settled", ge=0.5, le=60)
    laser_check: bool = quantity(
        False,
        "",
        "whether a sine of the bare frame checks the linearity of the lasers before the records; readings are then "
        "corrected, and alpha_2 has a smaller uncertainty",
    )
    laser_block: float | None = quantity(
        4.0,
        "s",
        "the errors of the lasers, or what a calibration leaves of them, are found from the motion of the second "
        "storey in both tests of a point, with residuals that may be correlated for this long; 0: as stated by the "
        "data sheet, the check or the calibration",
        ge=0,
        le=60,
        usual=(0.5, 20.0),
    )
    draws: int = quantity(
        200,
        "1",
        "number of Monte Carlo draws for each prediction; half as many are used for an exactly known specimen, and a "
        "quarter as many for each contribution",
        ge=40,
        le=5000,
    )


class PointStatus(StrEnum):
    """Outcome of a record."""

    MEASURED = "measured"
    OVERTURNED = "overturned"
    NOT_PLAYED = "not played"


class EarthquakePoint(Parameters):
    """Measured and predicted gains under one record.

    Values that were not measured are None, never zero. Uncertainties of measured gains are expanded (k = 2); the
    interval of the prediction contains 95 % of the Monte Carlo draws. Times are relative to the start of the drive.
    """

    record: str = quantity(..., "", "name of the record")
    beta: float = quantity(..., "1", "stiffness ratio of the coupling spring")
    status: PointStatus = quantity(..., "", "outcome of the record")
    alpha_1: float | None = quantity(None, "1", "measured gain of the peak of u1, coupled over bare")
    alpha_1_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_1 (k = 2)")
    alpha_1_predicted: float | None = quantity(None, "1", "predicted gain of u1's peak for the achieved table motions")
    alpha_1_low: float | None = quantity(
        None, "1", "lower bound of the 95 % interval expected for the measured alpha_1"
    )
    alpha_1_high: float | None = quantity(
        None, "1", "upper bound of the 95 % interval expected for the measured alpha_1"
    )
    alpha_1_agrees: bool | None = quantity(None, "1", "whether alpha_1 is between alpha_1_low and alpha_1_high")
    alpha_2: float | None = quantity(None, "1", "measured gain of the peak drift, coupled over bare")
    alpha_2_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_2 (k = 2)")
    alpha_2_predicted: float | None = quantity(
        None, "1", "predicted gain of the peak drift for the achieved table motions"
    )
    alpha_2_low: float | None = quantity(
        None, "1", "lower bound of the 95 % interval expected for the measured alpha_2, by Monte Carlo simulation"
    )
    alpha_2_high: float | None = quantity(
        None, "1", "upper bound of the 95 % interval expected for the measured alpha_2"
    )
    alpha_2_target: float | None = quantity(
        None,
        "1",
        "predicted gain of the peak drift for the target motion; absent if the block would topple",
    )
    alpha_2_bench_uncertainty: float | None = quantity(
        None,
        "1",
        "half width of the 95 % interval of measured minus predicted alpha_2 for an exactly known specimen, "
        "by Monte Carlo simulation",
    )
    agrees: bool | None = quantity(None, "1", "whether alpha_2 is between alpha_2_low and alpha_2_high")
    dominating: str = quantity("", "", "name of the largest contribution to the uncertainty of alpha_2")
    uncertainty_parts: str = quantity("", "", "standard uncertainty of alpha_2 by contribution, as JSON")
    topple_chance: float | None = quantity(
        None, "1", "predicted probability that the block topples, given the uncertainty of specimen and motion"
    )
    overturned_s: float | None = quantity(
        None, "s", "time at which the block finally passed its critical angle, accurate to about 0.4 s"
    )
    overturned_predicted_s: float | None = quantity(
        None,
        "s",
        "median of the predicted times at which the block reaches 0.35 rad; it passes its critical angle earlier",
    )
    drift_peak_m: float | None = quantity(None, "m", "peak drift of the coupled frame")
    bare_drift_peak_m: float | None = quantity(None, "m", "peak drift of the bare frame")
    drift_peak_s: float | None = quantity(None, "s", "time of the peak of the coupled drift")
    pga_target_m_s2: float = quantity(..., "m/s2", "commanded peak acceleration of the table")
    pga_m_s2: float | None = quantity(
        None, "m/s2", "achieved peak acceleration of the table, coupled frame, up to 400 Hz"
    )
    tracking_error: float | None = quantity(
        None, "1", "rms error of the table within the band, relative to the record's rms, coupled frame"
    )
    spectrum_error: float | None = quantity(
        None, "1", "largest error of the response spectrum between 0.1 and 1 s, coupled frame"
    )
    motion_difference: float | None = quantity(
        None,
        "1",
        "rms difference between the table motions with the coupled and the bare frame, relative to the record's rms",
    )
    bare_tracking_error: float | None = quantity(
        None, "1", "rms error of the table within the band, relative to the record's rms, bare frame"
    )
    passes: int = quantity(0, "1", "number of passes of the replication with the bare frame")
    replication: str = quantity("", "", "outcome of the replication")
    reason: str = quantity("", "", "remarks, or the reason why the gain is absent")


PROTOCOL = Protocol(
    name="earthquake",
    summary="Earthquake records on the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
    details=(
        "Each record is limited to a band, scaled, and fitted to the stroke; the drive is iterated with the bare "
        "frame, and the record is played with every spring. The measured gain of the peak drift is compared with the "
        "gain predicted for the achieved motion of the table. A toppled block is a valid result. Records are files, "
        "or synthetic:NAME."
    ),
    example="RECORD.AT2 --beta 0.25 0.64",
    parameters=EarthquakeParameters,
    point=EarthquakePoint,
    prepare=deferred("protocols.earthquake.campaign:EarthquakeCampaign"),
    events=("protocols.common.replicate:PassFinished", "protocols.earthquake.laser_check:LasersChecked"),
    figures=(
        "gain_curves.png",
        "table_motions.png",
        "drift_histories.png",
    ),
    positional="records",
    report=deferred("protocols.earthquake.report:seismic_sections"),
    view=RunView(
        headline="alpha_2",
        labels={"alpha_1": "α₁", "alpha_2": "α₂"},
        matrix=(Axis("records", "record"), Axis("beta", "beta", "β {:g}")),
        by_columns=True,
        live=deferred("protocols.earthquake.live:seismic_view"),
    ),
)
