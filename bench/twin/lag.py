"""By how much later than the table's sensors the lasers show a motion, as far as their settings say."""

from bench.config.model import BenchConfiguration

_PIPELINE = 3
"""Measurements from exposure to output of an optoNCDT 1420; the output begins up to one later (manual, p. 52)."""
_HELD = 0.5
"""A measurement stays at an output until the next one: half of that on average."""


def laser_lag(configuration: BenchConfiguration) -> tuple[float, float]:
    """Behind the accelerometer, and behind the displacement sensor [s].

    Serial lasers are placed on the clock of the samples by `hardware.lasers.delay`: none is left.
    """
    if (told := configuration.twin.laser_lag) is not None:
        return told, told
    if configuration.backend == "simulated":
        laser = configuration.simulation.bench.laser_1
        lag = (laser.latency + _HELD) / laser.rate
        # its accelerometer gives the mean over the tick before
        return lag - 0.5 / configuration.sample_rate, lag
    lasers = configuration.hardware.lasers
    lag = 0.0 if lasers.connection == "serial" else (_PIPELINE + _HELD) / lasers.rate
    return lag, lag
