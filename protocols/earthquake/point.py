"""The result of one record at one stiffness."""

from enum import StrEnum

from sim.parameters import Parameters, quantity


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
