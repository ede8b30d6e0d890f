"""What the table and the drive may do at most."""

from pydantic import model_validator

from sim.parameters import Parameters, quantity


class Limits(Parameters):
    """Levels at which the guard aborts a run. Magnitudes, in SI units."""

    drive_voltage: float = quantity(8.0, "V", "largest command to the amplifier", gt=0, le=10)
    drive_slew: float = quantity(400.0, "V/s", "fastest change of the command", gt=0)
    displacement: float = quantity(0.060, "m", "largest displacement of the table from mid stroke", gt=0)
    velocity: float = quantity(0.60, "m/s", "largest velocity of the table", gt=0)
    acceleration: float = quantity(6.0, "m/s2", "largest acceleration of the table", gt=0)
    debounce: float = quantity(0.003, "s", "how long a measured limit must be exceeded before it counts", ge=0)
    sensor_loss: float = quantity(0.5, "s", "how long a sensor may give no valid sample before the run aborts", gt=0)


class Ramps(Parameters):
    """How the output is brought to zero."""

    stop: float = quantity(4.0, "s", "length of the smooth ramp that ends a good run", ge=0.05, le=60)
    abort: float = quantity(0.5, "s", "length of the fast ramp that ends a bad run", ge=0.05, le=10)

    @model_validator(mode="after")
    def _abort_is_the_fast_one(self) -> "Ramps":
        if self.abort > self.stop:
            raise ValueError("abort must not be longer than stop")
        return self
