"""How the model that runs beside every test is set up."""

from sim.parameters import Parameters, quantity


class Twin(Parameters):
    """The live twin: the model of the specimen under the table's motion as it is measured."""

    enabled: bool | None = quantity(
        None,
        "",
        "whether the model runs beside every test; absent: where time is real, in virtual time it doubles the cost",
        example=True,
    )
    members: int = quantity(
        39,
        "",
        "specimens that the one on the table may be as well; n of them make a band that holds (n - 1)/(n + 1) of what "
        "may be measured",
        ge=0,
        le=199,
    )
    seed: int = quantity(1, "", "seed from which they are drawn", ge=0, lt=2**32)
    laser_lag: float | None = quantity(
        None,
        "s",
        "by how much later than the table's sensors the lasers show a motion; absent: what their settings come to",
        ge=-0.02,
        le=0.02,
        usual=(1e-4, 0.015),
        example=0.001,
    )
    residual_warn: float | None = quantity(
        0.15,
        "1",
        "root mean square of what of the measured drift lies outside the band, over that of the drift, that warns; "
        "absent: never",
        gt=0,
    )
    residual_stop: float | None = quantity(
        None, "1", "the same that ends the run along the smooth ramp; absent: never", gt=0, example=0.5
    )
    persistence: float = quantity(2.0, "s", "how long a residual must stay above a limit before it counts", ge=0, le=60)
