"""The harmonic protocol: what it asks for, the result of a point, and the object that others find."""

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator

from bench.protocol import Prepared, Protocol, Reanalysis, Sources
from sim.parameters import COUPLING, Parameters, each_once, quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.protocol import Follower
    from bench.record.reader import Record

Frequency = Annotated[float, Field(gt=0, le=40)]
Stiffness = Annotated[float, Field(gt=0, le=100)]


class HarmonicParameters(Parameters):
    """Steady-state harmonic tests of the bare and the coupled frame; the paper's campaign is the default."""

    omega: tuple[Frequency, ...] = quantity(
        (12.5, 15.0, 17.5, 20.0), "rad/s", "circular frequencies of the base motion", min_length=1
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios k_C/k1 of the coupling springs", min_length=1, usual=COUPLING
    )

    _each_once = field_validator("omega", "beta")(each_once)

    amplitude_factor: float = quantity(
        1.01, "1", "amplitude of the table acceleration over the uplift acceleration g/lambda", ge=0.1, le=5
    )
    amplitude_tolerance: float = quantity(
        0.001, "1", "largest relative error of the measured table amplitude before a point is measured", gt=0, le=0.1
    )
    phase_tolerance: float = quantity(
        0.00175,
        "rad",
        "largest error of the table's phase against the oscillator before a point is measured",
        gt=0,
        le=1,
    )
    distortion_tolerance: float = quantity(
        0.01, "1", "largest rms of the table's harmonics over its fundamental before a point is measured", gt=0, le=1
    )
    harmonics: int = quantity(
        10, "1", "highest harmonic of the table's acceleration that is cancelled; 1 for none", ge=1, le=10
    )
    calibration_level: float = quantity(
        0.5, "1", "level of the drive calibration relative to the test; below 1 so that the block rests", gt=0, lt=1
    )
    ramp_time: float = quantity(8.0, "s", "length of the ramp that starts the bare frame", gt=0, le=120)
    settle_tolerance: float = quantity(
        0.002, "1", "relative change still expected when a channel counts as steady", gt=0, le=0.1
    )
    settle_limit: float = quantity(240.0, "s", "longest wait for the steady state", gt=0, le=3600)
    measured_cycles: int = quantity(24, "1", "cycles over which a steady point is measured", ge=4, le=1000)
    starts: int = quantity(6, "1", "starts that are tried before a point is given up", ge=1, le=32)


class PointStatus(StrEnum):
    """How the coupled system moved at a point."""

    STEADY = "steady"
    MODULATED = "modulated"
    RESTING = "resting"
    OVERTURNED = "overturned"


class HarmonicPoint(Parameters):
    """Measured and predicted gain at one frequency and stiffness.

    What was not measured or does not exist is absent (None), never zero. Uncertainties are expanded (k = 2).
    The prediction is for the layer on which the point lies, at the achieved amplitudes.
    """

    omega_rad_s: float = quantity(..., "rad/s", "circular frequency of the base motion")
    beta: float = quantity(..., "1", "stiffness ratio of the coupling spring")
    status: PointStatus = quantity(..., "", "how the coupled system moved")
    layer: str = quantity(..., "", "steady state that the prediction is for: rocking or resting")
    alpha_2: float | None = quantity(None, "1", "measured gain of the peak drift, coupled over bare")
    alpha_2_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_2 (k = 2)")
    dominating: str = quantity("", "", "the largest part of the uncertainty of alpha_2")
    uncertainty_parts: str = quantity("", "", "standard uncertainty of alpha_2 by each part, largest first, as JSON")
    alpha_2_predicted: float | None = quantity(None, "1", "predicted gain at the achieved amplitude")
    alpha_2_predicted_uncertainty: float | None = quantity(
        None, "1", "expanded uncertainty of the predicted gain (k = 2): what is left open of the specimen"
    )
    predicted_stable: bool | None = quantity(None, "1", "whether the predicted orbit is stable")
    agrees: bool | None = quantity(None, "1", "difference within the uncertainties of both, root of their squares")
    drift_peak_m: float | None = quantity(None, "m", "peak drift of the coupled frame")
    bare_drift_peak_m: float | None = quantity(None, "m", "peak drift of the bare frame")
    amplitude_m_s2: float | None = quantity(None, "m/s2", "achieved amplitude of the table, coupled")
    bare_amplitude_m_s2: float | None = quantity(None, "m/s2", "achieved amplitude of the table, bare")
    amplitude_error: float | None = quantity(None, "1", "relative error of the table's amplitude, coupled")
    phase_error_rad: float | None = quantity(None, "rad", "how far the table is ahead of the oscillator, coupled")
    table_harmonics: float | None = quantity(
        None, "1", "total harmonic distortion: rms of the table's harmonics 2 to 10 over its fundamental, coupled"
    )
    table_updates: int = quantity(0, "1", "corrections of the drive until the table moved as asked, coupled")
    starts_tried: int = quantity(0, "1", "starts tried")
    start_chance: float | None = quantity(
        None, "1", "estimated chance of success of the start that was measured, or of the best where all fell"
    )
    cycles_measured: int = quantity(0, "1", "cycles over which the peaks were measured")
    settle_time_s: float | None = quantity(None, "s", "time from the dwell's begin to the steady state")
    reason: str = quantity("", "", "why the point is not steady, or what was noticed")


class HarmonicSettings(Parameters):
    """What can be chosen after the measurement; the defaults are what the campaign itself does."""

    measured_cycles: int | None = quantity(
        None,
        "1",
        "cycles at the end of each dwell that are used, back to the last change of its drive; absent: as measured",
        ge=4,
        le=10000,
    )
    # bench.analysis.cycles.HARMONICS, which a list of flags does not load
    harmonics: int = quantity(10, "1", "harmonics that are fitted to each cycle", ge=1, le=60)
    peak: Literal["judged", "mean", "largest"] = quantity(
        "judged",
        "",
        "peak of the mean cycle, largest peak met, or judged: the first where the motion is steady, else the second",
    )
    settle_tolerance: float | None = quantity(
        None, "1", "relative change still expected when a channel counts as steady; absent: as measured", gt=0, le=0.1
    )


def _prepare(
    parameters: HarmonicParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[HarmonicParameters]:
    from protocols.harmonic.campaign import HarmonicCampaign

    return HarmonicCampaign(parameters, configuration, stored)


def _follower(
    settings: HarmonicSettings,
    parameters: HarmonicParameters,
    configuration: "BenchConfiguration",
    record: "Record",
) -> "Follower":
    from protocols.harmonic.reanalysis import HarmonicFollower

    return HarmonicFollower(settings, parameters, configuration, record.sample_rate)


PROTOCOL = Protocol(
    name="harmonic",
    summary="Steady sine tests of the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
    details=(
        "Tests the bare frame at every frequency, then the coupled frame at every frequency and stiffness, and "
        "compares the measured gain of the peak drift with the predicted one. Without options: the campaign of the "
        "paper on the simulated bench."
    ),
    example="--omega 14:18:5 --beta 0.25 0.64 --yes",
    parameters=HarmonicParameters,
    point=HarmonicPoint,
    prepare=_prepare,
    figures=("gain_spectra.png",),
    reanalysis=Reanalysis(HarmonicSettings, _follower),
)
