"""Parameters of predictions in SI units, declared once for command line, file and documentation."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from bench.config.numbers import spaced
from sim.errors import InvalidInput
from sim.parameters import COUPLING, Parameters, each_once, quantity

Frequency = Annotated[float, Field(gt=0, le=1000)]
Stiffness = Annotated[float, Field(ge=0, le=1000)]

Factor = Annotated[float, Field(gt=0, le=1000)]

Corner = Annotated[float, Field(gt=0, le=50)]

SolverName = Literal["taylor", "paper", "rk4-located", "dop853"]


def _frequencies(default: tuple[float, ...], least: int = 1) -> Any:
    described = "circular frequencies of the base motion: values, or start:stop:count"
    return quantity(default, "rad/s", described, min_length=least)


def _stiffnesses(default: tuple[float, ...], least: int = 1) -> Any:
    described = "stiffness ratios k_C/k1 of the coupling spring: values, or start:stop:count"
    return quantity(default, "1", described, min_length=least, usual=COUPLING)


class ModesRequest(Parameters):
    """Natural frequencies and mode shapes of the linearised system."""

    beta: tuple[Stiffness, ...] = _stiffnesses((0.25, 0.40, 0.64, 0.97))

    _each_once = field_validator("beta")(each_once)


class GridRequest(Parameters):
    """Frequencies and stiffnesses; every frequency is combined with every stiffness."""

    omega: tuple[Frequency, ...] = _frequencies((12.5, 15.0, 17.5, 20.0))
    beta: tuple[Stiffness, ...] = _stiffnesses((0.25, 0.64, 0.97))
    _each_once = field_validator("omega", "beta")(each_once)


class OrbitsRequest(GridRequest):
    """Points at which the steady motions under a sine are computed."""

    amplitude_factor: float = quantity(
        1.01, "1", "amplitude of the base acceleration, relative to the uplift acceleration g/lambda", gt=0, le=1000
    )


class SineRequest(OrbitsRequest):
    """Common parameters of the predictions of a response to a sine."""

    solver: SolverName = quantity(
        "taylor", "", "solver; all but taylor are for comparison and simulate 120 s for a steady motion"
    )
    tolerance: float | None = quantity(
        None,
        "1",
        "relative tolerance per step of taylor (1e-10 if absent) or dop853; the other solvers use a step of 1 ms; "
        "steady motions by taylor are periodic to about 1e-11, irrespective of the tolerance",
        ge=1e-15,
        le=1e-3,
    )


class GainRequest(SineRequest):
    """Common parameters of the predictions of steady gains."""

    members: int = quantity(
        0,
        "1",
        "number of specimens drawn for the band of alpha_2, which encloses 95 % of them; 0: a first-order band",
        ge=0,
        le=100_000,
    )
    scheduler: str | None = quantity(
        None, "", "address of a dask.distributed scheduler that distributes the work, such as tcp://10.0.0.5:8786"
    )

    @model_validator(mode="after")
    def _require_taylor(self) -> "GainRequest":
        asked = ("members", "outcomes", "band")
        given = next((name for name in asked if getattr(self, name, 0)), None)
        if self.solver != "taylor" and given is not None:
            allowed = f"only the solver taylor computes this, not {self.solver}: omit one of the two options"
            raise InvalidInput(given, getattr(self, given), allowed)
        return self


class SteadyRequest(GainRequest):
    """Steady motions at single points."""


class SpectrumRequest(GainRequest):
    """Gain against frequency: one spectrum for each stiffness."""

    omega: tuple[Frequency, ...] = _frequencies(spaced("12", "21", 181))


class MapRequest(GainRequest):
    """Gain on a grid of frequencies and stiffnesses."""

    omega: tuple[Frequency, ...] = _frequencies(spaced("12", "21", 100), least=2)
    beta: tuple[Stiffness, ...] = _stiffnesses(spaced("0.1", "1.2", 100), least=2)
    outcomes: bool = quantity(
        False,
        "",
        "also simulate the sine switched on at rest at every point, and report its outcome (about 3 ms per point)",
    )
    band: bool = quantity(
        False,
        "",
        "also compute the band of alpha_2 at every point (to first order, about half a minute for the default map)",
    )


class OnTableRequest(GridRequest):
    """Points at which steady motions are computed on a table that reacts to the force of the block."""

    table_mass: float | None = quantity(
        None,
        "kg",
        "moving mass of the table, without the specimen; if absent, that of the simulated bench",
        gt=0,
        le=1e6,
        usual=(5.0, 5000.0),
    )
    harmonics: int = quantity(
        10, "1", "highest controlled harmonic of the table's acceleration, as in a harmonic run", ge=1, le=10
    )


class StabilityRequest(OnTableRequest):
    """Stability of the rocking orbits, on fixed ground and on a table that reacts to the force of the block."""

    omega: tuple[Frequency, ...] = _frequencies(spaced("12", "16", 41), least=2)
    beta: tuple[Stiffness, ...] = _stiffnesses((0.64, 0.97))
    amplitude_factor: tuple[Factor, ...] = quantity(
        (1.01,),
        "1",
        "amplitudes of the base acceleration, relative to the uplift acceleration g/lambda: values, or "
        "start:stop:count",
        min_length=1,
    )
    sensitivity: bool = quantity(
        False,
        "",
        "also compute the sensitivities of the multipliers at every point (about 2 s of processor time per point); "
        "boundaries always have them",
    )

    _factors_once = field_validator("amplitude_factor")(each_once)


class AttractorRequest(OnTableRequest, OrbitsRequest):
    """Long-term motions where the rocking orbit is unstable, on a table that reacts to the force of the block."""

    omega: tuple[Frequency, ...] = _frequencies((12.5, 15.0))
    beta: tuple[Stiffness, ...] = _stiffnesses((0.64, 0.97))
    cycles: int = quantity(
        1500,
        "1",
        "number of cycles simulated before the motion is classified and its peaks are evaluated",
        ge=300,
        le=100_000,
    )
    members: int = quantity(
        39,
        "1",
        "number of specimens drawn for the ranges of the peaks and the fraction of falls, each followed for at most "
        "600 cycles",
        ge=0,
        le=10_000,
    )


class HistoryRequest(SineRequest):
    """Time histories under a sine, from rest or in the steady state."""

    omega: tuple[Frequency, ...] = _frequencies((16.0, 14.0, 17.5))
    beta: tuple[Stiffness, ...] = _stiffnesses((0.40,))
    duration: float = quantity(12.0, "s", "duration of a history that starts from rest", gt=0, le=3600)
    steady: bool = quantity(False, "", "compute the steady motions instead of a start from rest")
    periods: int = quantity(3, "1", "number of drive periods in a steady history", ge=1, le=1000)
    samples_per_period: int = quantity(200, "1", "number of samples per drive period", ge=8, le=10000)


class RecordsRequest(Parameters):
    """Common parameters of the predictions of a response to earthquake records."""

    peak_factor: float = quantity(
        1.2, "1", "peak of each filtered record, relative to the uplift acceleration g/lambda", gt=0, le=1000
    )
    table_band: str | None = quantity(
        None,
        "",
        "frequency band LOW:HIGH [Hz] of the table, to which records are filtered before scaling, or none; if absent, "
        "that of the configured bench",
    )
    trim: float = quantity(
        0.0005, "1", "fraction of the Arias intensity removed at each end of a record; 0: none", ge=0, lt=0.5
    )
    length_ratio: float = quantity(
        1.0,
        "1",
        "length scale, model over prototype: time scales with its square root, acceleration is unchanged",
        gt=0,
        le=1,
    )
    scheduler: str | None = quantity(
        None, "", "address of a dask.distributed scheduler that distributes the work, such as tcp://10.0.0.5:8786"
    )


class SeismicRequest(RecordsRequest):
    """Gain against stiffness under earthquake records."""

    beta: tuple[Stiffness, ...] = _stiffnesses(spaced("0.05", "1.2", 40))
    stroke_fit: Literal["none", "least-change", "high-pass"] = quantity(
        "none", "", "method by which the scaled motions are fitted to the stroke of the configured bench"
    )
    members: int = quantity(
        0,
        "1",
        "number of specimens drawn at every stiffness for a band that encloses 95 % of their alpha_2; 0: no band",
        ge=0,
        le=100_000,
    )

    _each_once = field_validator("beta")(each_once)


class BandStudyRequest(RecordsRequest):
    """Gain and overturning under earthquake records, against the lower end of the table's frequency band."""

    corner: tuple[Corner, ...] = quantity(
        spaced("0.1", "3", 16),
        "Hz",
        "lower ends of the table's frequency band: values, or start:stop:count; the upper end is constant",
        min_length=2,
    )
    beta: tuple[Stiffness, ...] = _stiffnesses((0.25, 0.64, 0.97))

    _each_once = field_validator("corner", "beta")(each_once)


class StrokeFitRequest(Parameters):
    """Fit of a record to the table's stroke."""

    method: Literal["both", "least-change", "high-pass"] = quantity(
        "both", "", "fitting method; both: fit by both methods and compare them"
    )
    share: float = quantity(0.9, "1", "fraction of half stroke and limits that the motion may use", gt=0, le=1)
    peak_factor: float | None = quantity(
        None,
        "1",
        "peak before the fit, relative to the uplift acceleration g/lambda; if absent, the record is not scaled",
        gt=0,
        le=1000,
    )
    table_band: str = quantity("none", "", "band LOW:HIGH [Hz] to which the record is filtered first, or none")
    trim: float = quantity(
        0.0005,
        "1",
        "fraction of the Arias intensity removed at each end of the record; 0: none",
        ge=0,
        lt=0.5,
    )
    length_ratio: float = quantity(
        1.0,
        "1",
        "length scale, model over prototype: time scales with its square root, acceleration is unchanged",
        gt=0,
        le=1,
    )
