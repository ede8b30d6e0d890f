"""Parameters common to all tests with free decays, and the result of a decay."""

from copy import copy
from typing import Any

from sim.parameters import Parameters, quantity

EXPANDED = "expanded uncertainty of the preceding value (k = 2)"
_PARTS = "standard uncertainty by contribution, largest first, as JSON"
_COURSE = (
    "drift amplitudes in the mode [m], damping ratios at these amplitudes, and their standard uncertainties, as JSON"
)


class DecayParameters(Parameters):
    """Excitation and duration of the decays, and uncertainty of the weighed masses."""

    drift: float = quantity(
        0.030,
        "m",
        "target peak of the drift after a pulse, reduced if a limit of the bench requires it",
        gt=0,
        le=1,
    )
    pulse: float | None = quantity(
        None,
        "s",
        "duration of the pulse; if absent, the inverse of the geometric mean of the frame's natural frequencies",
        gt=0,
        le=10,
        usual=(0.02, 3.0),
    )
    window: float | None = quantity(
        None,
        "s",
        "time recorded after the excitation; if absent, until the first mode has decayed to a twelfth, at most 60 s",
        ge=5,
        le=300,
    )
    repeats: int = quantity(
        5, "1", "number of decays to combine; their scatter is compared with their uncertainty", ge=1, le=50
    )
    mass_uncertainty: float = quantity(
        0.0005, "kg", "standard uncertainty of the weighed mass of each storey", ge=0, le=0.1
    )
    mass_correlation: float = quantity(
        0.0, "1", "correlation of the errors of the two masses: 1 if both are due to the same balance", ge=0, le=1
    )


class DecayPoint(Parameters):
    """Frame identified from one decay or from all decays."""

    decay: int = quantity(..., "1", "number of the decay, from 1; 0 for all decays together", ge=0)
    decays: int = quantity(..., "1", "number of combined decays", ge=1)
    k1_n_m: float = quantity(..., "N/m", "stiffness of the first storey")
    k1_uncertainty: float = quantity(..., "N/m", EXPANDED)
    k2_n_m: float = quantity(..., "N/m", "stiffness of the second storey")
    k2_uncertainty: float = quantity(..., "N/m", EXPANDED)
    xi1: float = quantity(..., "1", "damping ratio of the first mode")
    xi1_uncertainty: float = quantity(..., "1", EXPANDED)
    xi2: float = quantity(..., "1", "damping ratio of the second mode")
    xi2_uncertainty: float = quantity(..., "1", EXPANDED)
    c1_n_s_m: float = quantity(..., "N s/m", "dashpot coefficient of the first storey")
    c1_uncertainty: float = quantity(..., "N s/m", EXPANDED)
    c2_n_s_m: float = quantity(..., "N s/m", "dashpot coefficient of the second storey")
    c2_uncertainty: float = quantity(..., "N s/m", EXPANDED)
    omega1_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the first mode")
    omega1_uncertainty: float = quantity(..., "rad/s", EXPANDED)
    omega2_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the second mode")
    omega2_uncertainty: float = quantity(..., "rad/s", EXPANDED)
    drift_peak_m: float = quantity(..., "m", "largest drift")
    residual_m: float = quantity(..., "m", "root mean square residual of the lasers' signals")
    birge: float | None = quantity(
        None, "1", "largest Birge ratio: scatter of the decays relative to their uncertainty; absent for one decay"
    )
    slope1_per_m: float = quantity(..., "1/m", "change of xi1 per metre of drift amplitude in the first mode")
    slope1_uncertainty: float = quantity(..., "1/m", EXPANDED)
    slope2_per_m: float = quantity(..., "1/m", "change of xi2 per metre of drift amplitude in the second mode")
    slope2_uncertainty: float = quantity(..., "1/m", EXPANDED)
    damping_is_linear: bool = quantity(..., "", "whether neither slope of the damping ratios is significant (99 %)")
    k1_parts: str = quantity("", "", _PARTS)
    k2_parts: str = quantity("", "", _PARTS)
    xi1_parts: str = quantity("", "", _PARTS)
    xi2_parts: str = quantity("", "", _PARTS)
    damping1_course: str = quantity("", "", _COURSE)
    damping2_course: str = quantity("", "", _COURSE)


def decay_field(name: str) -> Any:
    """Declaration of a field of `DecayPoint`, for the points of other protocols."""
    return copy(DecayPoint.model_fields[name])
