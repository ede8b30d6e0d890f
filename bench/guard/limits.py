"""What the table and the drive may do at most."""

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

    stop: float = quantity(4.0, "s", "length of the smooth ramp that ends a good run", gt=0)
    abort: float = quantity(0.5, "s", "length of the fast ramp that ends a bad run", gt=0)
