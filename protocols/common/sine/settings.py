"""Settings of steady sine tests: control of the table, detection of the steady state, starts and hold."""

from sim.parameters import Parameters, quantity


class SineParameters(Parameters):
    """Settings common to all steady sine tests."""

    amplitude_tolerance: float = quantity(
        0.001, "1", "largest relative error of the table's amplitude at which a point is measured", gt=0, le=0.1
    )
    phase_tolerance: float = quantity(
        0.00175,
        "rad",
        "largest error of the table's phase relative to the oscillator at which a point is measured",
        gt=0,
        le=1,
    )
    distortion_tolerance: float = quantity(
        0.01,
        "1",
        "largest rms of the table's harmonics, relative to the fundamental, at which a point is measured",
        gt=0,
        le=1,
    )
    harmonics: int = quantity(10, "1", "highest cancelled harmonic of the table's acceleration; 1: none", ge=1, le=10)
    calibration_level: float = quantity(
        0.5,
        "1",
        "level of the drive calibration relative to the level of the test; reduced if the block would not stay at rest",
        gt=0,
        lt=1,
    )
    ramp_time: float = quantity(8.0, "s", "duration of the ramp that starts a test of the bare frame", gt=0, le=120)
    settle_tolerance: float = quantity(
        0.002, "1", "largest remaining relative change of a channel that is considered steady", gt=0, le=0.1
    )
    settle_limit: float = quantity(240.0, "s", "longest wait for the steady state", gt=0, le=3600)
    measured_cycles: int = quantity(24, "1", "number of cycles measured at a steady point", ge=4, le=1000)
    starts: int = quantity(6, "1", "number of starts tried before a point is abandoned", ge=1, le=32)
    hold_authority: float = quantity(
        0.1, "1", "largest control of a held motion, relative to the table's amplitude", gt=0, le=0.2
    )
