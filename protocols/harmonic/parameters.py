"""What the harmonic campaign asks for: declared once, used by command line, file and documentation."""

from typing import Annotated

from pydantic import Field, field_validator

from sim.parameters import COUPLING, Parameters, each_once, quantity

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
