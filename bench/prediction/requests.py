"""What a prediction is asked for: declared once, used by command line, file and documentation. SI units."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from bench.config.numbers import spaced
from sim.parameters import COUPLING, Parameters, each_once, quantity

Frequency = Annotated[float, Field(gt=0, le=1000)]
Stiffness = Annotated[float, Field(ge=0, le=1000)]

Corner = Annotated[float, Field(gt=0, le=50)]

SolverName = Literal["taylor", "paper", "rk4-located", "dop853"]


class ModesRequest(Parameters):
    """Frequencies and shapes of the linearised system."""

    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.40, 0.64, 0.97),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=1,
        usual=COUPLING,
    )

    _each_once = field_validator("beta")(each_once)


class SineRequest(Parameters):
    """What every prediction of a response to a sine is asked for."""

    omega: tuple[Frequency, ...] = quantity(
        (12.5, 15.0, 17.5, 20.0),
        "rad/s",
        "circular frequencies of the base motion: values, or start:stop:count",
        min_length=1,
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=1,
        usual=COUPLING,
    )
    amplitude_factor: float = quantity(
        1.01, "1", "amplitude of the base acceleration over the uplift acceleration g/lambda", gt=0, le=1000
    )
    solver: SolverName = quantity(
        "taylor", "", "what computes motions; others than taylor are for comparison: a steady motion is a run of 120 s"
    )
    tolerance: float | None = quantity(
        None,
        "1",
        "relative tolerance of a step of taylor (1e-10 if absent) or dop853, the others have a step of 1 ms; steady "
        "motions by taylor close to 1e-11 or better, whatever is given",
        ge=1e-15,
        le=1e-3,
    )

    _each_once = field_validator("omega", "beta")(each_once)


class GainRequest(SineRequest):
    """What every prediction of a gain in a steady motion is asked for."""

    members: int = quantity(
        0,
        "1",
        "specimens that are drawn for the band of alpha_2, 95 % of which it holds; 0: it is computed to first order",
        ge=0,
        le=100_000,
    )


class SteadyRequest(GainRequest):
    """Steady motions at single points."""


class SpectrumRequest(GainRequest):
    """Gain against frequency, a spectrum for each stiffness."""

    omega: tuple[Frequency, ...] = quantity(
        spaced("12", "21", 181),
        "rad/s",
        "circular frequencies of the base motion: values, or start:stop:count",
        min_length=1,
    )


class MapRequest(GainRequest):
    """Gain over frequency and stiffness."""

    omega: tuple[Frequency, ...] = quantity(
        spaced("12", "21", 100),
        "rad/s",
        "circular frequencies of the base motion: values, or start:stop:count",
        min_length=2,
    )
    beta: tuple[Stiffness, ...] = quantity(
        spaced("0.1", "1.2", 100),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=2,
        usual=COUPLING,
    )
    outcomes: bool = quantity(
        False, "", "also start every point at rest with the sine switched on, and say what it comes to (3 ms a point)"
    )
    band: bool = quantity(
        False, "", "also compute the band of alpha_2 at every point (half a minute for the default map, to first order)"
    )
    scheduler: str | None = quantity(
        None, "", "address of a dask.distributed scheduler that shares out the work, such as tcp://10.0.0.5:8786"
    )


class HistoryRequest(SineRequest):
    """Time histories under a sine, from rest or in the steady state."""

    omega: tuple[Frequency, ...] = quantity(
        (16.0, 14.0, 17.5),
        "rad/s",
        "circular frequencies of the base motion: values, or start:stop:count",
        min_length=1,
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.40,),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=1,
        usual=COUPLING,
    )
    duration: float = quantity(12.0, "s", "length of a history that starts from rest", gt=0, le=3600)
    steady: bool = quantity(False, "", "show the steady motions instead of a start from rest")
    periods: int = quantity(3, "1", "periods of the drive that a steady history shows", ge=1, le=1000)
    samples_per_period: int = quantity(200, "1", "samples in a period of the drive", ge=8, le=10000)


class RecordsRequest(Parameters):
    """What every prediction of a response to earthquake records is asked for."""

    peak_factor: float = quantity(
        1.2, "1", "peak of each record, within the band, over the uplift acceleration g/lambda", gt=0, le=1000
    )
    table_band: str | None = quantity(
        None,
        "",
        "band of the table LOW:HIGH [Hz] that a record is limited to before it is scaled, or none; absent: that of "
        "the configured shaker",
    )
    trim: float = quantity(
        0.0005, "1", "share of the Arias intensity left out at either end of a record; 0 keeps all of it", ge=0, lt=0.5
    )
    length_ratio: float = quantity(
        1.0, "1", "model over prototype length: time goes with its root, acceleration is kept", gt=0, le=1
    )


class SeismicRequest(RecordsRequest):
    """Gain against stiffness under earthquake records."""

    beta: tuple[Stiffness, ...] = quantity(
        spaced("0.05", "1.2", 40),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=1,
        usual=COUPLING,
    )
    stroke_fit: Literal["none", "least-change", "high-pass"] = quantity(
        "none", "", "how the scaled motions are made to fit the configured bench's stroke"
    )
    members: int = quantity(
        0,
        "1",
        "specimens that are drawn at every stiffness for a band that holds 95 % of their alpha_2; 0: no band",
        ge=0,
        le=100_000,
    )

    _each_once = field_validator("beta")(each_once)


class BandStudyRequest(RecordsRequest):
    """Gain and overturning under earthquake records, against the lower end of the table's band."""

    corner: tuple[Corner, ...] = quantity(
        spaced("0.1", "3", 16),
        "Hz",
        "lower ends of the table's band: values, or start:stop:count; the upper end stays",
        min_length=2,
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97),
        "1",
        "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count",
        min_length=1,
        usual=COUPLING,
    )

    _each_once = field_validator("corner", "beta")(each_once)


class StrokeFitRequest(Parameters):
    """How a record is made to fit the table's stroke."""

    method: Literal["both", "least-change", "high-pass"] = quantity("both", "", "how it is made to fit; both: compared")
    share: float = quantity(0.9, "1", "share of the bench's stroke and limits that the motion may use", gt=0, le=1)
    peak_factor: float | None = quantity(
        None, "1", "peak before the fit over the uplift acceleration g/lambda; absent: as it is", gt=0, le=1000
    )
    table_band: str = quantity("none", "", "band LOW:HIGH [Hz] that the record is limited to before, or none")
    trim: float = quantity(
        0.0005,
        "1",
        "share of the Arias intensity left out at either end of the record; 0 keeps all of it",
        ge=0,
        lt=0.5,
    )
    length_ratio: float = quantity(
        1.0, "1", "model over prototype length: time goes with its root, acceleration is kept", gt=0, le=1
    )
