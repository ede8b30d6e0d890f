"""Parameters that every test by free decays has, and the result of a decay."""

from sim.parameters import Parameters, quantity

_U = "its expanded uncertainty (k = 2)"
_PARTS = "its standard uncertainty by part, largest first, as JSON"
_COURSE = "amplitudes of the drift in the mode [m], damping ratios there, their standard uncertainties, as JSON"


class DecayParameters(Parameters):
    """Excitation and length of the decays, and the uncertainty of the weighed masses."""

    drift: float = quantity(
        0.030,
        "m",
        "peak of the drift that a pulse is to reach; less where a limit of the bench asks for it",
        gt=0,
        le=1,
    )
    pulse: float | None = quantity(
        None,
        "s",
        "length of the pulse; absent: one over the geometric mean of the frame's frequencies",
        gt=0,
        le=10,
        usual=(0.02, 3.0),
    )
    window: float | None = quantity(
        None,
        "s",
        "time after the excitation that is watched; absent: until a twelfth of the first mode is left, 60 s at most",
        ge=5,
        le=300,
    )
    repeats: int = quantity(
        5, "1", "decays that are combined: their scatter is held against their uncertainty", ge=1, le=50
    )
    mass_uncertainty: float = quantity(
        0.0005, "kg", "standard uncertainty of the weighed mass of each storey", ge=0, le=0.1
    )
    mass_correlation: float = quantity(
        0.0, "1", "correlation of the errors of the two masses: 1 where they are the balance's, as a whole", ge=0, le=1
    )


class DecayPoint(Parameters):
    """The frame from one decay, or from all of them."""

    decay: int = quantity(..., "1", "number of the decay, from 1; 0 for all of them together", ge=0)
    decays: int = quantity(..., "1", "decays in it", ge=1)
    k1_n_m: float = quantity(..., "N/m", "stiffness of the first storey")
    k1_uncertainty: float = quantity(..., "N/m", _U)
    k2_n_m: float = quantity(..., "N/m", "stiffness of the second storey")
    k2_uncertainty: float = quantity(..., "N/m", _U)
    xi1: float = quantity(..., "1", "damping ratio of the first mode")
    xi1_uncertainty: float = quantity(..., "1", _U)
    xi2: float = quantity(..., "1", "damping ratio of the second mode")
    xi2_uncertainty: float = quantity(..., "1", _U)
    c1_n_s_m: float = quantity(..., "N s/m", "dashpot of the first storey")
    c1_uncertainty: float = quantity(..., "N s/m", _U)
    c2_n_s_m: float = quantity(..., "N s/m", "dashpot of the second storey")
    c2_uncertainty: float = quantity(..., "N s/m", _U)
    omega1_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the first mode")
    omega1_uncertainty: float = quantity(..., "rad/s", _U)
    omega2_rad_s: float = quantity(..., "rad/s", "undamped circular frequency of the second mode")
    omega2_uncertainty: float = quantity(..., "rad/s", _U)
    drift_peak_m: float = quantity(..., "m", "largest drift")
    residual_m: float = quantity(..., "m", "root mean square of what the fit leaves of the lasers' signals")
    birge: float | None = quantity(
        None, "1", "largest Birge ratio: scatter of the decays over their own uncertainty; absent for one decay"
    )
    slope1_per_m: float = quantity(..., "1/m", "change of xi1 with the amplitude of the drift in the first mode")
    slope1_uncertainty: float = quantity(..., "1/m", _U)
    slope2_per_m: float = quantity(..., "1/m", "change of xi2 with the amplitude of the drift in the second mode")
    slope2_uncertainty: float = quantity(..., "1/m", _U)
    damping_is_linear: bool = quantity(..., "", "whether neither slope is significant (99 %)")
    k1_parts: str = quantity("", "", _PARTS)
    k2_parts: str = quantity("", "", _PARTS)
    xi1_parts: str = quantity("", "", _PARTS)
    xi2_parts: str = quantity("", "", _PARTS)
    damping1_course: str = quantity("", "", _COURSE)
    damping2_course: str = quantity("", "", _COURSE)
