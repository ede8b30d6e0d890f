"""The result of one point of the harmonic campaign."""

from enum import StrEnum

from sim.parameters import Parameters, quantity


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
