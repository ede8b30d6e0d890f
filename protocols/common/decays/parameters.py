"""What every test by free decays asks for."""

from sim.parameters import Parameters, quantity


class DecayParameters(Parameters):
    """How the frame is set in motion, for how long it is watched, and what the weighing of the storeys leaves open."""

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
