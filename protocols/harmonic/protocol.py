"""Harmonic protocol: comparison of measured and predicted gain in steady sine tests."""

from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from bench.protocol import Axis, Protocol, Reanalysis, RunView, deferred
from protocols.common.sine.settings import SineParameters
from sim.parameters import COUPLING, Parameters, each_once, quantity

Frequency = Annotated[float, Field(gt=0, le=40)]
Stiffness = Annotated[float, Field(gt=0, le=100)]


class HarmonicPoints(Parameters):
    """Test points of a campaign: frequencies, stiffness ratios and amplitude."""

    omega: tuple[Frequency, ...] = quantity(
        (12.5, 15.0, 17.5, 20.0), "rad/s", "circular frequencies of the base motion", min_length=1
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios k_C/k1 of the coupling springs", min_length=1, usual=COUPLING
    )

    _each_once = field_validator("omega", "beta")(each_once)

    amplitude_factor: float = quantity(
        1.01, "1", "amplitude of the table acceleration, relative to the uplift acceleration g/lambda", ge=0.1, le=5
    )


class HarmonicParameters(SineParameters, HarmonicPoints):
    """Steady-state harmonic tests of the bare and the coupled frame; the paper's campaign is the default."""

    hold: bool = quantity(
        True,
        "",
        "whether a motion that does not become steady, or whose orbit is unstable, is held on its orbit and measured "
        "again",
    )
    model_free: bool = quantity(
        False,
        "",
        "whether the stabiliser of a held motion uses a map identified in the run instead of the model of specimen and "
        "table",
    )
    free_cycles: int | None = quantity(
        96,
        "1",
        "number of cycles before the settle limit in which the drive of a motion that is not steady is not corrected, "
        "but at most the second half of the limit; 0: corrected until the limit",
        ge=0,
        le=1000,
    )
    laser_block: float | None = quantity(
        4.0,
        "s",
        "the errors of the lasers are found from the harmonics of steady tests if the lasers are not calibrated, and "
        "from the motion of the second storey where it is not steady, with residuals that may be correlated for this "
        "long; 0: as stated by the data sheet, the tests of the bare frame or the calibration",
        ge=0,
        le=60,
        usual=(0.5, 20.0),
    )


class PointStatus(StrEnum):
    """Motion of the coupled system at a point."""

    STEADY = "steady"
    HELD = "held"
    MODULATED = "modulated"
    RESTING = "resting"
    OVERTURNED = "overturned"


COMPARED = (PointStatus.STEADY, PointStatus.RESTING, PointStatus.HELD)
"""Statuses of points whose gain is compared with a predicted branch; an unsteady motion is not on the predicted orbit.
"""


def _end_of_range(side: str, name: str) -> Any:
    return quantity(
        None,
        "1",
        f"{side} end of the range of alpha_2_{name}_predicted among the drawn specimens whose block does not fall "
        "within 240 cycles; a range of n of them contains that of a further one with the probability "
        "(n - 1) / (n + 1), 95 % for all 39",
    )


class HarmonicPoint(Parameters):
    """Measured and predicted gain at one frequency and stiffness ratio.

    Quantities that were not measured or do not exist are None, never zero. Uncertainties are expanded (k = 2) unless
    called standard. The prediction is for the branch of the point and the achieved amplitudes.
    """

    omega_rad_s: float = quantity(..., "rad/s", "circular frequency of the base motion")
    beta: float = quantity(..., "1", "stiffness ratio of the coupling spring")
    status: PointStatus = quantity(..., "", "motion of the coupled system")
    layer: str = quantity(..., "", "predicted branch: rocking or resting; none if there is no such branch")
    alpha_2: float | None = quantity(None, "1", "measured gain of the peak drift, coupled over bare")
    alpha_2_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_2 (k = 2)")
    control_share: float | None = quantity(
        None, "1", "rms of the control over the measured cycles of a held motion, relative to the table's amplitude"
    )
    captured_cycles: int | None = quantity(
        None, "1", "number of cycles from the beginning of the hold to the capture of the motion"
    )
    model_free: bool | None = quantity(
        None, "", "whether a held motion was stabilised without the model of specimen and table"
    )
    alpha_2_least: float | None = quantity(
        None,
        "1",
        "gain of the largest drift within a period of an unsteady free motion: smallest over all positions of it",
    )
    alpha_2_least_uncertainty: float | None = quantity(
        None, "1", "expanded uncertainty of alpha_2_least (k = 2), as a property of the measured cycles"
    )
    alpha_2_greatest: float | None = quantity(None, "1", "gain of the largest drift of an unsteady free motion")
    alpha_2_greatest_uncertainty: float | None = quantity(
        None, "1", "expanded uncertainty of alpha_2_greatest (k = 2), as a property of the measured cycles"
    )
    alpha_2_mean: float | None = quantity(
        None,
        "1",
        "gain of the largest drift within a period of an unsteady free motion: mean over all positions of it",
    )
    alpha_2_mean_uncertainty: float | None = quantity(
        None, "1", "expanded uncertainty of alpha_2_mean (k = 2), as a property of the measured cycles"
    )
    alpha_2_least_predicted: float | None = quantity(
        None, "1", "predicted alpha_2_least of the long-term free motion; absent if the model's block falls"
    )
    alpha_2_mean_predicted: float | None = quantity(
        None, "1", "predicted alpha_2_mean of the long-term free motion; absent if the model's block falls"
    )
    alpha_2_greatest_predicted: float | None = quantity(
        None,
        "1",
        "predicted gain of the largest peak of the long-term free motion, where the orbit is unstable on the simulated "
        "table; absent if the model's block falls",
    )
    alpha_2_least_low: float | None = _end_of_range("lower", "least")
    alpha_2_least_high: float | None = _end_of_range("upper", "least")
    alpha_2_mean_low: float | None = _end_of_range("lower", "mean")
    alpha_2_mean_high: float | None = _end_of_range("upper", "mean")
    alpha_2_greatest_low: float | None = _end_of_range("lower", "greatest")
    alpha_2_greatest_high: float | None = _end_of_range("upper", "greatest")
    repeats_predicted: int | None = quantity(
        None, "1", "predicted number of cycles after which the free motion repeats; absent if it does not repeat"
    )
    falls_predicted: float | None = quantity(
        None, "1", "fraction of the specimens drawn within the uncertainty whose block falls in the free motion"
    )
    free_agrees: bool | None = quantity(
        None,
        "1",
        "whether least, mean and greatest peak are all within the predicted ranges, each widened by its uncertainty; "
        "absent if fewer than 20 of the drawn specimens give the ranges",
    )
    alpha_2_orbit: float | None = quantity(
        None, "1", "gain of the orbit about which an unsteady motion revolves, from the mean cycle of the motion"
    )
    alpha_2_orbit_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of alpha_2_orbit (k = 2)")
    orbit_agrees: bool | None = quantity(
        None, "1", "whether alpha_2_orbit and its prediction differ by no more than their combined uncertainty"
    )
    repeats_cycles: int | None = quantity(
        None, "1", "number of cycles after which an unsteady motion repeats, up to 24; absent if it does not repeat"
    )
    multiplier: float | None = quantity(
        None,
        "1",
        "measured modulus of the dominant Floquet multiplier of an unsteady motion, or of a held motion after its "
        "release; below 1, deviations from the periodic motion decay",
    )
    multiplier_uncertainty: float | None = quantity(None, "1", "expanded uncertainty of the multiplier (k = 2)")
    multiplier_angle_rad: float | None = quantity(
        None, "rad", "measured argument of the multiplier: rotation of the deviation in a cycle"
    )
    dominating: str = quantity("", "", "largest contribution to the uncertainty of alpha_2")
    uncertainty_parts: str = quantity("", "", "standard uncertainty of alpha_2 by contribution, largest first, as JSON")
    uncertainty_correlations: str = quantity(
        "",
        "",
        "correlation between the errors of the coupled and the bare test, by contribution, as JSON; errors cancel in "
        "alpha_2 as far as they are correlated",
    )
    degrees_of_freedom: float | None = quantity(
        None, "1", "effective degrees of freedom of the uncertainty of alpha_2 (GUM G.4); absent above 1000"
    )
    alpha_2_predicted: float | None = quantity(None, "1", "predicted gain at the achieved amplitude")
    alpha_2_predicted_uncertainty: float | None = quantity(
        None, "1", "expanded uncertainty of the predicted gain (k = 2), due to the specimen"
    )
    predicted_stable: bool | None = quantity(None, "1", "whether the predicted orbit is stable on fixed ground")
    table_multiplier: float | None = quantity(
        None,
        "1",
        "predicted modulus of the dominant Floquet multiplier on the simulated table, if the motion is not steady or "
        "the orbit is unstable on fixed ground",
    )
    agrees: bool | None = quantity(
        None,
        "1",
        "whether alpha_2 and its prediction differ by no more than their combined uncertainty (root sum of squares)",
    )
    drift_peak_m: float | None = quantity(None, "m", "peak drift of the coupled frame")
    bare_drift_peak_m: float | None = quantity(
        None, "m", "peak drift of the bare frame, corrected for errors of the lasers as that of the point is"
    )
    amplitude_m_s2: float | None = quantity(None, "m/s2", "achieved amplitude of the table, coupled frame")
    bare_amplitude_m_s2: float | None = quantity(None, "m/s2", "achieved amplitude of the table, bare frame")
    amplitude_error: float | None = quantity(None, "1", "relative error of the table's amplitude, coupled frame")
    phase_error_rad: float | None = quantity(
        None, "rad", "phase lead of the table relative to the drive oscillator, coupled frame"
    )
    table_harmonics: float | None = quantity(
        None,
        "1",
        "total harmonic distortion: rms of the table's harmonics 2 to 10 relative to the fundamental, coupled frame",
    )
    table_updates: int = quantity(
        0, "1", "number of drive corrections made to bring the table's motion within the tolerances, coupled frame"
    )
    starts_tried: int = quantity(0, "1", "number of starts tried")
    start_chance: float | None = quantity(
        None,
        "1",
        "estimated probability of success of the measured start, or of the best start if the block fell after every "
        "start",
    )
    cycles_measured: int = quantity(0, "1", "number of cycles evaluated for the peaks")
    settle_time_s: float | None = quantity(
        None, "s", "time from the start of the dwell to the end of the measured cycles"
    )
    reason: str = quantity("", "", "remarks, or the reason why the point is not steady")


class HarmonicSettings(Parameters):
    """Settings of a re-analysis; the defaults are the settings of the campaign."""

    measured_cycles: int | None = quantity(
        None,
        "1",
        "number of cycles evaluated at the end of each dwell, at most those after the last change of its drive, and "
        "of a hold at most those of the campaign or 24, whichever are more; if absent, as in the campaign",
        ge=4,
        le=10000,
    )
    # equals bench.analysis.cycles.HARMONICS; importing it would slow down the listing of the options
    harmonics: int = quantity(10, "1", "number of harmonics fitted to each cycle", ge=1, le=60)
    peak: Literal["judged", "mean", "largest"] = quantity(
        "judged",
        "",
        "mean: peak of the mean cycle; largest: largest single peak; judged: mean for a steady motion, else largest",
    )
    settle_tolerance: float | None = quantity(
        None,
        "1",
        "largest remaining relative change of a channel that is considered steady; if absent, as in the campaign",
        gt=0,
        le=0.1,
    )


PROTOCOL = Protocol(
    name="harmonic",
    summary="Steady sine tests of the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
    details=(
        "Tests the bare frame at every frequency, then the coupled frame at every frequency and stiffness, "
        "and compares the measured gain of the peak drift with the prediction. Without options, it runs the "
        "campaign of the paper on the simulated bench."
    ),
    example="--omega 14:18:5 --beta 0.25 0.64 --yes",
    parameters=HarmonicParameters,
    point=HarmonicPoint,
    prepare=deferred("protocols.harmonic.campaign:HarmonicCampaign"),
    figures=("gain_spectra.png",),
    events=("protocols.common.sine.holding:HoldCycle", "protocols.common.sine.holding:HoldMap"),
    reanalysis=Reanalysis(HarmonicSettings, deferred("protocols.harmonic.reanalysis:HarmonicFollower")),
    report=deferred("protocols.harmonic.report:harmonic_sections"),
    view=RunView(
        headline="alpha_2",
        labels={
            "alpha_2": "α₂",
            "alpha_2_least": "least α₂",
            "alpha_2_mean": "mean α₂",
            "alpha_2_greatest": "largest α₂",
            "alpha_2_orbit": "α₂ of the orbit",
            "multiplier": "multiplier",
        },
        matrix=(Axis("beta", "beta", "β {:g}"), Axis("omega", "omega_rad_s", "{:g} rad/s")),
        live=deferred("protocols.harmonic.live:gain_view"),
    ),
)
