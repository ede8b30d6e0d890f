"""What grows in the file besides the samples: the columns of every table, and the names that they take."""

from collections.abc import Mapping

from bench.events import Estimate, Event, PassFinished, RunningGain, TableIdentified, TwinEstimate
from bench.record.fields import Field, Kind
from bench.record.plot import TIME

FIXED_GROUPS = (
    "checksums",
    "data",
    "estimates",
    "events",
    "fit_columns",
    "fit_parameters",
    "fit_values",
    "fits",
    "fitted",
    "identified",
    "identified_correlations",
    "instrument",
    "metadata",
    "notes",
    "passes",
    "points",
    "recovery",
    "running_gains",
    "table_response",
    "twin",
    "user",
)
FIXED_ENTRIES = ("complete", "end_time", "program_name", "start_time", "status", "summary", "title")
COUNTED = (
    *("samples", "blocks", "events", "estimates", "points", "alignments"),
    *("running_gains", "passes", "table_response"),
    *("fits", "fit_columns", "fit_parameters", "fit_values"),
    "twin",
    *("identified", "identified_correlations"),
)
"""What is counted in the dataset `complete`: rows beyond were still on their way when the disk or the writer failed."""

FIXED_INSTRUMENTS = ("alignments", "blocks", "drive", "sample_rate", TIME)
BLOCKS = (
    Field("row", Kind.WHOLE, "1", "row of the samples at which the block begins"),
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("first", Kind.WHOLE, "1", "index of the block's first sample, counted from 0 in each run"),
    Field("time", Kind.REAL, "s", "bench time at which the block had been read"),
)
ALIGNMENTS = (
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("sensor", Kind.TEXT, "", "name of the channel"),
    Field("offset", Kind.REAL, "s", "time of the run at which second 0 of the sensor's clock stands, without delay"),
    Field("rate", Kind.REAL, "1", "seconds of the sample clock per second of the sensor's clock"),
    Field("residual", Kind.REAL, "s", "root mean square of what the fit leaves of the readings of the clocks"),
    Field("delay", Kind.REAL, "s", "fixed delay by which the values were placed later, as configured"),
    Field("values", Kind.WHOLE, "1", "values that the sensor gave"),
    Field("lost", Kind.WHOLE, "1", "values that it should have given and that did not arrive"),
)
EVENTS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("kind", Kind.TEXT, "", "what happened: the name of the event"),
    Field("text", Kind.TEXT, "", "one line for the reader"),
)
ESTIMATES = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("omega", Kind.REAL, "rad/s", "circular frequency of the base motion"),
    Field("beta", Kind.REAL, "1", "stiffness ratio of the coupling spring; absent for the bare frame", optional=True),
    Field("cycles", Kind.WHOLE, "1", "cycles over which the estimate was made"),
    Field("drift_peak", Kind.REAL, "m", "peak drift"),
    Field("alpha_2", Kind.REAL, "1", "running gain of the peak drift, coupled over bare"),
    Field("uncertainty", Kind.REAL, "1", "expanded uncertainty of alpha_2 (k = 2)"),
    Field("predicted", Kind.REAL, "1", "predicted alpha_2"),
)
RUNNING_GAINS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("record", Kind.TEXT, "", "the record that was played"),
    Field("beta", Kind.REAL, "1", "stiffness ratio of the coupling spring; absent for the bare frame", optional=True),
    Field("seconds", Kind.REAL, "s", "time into the record"),
    Field("drift_peak", Kind.REAL, "m", "peak drift since the record began"),
    Field("alpha_2", Kind.REAL, "1", "ratio of the peak drifts so far, coupled over bare"),
    Field("predicted", Kind.REAL, "1", "predicted alpha_2 so far"),
)
PASSES = (
    Field("time", Kind.REAL, "s", "bench time at which the pass was over"),
    Field("motion", Kind.TEXT, "", "the motion that the table was to follow"),
    Field("number", Kind.WHOLE, "1", "number of the pass, from 1 for each replication"),
    Field("error", Kind.REAL, "1", "root mean square error over that of the target, as measured"),
    Field("repeatable", Kind.REAL, "1", "the same without the part that does not repeat"),
    Field("peak_error", Kind.REAL, "1", "largest error over the peak of the target"),
    Field("spectrum_error", Kind.REAL, "1", "largest relative deviation of the response spectrum"),
    Field("accepted", Kind.SWITCH, "1", "whether the error was the smallest so far; else the drive went back"),
)
TABLE_RESPONSE = (
    Field("frequency", Kind.REAL, "Hz", "line of the identification"),
    Field("real", Kind.REAL, "m/s2/V", "table acceleration per drive, real part, exp(+i omega t)"),
    Field("imaginary", Kind.REAL, "m/s2/V", "imaginary part"),
    Field("uncertainty", Kind.REAL, "m/s2/V", "its standard uncertainty, noise and distortion together"),
    Field("distortion", Kind.REAL, "m/s2/V", "standard deviation of one realisation by nonlinear distortion alone"),
    Field("coherence", Kind.REAL, "1", "share of the acceleration's power that the drive explains"),
    Field("noise", Kind.REAL, "m/s2/Hz^0.5", "spectral density of the noise in the acceleration"),
)
_BESIDE = {
    "u1": ("m", "u1"),
    "u2": ("m", "u2"),
    "drift": ("m", "the drift"),
    "drift_peak": ("m", "the largest drift since the rig was armed"),
    "alpha_2": ("1", "the gain of the peak drift, coupled over bare"),
}
TWIN = (
    Field("time", Kind.REAL, "s", "bench time at which the block had been read"),
    Field("run", Kind.WHOLE, "1", "how many times the rig had been armed"),
    Field("seconds", Kind.REAL, "s", "time of the run that the values are for"),
    Field("members", Kind.WHOLE, "1", "models that made the band, besides the nominal one"),
    Field("standing", Kind.REAL, "1", "share of them whose block stood"),
    *(
        Field(f"{name}{end}", Kind.REAL, unit, f"{what}, {which}")
        for name, (unit, what) in _BESIDE.items()
        for end, which in (
            ("", "of the model"),
            ("_low", "where the model's band began"),
            ("_high", "where it ended"),
            ("_measured", "as measured"),
        )
    ),
    Field("theta", Kind.REAL, "rad", "angle of the model's block"),
    Field("residual", Kind.REAL, "1", "rms of measured minus modelled drift over a second, over the drift's largest"),
    Field("excess", Kind.REAL, "1", "the same of what of the measured drift lay outside the band"),
)
OWN_TABLES: Mapping[type[Event], tuple[str, tuple[Field, ...]]] = {
    Estimate: ("estimates", ESTIMATES),
    RunningGain: ("running_gains", RUNNING_GAINS),
    PassFinished: ("passes", PASSES),
    TableIdentified: ("table_response", TABLE_RESPONSE),
    TwinEstimate: ("twin", TWIN),
}
"""Events whose fields have a table of their own; arrays are as many rows."""

_PARTS = {
    f"/entry/{'instrument/' if name in FIXED_INSTRUMENTS else ''}{name}": name for name in COUNTED if name != "samples"
}


def part_of(path: str) -> str:
    """By which count of `complete` a dataset that grows goes: that of its table, or that of the samples."""
    return _PARTS.get(path.rpartition("/")[0], "samples")
