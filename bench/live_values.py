"""Events with running values that are shown during a test: those of a protocol, of the gains and of the live model."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.events import Event, event
from sim.parameters import column

Array = NDArray[np.float64]


@event(table="live_values", journalled=False)
class LiveValue(Event):
    """Running value of a quantity that a protocol measures, with its `label`; NaN while unknown."""

    label: str = column("", "description of the quantity")
    value: float = column("of the row", "current value, in the unit of the row")
    unit: str = column("", 'SI unit of the row; "1" for a pure number', default="1")
    uncertainty: float = column("of the row", "expanded uncertainty of the value (k = 2); NaN if unknown", default=nan)
    predicted: float = column("of the row", "predicted value; NaN if there is none", default=nan)


@event(table="estimates", journalled=False)
class Estimate(Event):
    """Running gain coefficient of the point under test; NaN while unknown.

    `predicted` is the prediction for the branch of steady motion that the start of the test is intended to reach.
    """

    omega: float = column("rad/s", "circular frequency of the base motion")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    cycles: int = column("1", "number of cycles in the estimate")
    drift_peak: float = column("m", "peak drift")
    alpha_2: float = column("1", "running gain of the peak drift, coupled over bare")
    uncertainty: float = column("1", "expanded uncertainty of alpha_2 (k = 2)")
    predicted: float = column("1", "predicted alpha_2")


@event(table="running_gains", journalled=False)
class RunningGain(Event):
    """Gain under a record during its first `seconds`: ratio of the peak drifts so far, measured and predicted.

    Peaks are the largest magnitudes of the drift since the start of the record, for the coupled and the bare frame.
    Values are NaN while unknown; `beta` is None for the bare frame.
    """

    record: str = column("", "name of the record")
    beta: float | None = column("1", "stiffness ratio of the coupling spring; absent for the bare frame")
    seconds: float = column("s", "time since the start of the record")
    drift_peak: float = column("m", "peak drift since the record began")
    alpha_2: float = column("1", "ratio of the peak drifts so far, coupled over bare")
    predicted: float = column("1", "predicted alpha_2 so far")


TWIN_TRACE = ("seconds", "u1", "u2", "theta", "drift_low", "drift_high")
"""Columns of the trace of a `TwinEstimate`, in SI units."""


@event(table="twin", journalled=False, eq=False)
class TwinEstimate(Event):
    """State of the live model and of the specimen at the last sample for which both are known, `seconds` after the
    start of `run`. `time` is the instant at which the block with that sample had been read.

    Names that end in `_low` and `_high` denote the ends of the model's band, those in `_measured` the values of the
    lasers. `alpha_2` is available once the protocol has published a gain. `residual` is the root mean square (rms) of
    measured minus modelled drift over the last second, `excess` that of the distance of the measured drift from the
    band, which is 0 within the band. Both are divided by the largest rms of the measured drift over 1 s since taring,
    or by the uncertainty of the measured drift if that is larger. The band is formed by `members` models together with
    the nominal model. Values that are not available are NaN.

    `trace`, shape (n, 6), is the model's motion since the previous estimate, every 10 ms, with the columns TWIN_TRACE.
    """

    time: float = column("s", "bench time at which the block had been read", default=nan, kw_only=True)
    run: int = column("1", "number of the run; each arming of the rig begins one")
    seconds: float = column("s", "time in the run to which the values apply")
    members: int = column("1", "number of models that form the band, excluding the nominal one")
    standing: float = column("1", "fraction of the models, including the nominal one, whose block is standing")
    u1: float = column("m", "u1 of the model")
    u1_low: float = column("m", "u1, lower end of the model's band")
    u1_high: float = column("m", "u1, upper end of the model's band")
    u1_measured: float = column("m", "u1, measured")
    u2: float = column("m", "u2 of the model")
    u2_low: float = column("m", "u2, lower end of the model's band")
    u2_high: float = column("m", "u2, upper end of the model's band")
    u2_measured: float = column("m", "u2, measured")
    drift: float = column("m", "drift of the model")
    drift_low: float = column("m", "drift, lower end of the model's band")
    drift_high: float = column("m", "drift, upper end of the model's band")
    drift_measured: float = column("m", "drift, measured")
    drift_peak: float = column("m", "peak drift of the model since taring")
    drift_peak_low: float = column("m", "peak drift since taring, lower end of the model's band")
    drift_peak_high: float = column("m", "peak drift since taring, upper end of the model's band")
    drift_peak_measured: float = column("m", "measured peak drift since taring")
    alpha_2: float = column("1", "gain of the model's peak drift, coupled over bare")
    alpha_2_low: float = column("1", "gain of the peak drift, coupled over bare, lower end of the model's band")
    alpha_2_high: float = column("1", "gain of the peak drift, coupled over bare, upper end of the model's band")
    alpha_2_measured: float = column("1", "measured gain of the peak drift, coupled over bare")
    theta: float = column("rad", "rocking angle of the model")
    residual: float = column(
        "1", "rms of measured minus modelled drift over 1 s, relative to the largest rms of the measured drift so far"
    )
    excess: float = column(
        "1",
        "rms distance of the measured drift from the band over 1 s, relative to the largest rms of that drift so far",
    )
    trace: Array
